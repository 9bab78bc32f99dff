"""Explicit distinct element method on the same assemblies: stages of loading, and collapse multipliers."""

from dem.collapse import collapse
from dem.history import History
from dem.joints import JointOptions
from dem.loading import BaseMotion, Drive, Hold, Ramp, Settle, Stage, Tilt
from dem.simulate import simulate
from dem.state import State, UnstableError, make_state
from dem.stepping import Damping

__all__ = [
    "BaseMotion",
    "Damping",
    "Drive",
    "History",
    "Hold",
    "JointOptions",
    "Ramp",
    "Settle",
    "Stage",
    "State",
    "Tilt",
    "UnstableError",
    "collapse",
    "make_state",
    "simulate",
]
