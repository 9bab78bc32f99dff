"""What an adapter is: how an engine is asked, what own statics say of its answer, and which laws hold for it."""

import signal
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from .laws import SLOW, Answer
from .model import Model, Quantity
from .structures import structure

REFUSED, RAW, WHY = "refused", "raw error", "_why"

LONGEST = 15.0
"""Processor seconds after which an answer is not waited for."""


class TooLongError(Exception):
    """An answer that takes more than ``LONGEST``."""


@dataclass(frozen=True)
class Engine:
    """How an engine is asked and judged.

    Parameters
    ----------
    answer : quantities of a model
    judge : complaints of own statics about an answer
    laws : what the answer may not depend on
    tolerance : of a law, over the size of a quantity
    axes : whether directions are words for axes, so that only turns from axis to axis are laws
    drawn : options of the generator
    longest : processor seconds after which an answer is not waited for
    """

    name: str
    answer: Callable[[Model], Answer]
    judge: Callable[[Model, Answer], list[str]]
    laws: tuple[str, ...]
    tolerance: float = 1e-6
    axes: bool = False
    drawn: Callable[[int], dict] = lambda number: {}
    longest: float = LONGEST

    def model(self, seed: int, number: int) -> Model:
        """Structure ``number`` of a series of this engine."""
        return structure(seed, number, **self.drawn(number))

    def judged(self, model: Model, answer: Answer) -> list[str]:
        """Complaints of own statics; none where they take too long."""
        if not answer.keys().isdisjoint((REFUSED, RAW, SLOW)):
            return []
        with warnings.catch_warnings(), at_most(8 * self.longest):
            warnings.simplefilter("ignore")
            try:
                return self.judge(model, answer)
            except TooLongError:
                return []

    def ask(self, model: Model) -> Answer:
        """The answer, or the kind of error with which it is refused."""
        from limitmason.errors import InputError, NotApplicable, NotConverged

        with warnings.catch_warnings(), at_most(self.longest):
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", RuntimeWarning)
            try:
                return self.answer(model)
            except TooLongError:
                return {SLOW: True}
            except (InputError, NotApplicable, NotConverged) as error:
                return {REFUSED: type(error).__name__, WHY: str(error)}
            except Exception as error:  # what no user should see
                return {RAW: f"{type(error).__name__}: {error}"}


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """End what takes longer than so much processor time by a :class:`TooLongError`."""

    def stop(signum, frame):
        raise TooLongError

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def number(value: float, size: float | None = None, slack: float = 1.0, **powers: float) -> Quantity:
    """A number with its powers."""
    return Quantity(value, size=size, slack=slack, **powers)
