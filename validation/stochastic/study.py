"""The runs of the page: cells evenly filled, repeats for the noise, laws beside; every run kept and made once."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import limitmason as lm
from limitmason import study

from . import mean_set, plastic
from .runs import PANEL, draws, kept_push, nudged_push, push, short_push, slow_push

ROUNDS = (24, 60, 120, 200, 300)
"""Runs of a cell after each round: a study that is cut off has cells of one size."""

SEED, FLOOR_SEED = 1, 9


class Job(NamedTuple):
    """A Monte Carlo study: file, what is run of which panel, how often, what is drawn."""

    name: str
    model: Any
    run: Callable[..., Any]
    samples: int
    drawn: dict[str, Any]


def jobs(runs: int) -> Iterator[Job]:
    """All studies for so many runs a cell, in the order in which they are worth most."""
    wall = (PANEL.assembly(), lm.Loads.weight)
    lasting = (PANEL.with_options(loss="nothing").assembly(), lm.Loads.weight)
    tiny = {"joints": {"friction_angle_deg": study.Random(study.normal(30.0, 1e-6))}}
    pairs = [(number, kind) for number in (1, 4, 3, 2) for kind in ("spatial", "non-spatial")]

    def cells(samples: int, run: Callable[..., Any] = push, tail: str = "", numbers: tuple[int, ...] = (1, 2, 3, 4),
              linked: bool = True, model: Any = wall) -> Iterator[Job]:
        for number, kind in pairs:
            if number in numbers:
                yield Job(f"set{number}-{kind}{tail}", model, run, samples, draws(number, kind == "spatial", linked))

    few = max(runs // 12, 2)
    yield from cells(min(ROUNDS[0], runs))
    yield Job("floor", wall, push, few, tiny)
    yield from cells(min(ROUNDS[0], runs), kept_push, "-kept", (4,))
    yield from cells(few, nudged_push, "-nudged")
    yield from cells(min(ROUNDS[0], runs), short_push, "-nothing", (4,), model=lasting)
    yield from cells(min(ROUNDS[0], runs), push, "-independent", (4,), linked=False)
    for samples in ROUNDS[1:]:
        if samples <= runs:
            yield from cells(samples)
    if runs not in ROUNDS:
        yield from cells(runs)
    yield Job("floor-third", wall, slow_push, max(few // 2, 2), tiny)
    yield from cells(max(few // 3, 2), slow_push, "-slow")


def compute(runs: int, store: Path, progress: Callable[[str], object] | None = None, workers: int = 1) -> None:
    """Make what is missing of all studies."""
    for job in jobs(runs):
        if progress is not None:
            progress(f"{job.name}, {job.samples} runs")
        study.monte_carlo(
            job.model, job.samples, run=job.run, seed=FLOOR_SEED if job.name.startswith("floor") else SEED,
            scheme="random", store=store / f"{job.name}.jsonl", progress=progress, workers=workers, **job.drawn,
        )
    mean_set.compute(store, progress, workers)
    plastic.compute(store, progress=progress, workers=workers)
