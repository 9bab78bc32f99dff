"""A default is a promise: every call beside itself refined, on fifty small structures, a table in ``docs/limits.md``.

``python -m tests.referee.defaults --out DIR`` goes on where it stopped; ``--call NAME`` does one call only.
"""

import argparse
import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .driven import PART
from .engine import REFUSED, Engine, number
from .engines import ENGINES
from .laws import Answer
from .model import Model, Quantity
from .paths import TOLD, curve, first_reached
from .paths import finer as finer_steps
from .statics import Statics

PAGE = Path(__file__).parents[2] / "docs" / "limits.md"
BEGIN, END = "<!-- defaults: begin -->", "<!-- defaults: end -->"


@dataclass(frozen=True)
class Call:
    """A public call: what is read, the engine whose structures it gets, how it is asked, and what refines it.

    ``ask`` gives the value and all that the answer says of itself; ``told`` finds in it that it may be off.
    ``each`` are the words of the values that have rows of their own.
    """

    title: str
    like: str
    ask: Callable[..., tuple[float | np.ndarray, str]]
    refined: dict
    words: str
    told: str = "(?!)"
    each: tuple[str, ...] = ("",)


Asked = tuple[float | np.ndarray, str]


def _limit(model: Model, **options) -> Asked:
    import limitmason as lm

    found = lm.limit_analysis(*model.build(), **options)
    return found.collapse_multiplier, " ".join(found.warnings)


def _settlement(model: Model, **options) -> Asked:
    import limitmason as lm

    assembly, loads = model.build()
    dead = lm.Loads(loads.dead, 0 * loads.live)
    found = lm.settlement_analysis(assembly, model.group[0], loads=dead, **options)
    # of a reaction of zero no part is told
    return found.reaction.least / model.weight + 1.0, " ".join(found.warnings)


def _range(model: Model, **options) -> Asked:
    import limitmason as lm

    found = lm.elastic_range(*model.build(), **options)
    value = found.high.multiplier if found.stands and found.high is not None else np.nan
    return value, " ".join(found.warnings)


def _modes(model: Model, **options) -> Asked:
    import limitmason as lm

    found = lm.modes(model.build()[0], 3, **options)
    return found.frequency, " ".join(found.warnings)


def _path(model: Model, finer: int = 1, **options) -> Asked:
    got = curve(model, steps=finer_steps(finer) if finer > 1 else None, **options)
    first = np.nan if got.first_limit_point is None else got.first_limit_point.load
    return np.array([got.peak.load, first, first_reached(got)[1]]), " ".join(got.warnings)


def _path_on(model: Model, faces: bool = False) -> Asked:
    """Faces have 9 points on a side, and more than the default where joints crush or lose strength."""
    from limitmason.mechanics.contact_points import weakening

    side = 21 if weakening(model.build()[0]).any() else 9
    return _path(model, **({"contact_model": "lobatto", "grid": (side, side)} if faces else {}))


def _collapse(model: Model, **options) -> Asked:
    import dem

    found = dem.collapse(*model.build(), **options)
    return found.collapse_multiplier, " ".join((found.status, *found.warnings))


def _push(model: Model, finer: int = 1) -> Asked:
    import dem
    import limitmason as lm

    assembly, loads = model.build()
    drive, dead = dem.Drive({model.driven: {"x": 1.0}}), lm.Loads(loads.dead, 0 * loads.live)
    got = dem.push(assembly, drive, to=1e-3 * model.length, loads=dead)
    if finer > 1:
        got = dem.push(assembly, drive, to=1e-3 * model.length, loads=dead, steps=finer * got.steps // 3)
    return got.peak.load, " ".join(got.warnings)


def _simulate(model: Model, tolerance: float = 1e-6, steps: int = 4000, gently: int = 0) -> Asked:
    import dem

    assembly, loads = model.build()
    to = PART * Statics(model).limit()
    stages = [dem.Settle(tolerance, gently=gently), dem.Ramp(to=to, steps=steps), dem.Settle(tolerance)]
    found = dem.simulate(assembly, stages, loads=loads)
    return float(np.abs(found.shift[-1]).max()), " ".join((found.status, *found.warnings))


FLAT = "the curve is flat"
OF_A_PATH = ", largest load", ", first limit load", ", displacement at which 98 % of it is reached"
FINE = {"contact_model": "grid", "grid": (9, 9)}
CALLS = {
    "limit": Call("`lm.limit_analysis`, multiplier", "dem push", _limit, FINE, "grid of 9 x 9 points"),
    "settlement": Call("`lm.settlement_analysis`, reaction over weight, plus 1", "settlement", _settlement, FINE,
                       "grid of 9 x 9 points"),
    "range": Call("`lm.elastic_range`, upper end", "elastic", _range, FINE, "grid of 9 x 9 points"),
    "modes": Call("`lm.modes`, three frequencies", "modes", _modes, {"contact_points": (9, 9)}, "9 x 9 points"),
    "modes simply deformable": Call('`lm.modes(blocks="simply deformable")`, the same', "modes",
                        lambda m, **o: _modes(m, **{"blocks": "simply deformable", **o}), {"blocks": "ritz"},
                        '`blocks="ritz"`', "hardly stiffer"),
    "path": Call("`lm.pushover`", "pushover", _path, {"finer": 4}, "all steps 4 times finer",
                 f"{TOLD}|{FLAT}", OF_A_PATH),
    "path points": Call("`lm.pushover`", "pushover", _path_on, {"faces": True},
                        "9 x 9 Lobatto points, 21 x 21 where joints crush or break",
                        "would bear about|could bear|was not reached|times as stiffly|or anywhere from|for each face",
                        OF_A_PATH),
    "path simply deformable": Call(
        '`lm.pushover(blocks="simply deformable")`', "pushover simply deformable",
        lambda m, **o: _path(m, blocks="simply deformable", **o), {"finer": 4}, "all steps 4 times finer",
        f"{TOLD}|{FLAT}", OF_A_PATH,
    ),
    "collapse": Call("`dem.collapse`, multiplier", "dem collapse", _collapse,
                     {"contact_points": (16, 32), "error_budget": ()}, "16 x 32 points",
                     "not converged|undecided"),
    "push": Call("`dem.push`, largest load", "dem push", _push, {"finer": 4}, "4 times the steps",
                 "peaks at the two speeds differ"),
    "simulate": Call("`dem.simulate`, displacement at rest", "dem simulate", _simulate,
                     {"tolerance": 1e-7, "steps": 16000, "gently": 20000},
                     "weight and ramp slow, tolerance 1e-7",
                     "not settled|slid|after the ramp"),
}


def difference(call: Call, seed: int, case: int) -> tuple[list[float], bool] | None:
    """Differences of default and refined answer over the refined one [-], and whether the default says so.

    The largest, or that of every value that has a row.

    None where there is no such answer.
    """
    like, words = ENGINES[call.like], []

    def both(model: Model) -> Answer:
        (plain, said), (fine, _) = call.ask(model), call.ask(model, **call.refined)
        words.append(said)
        return {"plain": Quantity(np.atleast_1d(plain)), "fine": Quantity(np.atleast_1d(fine)), "n": number(0)}

    asked = Engine("", both, like.judge, (), longest=4 * like.longest)
    found = asked.ask(like.model(seed, case))
    if "plain" not in found or REFUSED in found:
        return None
    plain, fine = found["plain"].value, found["fine"].value
    off = np.abs(plain - fine) / np.maximum(np.abs(fine), 1e-300)
    if not np.isfinite(off).all():
        return None
    return (off if len(call.each) > 1 else off.max(keepdims=True)).tolist(), re.search(call.told, words[-1]) is not None


def measure(name: str, cases: int, seed: int, out: Path) -> list[tuple[list[float], bool]]:
    """Differences of one call and whether they were told, kept line by line."""
    out.mkdir(parents=True, exist_ok=True)
    record = out / f"defaults-{name.replace(' ', '-')}-{seed}.jsonl"
    rows = [json.loads(line) for line in record.read_text().splitlines()] if record.exists() else []
    with record.open("a") as log:
        for case in range(rows[-1][0] + 1 if rows else 0, 3 * cases):
            if sum(off is not None for _, off in rows) >= cases:
                break
            rows.append([case, difference(CALLS[name], seed, case)])
            log.write(json.dumps(rows[-1]) + "\n")
            log.flush()
    return [off for _, off in rows if off is not None]


BEYOND = 0.02
"""Difference from which an answer must say that it may be off [-]."""


def table(found: dict[str, list[tuple[list[float], bool]]]) -> str:
    """The table in Markdown."""
    head = "| call | refined | structures | median | 90 % | worst | beyond 2 % | of them silent |\n" + 8 * "|---" + "|"
    rows = []
    for name, pairs in found.items():
        call, told = CALLS[name], np.array([t for _, t in pairs], dtype=bool)
        for words, off in zip(call.each, np.array([o for o, _ in pairs]).reshape(len(pairs), -1).T, strict=True):
            far = off > BEYOND
            rows.append(
                f"| {call.title}{words} | {call.words} | {len(off)} | {np.median(off):.2%} "
                f"| {np.quantile(off, 0.9):.2%} | {off.max():.2%} | {far.sum()} | {(far & ~told).sum()} |"
            )
    return "\n".join([BEGIN, head, *rows, END])


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(prog="python -m tests.referee.defaults", description=__doc__.splitlines()[0])
    parser.add_argument("--call", choices=list(CALLS))
    parser.add_argument("--cases", type=int, default=50, help="0 writes the table of what there is")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("referee"))
    options = parser.parse_args()
    names = [options.call] if options.call else list(CALLS)
    found = {name: measure(name, options.cases, options.seed, options.out) for name in names}
    print(table(found))
    if not options.call:
        page = PAGE.read_text(encoding="utf-8")
        before, after = page.split(BEGIN)[0], page.split(END)[-1]
        PAGE.write_text(before + table(found) + after, encoding="utf-8")


if __name__ == "__main__":
    main()
