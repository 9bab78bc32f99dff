"""Explicit distinct element method on the same assemblies: stages of loading, and collapse multipliers."""

from dem.driving.push_curve import PushCurve
from dem.model.initial_state import initial_state
from dem.model.joints import JointOptions
from dem.model.state import State, UnsettledError, UnstableError
from dem.multiplier.collapse import collapse
from dem.multiplier.tilt import TiltTest, tilt_test
from dem.push import push
from dem.settings import DemSettings, PushSettings
from dem.stages.ambient_vibration import identify, white_noise
from dem.stages.history import History
from dem.stages.simulate import resume, simulate
from dem.stages.store import Store
from limitmason.display.notebook import shows
from limitmason.model.base_motion import BaseMotion
from limitmason.model.response_spectrum import ResponseSpectrum
from limitmason.model.stages import Damping, Drive, Hold, Ramp, Servo, Settle, Stage, Tilt

__all__ = [
    "BaseMotion",
    "Damping",
    "DemSettings",
    "Drive",
    "History",
    "Hold",
    "JointOptions",
    "PushCurve",
    "PushSettings",
    "Ramp",
    "ResponseSpectrum",
    "Servo",
    "Settle",
    "Stage",
    "State",
    "Store",
    "Tilt",
    "TiltTest",
    "UnsettledError",
    "UnstableError",
    "collapse",
    "identify",
    "initial_state",
    "push",
    "resume",
    "simulate",
    "tilt_test",
    "white_noise",
]

shows(__name__)
