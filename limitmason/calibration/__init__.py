"""Calibration: parameters from tests, how much the tests fix, what they predict, and which test would fix the rest.

>>> fit = lm.calibrate(model, {"peak": (4.8e3, 0.05), "stiffness": (4.1e7, 0.1)},
...                    [lm.Parameter("cohesion", 5e4, (1e3, 1e6)), lm.Parameter("normal_stiffness", 5e10, (1e9, 1e12))],
...                    ties={"shear_stiffness": "normal_stiffness / 2"})
"""

from limitmason.calibration.cross_validation import LeftOut
from limitmason.calibration.estimation import calibrate
from limitmason.calibration.information import NextTest, UnresolvedDirection
from limitmason.calibration.joint_model import JointModel
from limitmason.calibration.least_squares import SearchSettings
from limitmason.calibration.parameter import Parameter
from limitmason.calibration.result import Fit, Predicted
from limitmason.calibration.solid_model import SolidModel
from limitmason.calibration.targets import FEATURES, CurveTarget, Target
from limitmason.display.notebook import shows

__all__ = [
    "FEATURES", "CurveTarget", "Fit", "JointModel", "LeftOut", "NextTest", "Parameter", "Predicted", "SearchSettings",
    "SolidModel", "Target", "UnresolvedDirection", "calibrate",
]

shows(__name__)
