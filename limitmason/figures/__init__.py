"""Figures ready for print: structures, mechanisms, forces, comparisons, diagnoses.

Every function returns a ``matplotlib.figure.Figure`` made without pyplot (``animate`` writes a film, ``diagnosis_page``
a page, ``view`` an interactive scene): no window opens, no global state changes. Arguments stand in one order: the
model where it is needed, what is shown of it, the file that is written. An answer draws itself: ``answer.plot()``.
"""

from types import ModuleType

from limitmason.figures.assessment_page import assessment_report
from limitmason.figures.collapse_mechanism import assembly, mechanism
from limitmason.figures.comparison import predicted_against_published, predicted_beside_references
from limitmason.figures.confusion import confusable
from limitmason.figures.contacts import contact_report
from limitmason.figures.continuum import solid_map
from limitmason.figures.crack_patterns import cracks
from limitmason.figures.deformation import animate, deformed
from limitmason.figures.diagnosis_files import diagnosis_folder
from limitmason.figures.diagnosis_panels import diagnosis
from limitmason.figures.forces import contact_forces
from limitmason.figures.load_curves import history_curves, load_displacement
from limitmason.figures.modes import mac_matrix, mode_shape
from limitmason.figures.plastic_zones import plasticity
from limitmason.figures.report_page import structure_report
from limitmason.figures.safety import assessment, axle_envelope, load_region
from limitmason.figures.scene import Scene, view
from limitmason.figures.studies import histogram, side_by_side, study_lines
from limitmason.figures.style import print_style
from limitmason.figures.tilt import tilt_test
from limitmason.figures.verdict_page import diagnosis_page

__all__ = [
    "Scene", "animate", "assembly", "assessment", "assessment_report", "axle_envelope", "confusable", "contact_forces",
    "contact_report", "cracks", "deformed", "diagnosis", "diagnosis_folder", "diagnosis_page", "histogram",
    "history_curves", "load_displacement", "load_region", "mac_matrix", "mechanism", "mode_shape", "plasticity",
    "predicted_against_published", "predicted_beside_references", "print_style", "side_by_side", "solid_map",
    "structure_report", "study_lines", "tilt_test", "view",
]

# here is what draws, and nothing else: the name of a file would be found where a figure is looked for
for _name in [n for n, v in globals().items() if isinstance(v, ModuleType)]:
    del globals()[_name]


def __dir__() -> list[str]:
    """Functions that draw."""
    return sorted(__all__)
