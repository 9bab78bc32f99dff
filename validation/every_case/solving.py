"""Answers of all theories to the cases, kept in a folder while they are made."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from limitmason.comparison.comparing import SideBySide, compare
from limitmason.comparison.findings import INSIDE, Answers
from limitmason.comparison.rows import Row
from limitmason.display.progress import reached, task
from limitmason.errors import InputError
from limitmason.experiments.shown import Settings
from limitmason.methods import ASSOCIATIVE, COMPARED_METHODS, DEM, MECHANISMS, NON_ASSOCIATIVE, get_method

from .cases import Case, settings_of

Progress = Callable[[str], object]


def dem_verdict(result: SideBySide) -> str:
    """Where the DEM lies: "inside", "below" or "above" the range from the smallest admissible to the associative value.

    The DEM counts with its error bar; "" where one of the answers is missing.
    """
    return Answers(result.rows).position(result[DEM]) if DEM in result else ""


def solve_cases(
    wanted: Iterable[Case],
    methods: Sequence[str] = COMPARED_METHODS,
    *,
    thorough: bool = False,
    store: str | Path | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> dict[Case, SideBySide]:
    """Answers of every method to every case.

    Parameters
    ----------
    wanted : from :func:`cases`
    methods : as in :func:`limitmason.compare`
    thorough : the whole error budget for every DEM answer, the standard search and proven ranges (hours)
    store : folder that keeps every answer when it is done; the same call goes on after a kill
    workers : processes of joblib, one case each; 1 runs in this process
    progress : called with a line per answer

    Returns
    -------
    dict
        In the order of the cases.

    Notes
    -----
    The DEM's error bar is the bracket of its search. Where that leaves the DEM outside the admissible range, and
    everywhere in thorough runs, it is the whole error budget. A store of another version of this package is
    refused.
    """
    wanted = list(wanted)
    with task("cases", shown=progress is None):
        return _solve_all(wanted, methods, thorough, store, workers, progress or (lambda _: None))


def _solve_all(
    wanted: Sequence[Case], methods: Sequence[str], thorough: bool, store: str | Path | None, workers: int,
    say: Progress,
) -> dict[Case, SideBySide]:
    if workers != 1:
        if store is None:
            raise InputError("several workers hand their answers over in a store: give a folder")
        from joblib import Parallel, delayed, parallel_config

        done = 0
        with parallel_config(backend="loky", n_jobs=workers, inner_max_num_threads=1):
            for name in Parallel(return_as="generator_unordered")(
                delayed(_solve_alone)(c, methods, thorough, store) for c in wanted
            ):
                say(f"done: {name}")
                done += 1
                reached(done / len(wanted), f"{done} of {len(wanted)} cases")
        say("all answers are in the store")
    answers: dict[Case, SideBySide] = {}
    for k, c in enumerate(wanted, 1):
        reached((k - 1) / len(wanted), str(c.name), share=1.0 / len(wanted))
        answers[c] = _solve(c, methods, thorough, store, partial(_numbered, say, f"[{k}/{len(wanted)}]"))
    return answers


def _numbered(say: Progress, number: str, line: str) -> None:
    say(f"{number} {line}")


def _solve_alone(case: Case, methods: Sequence[str], thorough: bool, store: str | Path) -> str:
    _solve(case, methods, thorough, store, lambda _: None)
    return f"{case.source} {case.name}"


def _solve(case: Case, methods: Sequence[str], thorough: bool, store: str | Path | None, say: Progress) -> SideBySide:
    title = f"{case.source} {case.name}"
    settings = settings_of(case, thorough=thorough)

    def ask(names: Sequence[str], *, whole: bool) -> SideBySide:
        every = _options(settings, whole).items()
        options: dict[str, Any] = {k: v for k, v in every if k in names or k.replace("_", "-") in names}
        return compare(
            case.test.assembly(), case.test.loads(case.direction), names, store=store, proven=settings.proven,
            progress=lambda line: say(f"{title}: {line}"), title=title, **options,
        )

    left_out = {m: why for m, why in case.test.recipe.shown.left_out.items() if m in methods}
    result = ask([m for m in methods if m not in left_out], whole=thorough)
    if left_out:
        own = {r.method: r for r in result.rows} | {m: Row.refused(m, why) for m, why in left_out.items()}
        result = replace(result, rows=tuple(own[m] for m in methods))
    if not thorough and dem_verdict(result) not in ("", INSIDE):
        whole = ask((DEM,), whole=True)[DEM]
        result = replace(result, rows=tuple(whole if r.method == DEM else r for r in result.rows))
    return result


def _options(settings: Settings, whole: bool) -> dict[str, dict[str, Any]]:
    grid = {} if settings.grid is None else {"contact_model": "grid", "grid": settings.grid}
    return {
        ASSOCIATIVE: dict(grid),
        NON_ASSOCIATIVE.replace("-", "_"): {**grid, "search": settings.search},
        DEM: {"contact_points": settings.contact_points, **({} if whole else get_method(DEM).cheap)},
        MECHANISMS: {},
    }
