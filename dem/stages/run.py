"""Runs of blocks of any kind: stepped to their end, kept in files, stopped."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

from dem.stages.resuming import RunStatus, interrupts_wait
from limitmason.checks import count, listener
from limitmason.display.progress import reached, taken_up, watched
from limitmason.storage.interrupts import ends_early

Progress = Callable[[Mapping[str, Any]], object]


class Run(Protocol):
    """Blocks of any kind on their way: what steps them, from one sample to the next."""

    @property
    def over(self) -> bool:
        """Whether there is nothing left to do."""

    @property
    def status(self) -> RunStatus:
        """How what is done has ended."""

    @property
    def samples(self) -> int:
        """Samples so far."""

    @property
    def where(self) -> tuple[float | None, str]:
        """Part of it that is done, None where it cannot be told, and where it stands."""

    def begin(self) -> None:
        """Stand ready for the first chunk of steps."""

    def advance(self) -> Mapping[str, Any] | None:
        """Take a chunk of steps: what was sampled at its end, by name, else None."""

    def finish(self) -> None:
        """Let go what the run has held."""

    def note(self, text: str) -> None:
        """Keep ``text``, what a reader must know of it."""

    def save(self, file: str | Path, status: RunStatus = RunStatus.INTERRUPTED) -> None:
        """Write a file from which the run goes on to the same bits, or how it ended."""


@watched("time stepping")
def go(
    run: Run, *, progress: Progress | None = None, checkpoint: str | Path | None = None, checkpoint_every: int = 20
) -> RunStatus:
    """Step a run to its end, or until somebody stops it, and say how it ended.

    Parameters
    ----------
    run : stands before its first step, or where one was cut off
    progress : called with every sample; returns True to stop
    checkpoint, checkpoint_every : file that is written every so many samples

    Raises
    ------
    InputError
        For an interval below 1.
    """
    checkpoint_every = count("checkpoint_every", checkpoint_every)
    listener("progress", progress, "a sample")
    try:
        with interrupts_wait() as interrupt:
            run.begin()
            if not run.over:
                taken_up(*run.where)
            while not run.over:
                sampled, stop = run.advance(), False
                if sampled is not None:
                    reached(*run.where)
                    if checkpoint is not None and not run.over and run.samples % checkpoint_every == 0:
                        run.save(checkpoint)
                    stop = progress is not None and bool(progress(sampled))
                if stop or interrupt.asked:
                    return RunStatus.INTERRUPTED
            run.finish()
    # where interrupts cannot wait, in a thread of its own, or the user's function was interrupted
    except KeyboardInterrupt:
        ends_early()
        return RunStatus.INTERRUPTED
    return run.status
