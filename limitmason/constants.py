"""Physical constants and default tolerances, each stated once."""

GRAVITY = 9.81
"""Acceleration of gravity [m/s2]; weight appears only where this multiplies a mass."""

RELATIVE_TOLERANCE = 1e-4
"""Default contact tolerance as a fraction of the median smallest block dimension [-]."""

VERSION = "0.2.0"
"""Of this package; part of the key of values kept on disk."""
