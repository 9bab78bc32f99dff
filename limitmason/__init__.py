"""limitmason: at what load a structure of rigid blocks collapses, how, and how far the answer can be trusted.

Units are SI, axes right-handed with z up, compression positive; angles are radians unless a name ends in ``_deg``.
"""

from limitmason.storage.interrupts import told_in_one_line

told_in_one_line()  # first: the libraries take a second to load, and who stops a command there reads no traceback

# isort: split

from importlib import import_module
from typing import TYPE_CHECKING, Any

from limitmason.answers import references
from limitmason.answers.acceptance import Certificate
from limitmason.answers.curve import Curve
from limitmason.answers.results import Mechanism, Prediction, Resultants
from limitmason.constants import VERSION
from limitmason.display import notebook
from limitmason.display.progress import show_progress
from limitmason.model import (
    Assembly,
    Block,
    ContactError,
    ContactWarning,
    Interface,
    Joint,
    Loads,
    Material,
    PlausibilityWarning,
    Support,
    SupportMotion,
    Tie,
    ring_beam,
)

if TYPE_CHECKING:
    from limitmason import (
        answers,
        build,
        calibration,
        causes,
        codes,
        comparison,
        continuum,
        diagnosis,
        experiments,
        figures,
        formats,
        limit,
        mechanics,
        methods,
        study,
        vibration,
    )
    from limitmason.calibration import CurveTarget, Parameter, Target, calibrate
    from limitmason.capacity import elastic_range, pushover
    from limitmason.codes import assess
    from limitmason.comparison import compare
    from limitmason.figures import view
    from limitmason.limit import (
        axle_envelope,
        limit_analysis,
        limit_bracket,
        load_region,
        minimum_thickness,
        proven_range,
        settlement_analysis,
        strengthen,
        thrust,
    )
    from limitmason.mechanics.joint_forces import force_table
    from limitmason.methods import answer, predict, predict_cases
    from limitmason.stability_check import stability
    from limitmason.vibration import mac, modes

__version__ = VERSION
notebook.draws(lambda: import_module("limitmason.figures.notebook"))
references.data_by(lambda source: import_module("limitmason.experiments.registry").papers_of(source))

# loaded on first use: a script that only builds an assembly waits for neither solver nor matplotlib
_MODULES = (
    "answers", "build", "calibration", "causes", "codes", "continuum", "diagnosis", "experiments", "figures", "formats",
    "limit", "mechanics", "methods", "study", "comparison", "vibration",
)
_FUNCTIONS = {
    "calibration": ("calibrate", "CurveTarget", "Parameter", "Target"),
    "capacity": ("pushover", "elastic_range"),
    "codes": ("assess",),
    "comparison": ("compare",),
    "figures": ("view",),
    "limit": (
        "axle_envelope", "limit_analysis", "limit_bracket", "load_region", "minimum_thickness", "proven_range",
        "settlement_analysis", "strengthen", "thrust",
    ),
    "mechanics.joint_forces": ("force_table",),
    "methods": ("answer", "predict", "predict_cases"),
    "stability_check": ("stability",),
    "vibration": ("modes", "mac"),
}
_NAMES = {name: f"limitmason.{home}" for home, names in _FUNCTIONS.items() for name in names}

# packages of their own, above this one: found by name, as methods are, never imported by this package's code
_BESIDE = ("dem", "mechanisms")

__all__ = [
    "Assembly", "Block", "Certificate", "ContactError", "ContactWarning", "Curve", "Interface", "Joint", "Loads",
    "Material", "Mechanism", "PlausibilityWarning", "Prediction", "Resultants", "Support", "SupportMotion", "Tie",
    "ring_beam", "show_progress", *_MODULES, *_NAMES, *_BESIDE,
]


def __getattr__(name: str) -> Any:
    """Import a submodule, a function of one, or a package beside this one when it is first asked for."""
    if name in _MODULES:
        return import_module(f"limitmason.{name}")
    if name in _NAMES:
        return getattr(import_module(_NAMES[name]), name)
    if name in _BESIDE:
        return import_module(name)
    raise AttributeError(f"module 'limitmason' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Public names."""
    return sorted([*__all__, "__version__"])
