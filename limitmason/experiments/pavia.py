"""Former place of ``limitmason.experiments.pavia_tilting``, kept for one release."""

import warnings

from limitmason.experiments.pavia_tilting import *  # noqa: F403

warnings.warn(
    f"{__name__} is now limitmason.experiments.pavia_tilting; the old name goes with the next release",
    DeprecationWarning,
    stacklevel=2,
)
