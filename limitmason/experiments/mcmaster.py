"""Former place of ``limitmason.experiments.mcmaster_bending``, kept for one release."""

import warnings

from limitmason.experiments.mcmaster_bending import *  # noqa: F403

warnings.warn(
    f"{__name__} is now limitmason.experiments.mcmaster_bending; the old name goes with the next release",
    DeprecationWarning,
    stacklevel=2,
)
