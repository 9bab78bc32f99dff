"""Explicit distinct element method on the same assemblies: stages of loading, and collapse multipliers."""

from dem.collapse import collapse
from dem.history import History
from dem.identification import identify, white_noise
from dem.joints import JointOptions
from dem.push import push
from dem.push_curve import PushCurve
from dem.settings import DemSettings, PushSettings
from dem.simulate import resume, simulate
from dem.state import State, UnsettledError, UnstableError, make_state
from dem.tilt import TiltTest, tilt_test
from limitmason.model.stages import BaseMotion, Damping, Drive, Hold, Ramp, Servo, Settle, Stage, Tilt

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
    "Servo",
    "Settle",
    "Stage",
    "State",
    "Tilt",
    "TiltTest",
    "UnsettledError",
    "UnstableError",
    "collapse",
    "identify",
    "make_state",
    "push",
    "resume",
    "simulate",
    "tilt_test",
    "white_noise",
]
