"""Physical constants and default tolerances, each stated once.

Angles up to which faces make a joint: ``limitmason.geometry.contact``.
"""

GRAVITY = 9.81
"""Acceleration of gravity [m/s2]; weight appears only where this multiplies a mass."""

RELATIVE_TOLERANCE = 1e-4
"""Gap or overlap up to which faces touch by default, as a part of the width of the smaller of two blocks [-]."""

VERSION = "0.2.0"
"""Of this package; part of the key of values kept on disk."""
