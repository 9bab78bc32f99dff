"""Figures ready for print: assembly, mechanism, joint forces, predicted against published, simulations.

Every function returns a ``matplotlib.figure.Figure`` made without pyplot (``animate`` writes a film): no window opens,
no global state changes.
"""

from limitmason.figures.comparison import predicted_against_published
from limitmason.figures.deformation import animate, deformed
from limitmason.figures.forces import contact_forces
from limitmason.figures.history import history_curves, load_displacement
from limitmason.figures.mechanism import assembly, mechanism
from limitmason.figures.studies import gap, side_by_side, study_lines
from limitmason.figures.style import print_style

__all__ = [
    "animate",
    "assembly",
    "contact_forces",
    "deformed",
    "gap",
    "history_curves",
    "load_displacement",
    "mechanism",
    "predicted_against_published",
    "print_style",
    "side_by_side",
    "study_lines",
]
