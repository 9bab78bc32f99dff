"""Figures ready for print: assembly, mechanism, joint forces, predicted against published.

Every function returns a ``matplotlib.figure.Figure`` made without pyplot: no window opens, no global state changes.
"""

from limitmason.figures.comparison import predicted_against_published
from limitmason.figures.forces import contact_forces
from limitmason.figures.mechanism import assembly, mechanism
from limitmason.figures.style import print_style

__all__ = ["assembly", "contact_forces", "mechanism", "predicted_against_published", "print_style"]
