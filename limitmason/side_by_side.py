"""Former name of ``limitmason.validation.comparing``, kept for one release."""

import warnings

from limitmason.validation import Answer, SideBySide, compare, measured_range

__all__ = ["Answer", "SideBySide", "compare", "measured_range"]

warnings.warn(
    "limitmason.side_by_side is now limitmason.validation; the old name goes with the next release",
    DeprecationWarning,
    stacklevel=2,
)
