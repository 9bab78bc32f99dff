"""A default is a promise: every call beside itself refined, on fifty small structures, a table in ``docs/limits.md``.

``python -m tests.referee.defaults --out DIR`` goes on where it stopped; ``--call NAME`` does one call only.
"""

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .driven import PART
from .engine import REFUSED, Engine, number
from .engines import ENGINES
from .laws import Answer
from .model import Model, Quantity
from .statics import Statics

PAGE = Path(__file__).parents[2] / "docs" / "limits.md"
BEGIN, END = "<!-- defaults: begin -->", "<!-- defaults: end -->"


@dataclass(frozen=True)
class Call:
    """A public call: what is read, the engine whose structures it gets, how it is asked, and what refines it."""

    title: str
    like: str
    ask: Callable[..., float | np.ndarray]
    refined: dict
    words: str


def _limit(model: Model, **options) -> float:
    import limitmason as lm

    return lm.limit_analysis(*model.build(), **options).collapse_multiplier


def _settlement(model: Model, **options) -> float:
    import limitmason as lm

    assembly, loads = model.build()
    dead = lm.Loads(loads.dead, 0 * loads.live)
    found = lm.settlement_analysis(assembly, model.group[0], loads=dead, **options)
    return found.details["support_reaction"] / model.weight + 1.0  # of a reaction of zero no part is told


def _range(model: Model, **options) -> float:
    import limitmason as lm

    found = lm.elastic_range(*model.build(), **options)
    return found.high.multiplier if found.stands and found.high is not None else np.nan


def _modes(model: Model, **options) -> np.ndarray:
    import limitmason as lm

    return lm.modes(model.build()[0], 3, **options).frequency


def _path(model: Model, finer: int = 1, **options) -> float:
    import limitmason as lm
    from limitmason.capacity import Steps

    d, names = Steps(), ("first", "largest", "smooth", "peak", "energy", "opening", "sliding")
    steps = Steps(**{k: getattr(d, k) / finer for k in names}, most=d.most * finer) if finer > 1 else None
    got = lm.pushover(*model.build(), steps=steps, **options)
    return np.nan if got.first_limit_point is None else got.peak.load


def _collapse(model: Model, **options) -> float:
    import dem

    return dem.collapse(*model.build(), error_budget=(), **options).collapse_multiplier


def _push(model: Model, finer: int = 1) -> float:
    import dem
    import limitmason as lm

    assembly, loads = model.build()
    drive, dead = dem.Drive({model.driven: {"x": 1.0}}), lm.Loads(loads.dead, 0 * loads.live)
    got = dem.push(assembly, drive, to=1e-3 * model.length, loads=dead)
    if finer > 1:
        got = dem.push(assembly, drive, to=1e-3 * model.length, loads=dead, steps=finer * got.steps // 3)
    return got.peak.load


def _simulate(model: Model, tolerance: float = 1e-6, steps: int = 4000) -> float:
    import dem

    assembly, loads = model.build()
    to = PART * Statics(model).limit()
    stages = [dem.Settle(tolerance), dem.Ramp(to=to, steps=steps), dem.Settle(tolerance)]
    return float(np.abs(dem.simulate(assembly, stages, loads=loads).shift[-1]).max())


FINE = {"contact_model": "grid", "grid": (9, 9)}
CALLS = {
    "limit": Call("`lm.limit_analysis`, multiplier", "dem push", _limit, FINE, "grid of 9 x 9 points"),
    "settlement": Call("`lm.settlement_analysis`, reaction over weight, plus 1", "settlement", _settlement, FINE,
                       "grid of 9 x 9 points"),
    "range": Call("`lm.elastic_range`, upper end", "elastic", _range, FINE, "grid of 9 x 9 points"),
    "modes": Call("`lm.modes`, three frequencies", "modes", _modes, {"contact_points": (9, 9)}, "9 x 9 points"),
    "modes modal": Call('`lm.modes(blocks="modal")`, the same', "modes",
                        lambda m, **o: _modes(m, **{"blocks": "modal", **o}), {"blocks": "elastic"},
                        '`blocks="elastic"`'),
    "path": Call("`lm.pushover`, largest load", "pushover", _path, {"finer": 4}, "all steps 4 times finer"),
    "path points": Call("`lm.pushover`, largest load", "pushover", _path, FINE, "grid of 9 x 9 points"),
    "path modal": Call('`lm.pushover(blocks="modal")`, largest load', "pushover modal",
                       lambda m, **o: _path(m, blocks="modal", **o), {"finer": 4}, "all steps 4 times finer"),
    "collapse": Call("`dem.collapse`, multiplier", "dem collapse", _collapse, {"contact_points": (16, 32)},
                     "16 x 32 points"),
    "push": Call("`dem.push`, largest load", "dem push", _push, {"finer": 4}, "4 times the steps"),
    "simulate": Call("`dem.simulate`, displacement at rest", "dem simulate", _simulate,
                     {"tolerance": 1e-7, "steps": 16000}, "ramp 4 times as slow, tolerance 1e-7"),
}  # fmt: skip


def difference(call: Call, seed: int, case: int) -> float | None:
    """Largest difference of default and refined answer over the refined one [-]; None where there is no such answer."""
    like = ENGINES[call.like]

    def both(model: Model) -> Answer:
        plain, fine = call.ask(model), call.ask(model, **call.refined)
        return {"plain": Quantity(np.atleast_1d(plain)), "fine": Quantity(np.atleast_1d(fine)), "n": number(0)}

    asked = Engine("", both, like.judge, (), longest=4 * like.longest)
    found = asked.ask(like.model(seed, case))
    if "plain" not in found or REFUSED in found:
        return None
    plain, fine = found["plain"].value, found["fine"].value
    off = float(np.max(np.abs(plain - fine) / np.maximum(np.abs(fine), 1e-300)))
    return off if np.isfinite(off) else None


def measure(name: str, cases: int, seed: int, out: Path) -> list[float]:
    """Differences of one call, kept line by line."""
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


def table(found: dict[str, list[float]]) -> str:
    """The table in Markdown."""
    head = "| call | refined | structures | median | 90 % | worst |\n|---|---|---|---|---|---|"
    rows = [
        f"| {CALLS[k].title} | {CALLS[k].words} | {len(v)} | {np.median(v):.2%} | {np.quantile(v, 0.9):.2%} "
        f"| {max(v):.2%} |"
        for k, v in found.items()
        if v
    ]
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
