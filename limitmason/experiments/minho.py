"""Former place of ``limitmason.experiments.minho_dry_stone_2005_2009``, kept for one release."""

import warnings

from limitmason.experiments.minho_dry_stone_2005_2009 import *  # noqa: F403

warnings.warn(
    f"{__name__} is now limitmason.experiments.minho_dry_stone_2005_2009; the old name goes with the next release",
    DeprecationWarning,
    stacklevel=2,
)
