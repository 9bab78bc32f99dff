"""What becomes of a try of a step, where a path is by its largest load, and how paths end."""

from dataclasses import dataclass
from enum import StrEnum

from limitmason.arrays import Index
from limitmason.capacity.kinematics import Pose
from limitmason.capacity.step_equilibrium import Node
from limitmason.capacity.system import System


class PathEnd(StrEnum):
    """How a path ended."""

    REACHED = "reached"
    PASSED = "limit point passed"
    OVERTURNED = "overturned"
    STOPPED = "stopped"
    INTERRUPTED = "interrupted"
    PLATEAU = "slides on at constant load"
    OPENED = "open joints still bear bond"
    CANNOT_STAND = "cannot stand under dead load"


class Phase(StrEnum):
    """Where a path is by its largest load."""

    RISING = "rising"
    CLOSING = "closing in on a limit point"
    FALLING = "past a limit point"


class StepOutcome(StrEnum):
    """What becomes of a try of a step that does not end the path."""

    ACCEPTED = "accepted"
    SHORTER = "tried again, shorter"


@dataclass
class Try:
    """A try of a step.

    Parameters
    ----------
    system : equations with the contacts of the step
    last : state that it begins from
    move : length of the step that was tried, by its control displacement, above zero [m]
    guess : pose and multiplier that were extrapolated to its end; None without a history to extrapolate
    new : state that was found
    due : numbers of the points that break at once from there; None for none
    """

    system: System
    last: Node
    move: float
    guess: tuple[Pose, float] | None
    new: Node
    due: Index | None = None
