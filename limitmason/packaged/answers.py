"""Answers of all theories to the cases, kept in a folder while they are made."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from limitmason.methods import ASSOCIATIVE, DEM, MECHANISMS, NON_ASSOCIATIVE, THEORIES, get_method
from limitmason.packaged.cases import Case
from limitmason.side_by_side import Answer, SideBySide, compare

Progress = Callable[[str], object]


class Settings(NamedTuple):
    """How a case is solved.

    Parameters
    ----------
    contact_points : of the DEM, along the unit and across the thickness
    grid : of limit analysis where joints crush, which corners cannot show; None for corners
    search : effort of the non-associative search
    proven : seconds for each end of the proven range, in thorough runs; None where the wall is too large or not plane
    """

    contact_points: tuple[int, int] = (2, 8)
    grid: tuple[int, int] | None = None
    search: str = "quick"
    proven: float | None = None


_BY_SOURCE: Mapping[str, Settings] = {
    "ferris-tin-loi-2001": Settings((2, 2)),
    "minho-dry-stone-2005-2009": Settings((2, 2)),
    "rondelet-wallette": Settings((2, 8)),
    "mcmaster-bending": Settings((4, 8)),
    "bnw-walls": Settings((8, 2), grid=(8, 2)),
}
_PROVEN = {"wall-1": 120.0, "wall-3": 120.0, "wall-4": 120.0}
"""Walls whose non-associative range can be proven, with the seconds allowed for each end."""
_STUBBORN = ("wall-6",)
"""Walls on which the quick search ends above the standard one."""
_SAME = 1e-6

LEFT_OUT: Mapping[tuple[str, str], str] = {
    ("mcmaster-bending", DEM): "under a given force the narrow loading bars turn and slide off before the wallette "
    "breaks; examples/four_point_bending.py drives them by displacement",
}
"""Source and method that are not asked for, and why."""


def settings_of(case: Case, *, thorough: bool = False) -> Settings:
    """Settings of one case: in plane two points across the thickness, more along joints that crush.

    Parameters
    ----------
    thorough : the standard search everywhere, and the range proven where that can be
    """
    found = _BY_SOURCE.get(case.source, Settings())
    if not thorough:
        several_ends = case.specimens[0] in _STUBBORN and not case.variant
        return found._replace(search="standard") if several_ends else found
    return found._replace(search="standard", proven=None if case.variant else _PROVEN.get(case.specimens[0]))


def dem_verdict(result: SideBySide) -> str:
    """Where the DEM lies: "inside", "below" or "above" the range from the smallest admissible to the associative value.

    The DEM counts with its error bar; "" where one of the answers is missing.
    """
    if any(name not in result or not result[name].solved for name in (ASSOCIATIVE, NON_ASSOCIATIVE, DEM)):
        return ""
    dem, upper, lower = result[DEM], result[ASSOCIATIVE].multiplier, result[NON_ASSOCIATIVE]
    floor = min(v for v in (lower.low, lower.multiplier) if math.isfinite(v))
    if dem.low > upper * (1.0 + _SAME):
        return f"above by {dem.low / upper - 1.0:.2%}"
    if dem.high < floor * (1.0 - _SAME):
        return f"below by {1.0 - dem.high / floor:.2%}"
    return "inside"


def solve_cases(
    wanted: Iterable[Case],
    methods: Sequence[str] = THEORIES,
    *,
    thorough: bool = False,
    store: str | Path | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> dict[Case, SideBySide]:
    """Answers of every method to every case.

    Parameters
    ----------
    wanted : from :func:`limitmason.packaged.cases.cases`
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
    everywhere in thorough runs, it is the whole error budget. The store does not know the version of the code: start a
    new folder after an update.
    """
    wanted = list(wanted)
    say = progress or (lambda _: None)
    if workers != 1:
        if store is None:
            raise ValueError("several workers hand their answers over in a store: give a folder")
        from joblib import Parallel, delayed, parallel_config

        with parallel_config(backend="loky", n_jobs=workers, inner_max_num_threads=1):
            for name in Parallel(return_as="generator_unordered")(
                delayed(_solve_alone)(c, methods, thorough, store) for c in wanted
            ):
                say(f"done: {name}")
        say("all answers are in the store")
    return {
        c: _solve(c, methods, thorough, store, lambda line, k=k: say(f"[{k}/{len(wanted)}] {line}"))
        for k, c in enumerate(wanted, 1)
    }


def _solve_alone(case: Case, methods: Sequence[str], thorough: bool, store: str | Path) -> str:
    _solve(case, methods, thorough, store, lambda _: None)
    return f"{case.source} {case.name}"


def _solve(case: Case, methods: Sequence[str], thorough: bool, store: str | Path | None, say: Progress) -> SideBySide:
    title = f"{case.source} {case.name}"
    settings = settings_of(case, thorough=thorough)

    def ask(names: Sequence[str], *, whole: bool) -> SideBySide:
        options = {k: v for k, v in _options(settings, whole).items() if k in names or k.replace("_", "-") in names}
        return compare(
            case.test.assembly(), case.test.loads(case.direction), names, store=store, proven=settings.proven,
            progress=lambda line: say(f"{title}: {line}"), title=title, **options,
        )  # fmt: skip

    left_out = {m: LEFT_OUT[case.source, m] for m in methods if (case.source, m) in LEFT_OUT}
    result = ask([m for m in methods if m not in left_out], whole=thorough)
    if left_out:
        nothing = {m: Answer(m, *3 * (math.nan,), "", "", f"does not apply: {why}", 0.0) for m, why in left_out.items()}
        own = {r.method: r for r in result.rows} | nothing
        result = replace(result, rows=tuple(own[m] for m in methods))
    if not thorough and dem_verdict(result) not in ("", "inside"):
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
