"""Former place of ``limitmason.experiments.murano_u_walls``, kept for one release."""

import warnings

from limitmason.experiments.murano_u_walls import *  # noqa: F403

warnings.warn(
    f"{__name__} is now limitmason.experiments.murano_u_walls; the old name goes with the next release",
    DeprecationWarning,
    stacklevel=2,
)
