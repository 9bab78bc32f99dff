"""Former name of ``limitmason.validation``, kept for one release."""

import warnings

from limitmason.validation import *  # noqa: F403

warnings.warn(
    "limitmason.packaged is now limitmason.validation; the old name goes with the next release",
    DeprecationWarning,
    stacklevel=2,
)
