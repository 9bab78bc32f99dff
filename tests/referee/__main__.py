"""Random assemblies against the referee: ``python -m tests.referee --engine NAME --cases 2000 --seed 1 --out DIR``.

An engine of ``engines`` is asked for small structures in many frames and beside own statics; "all" asks every one.
"programs", the default, is limit analysis beside the two programs of ``plane`` and ``space``.

Interrupt it whenever you like: every case done is a line of ``DIR/cases-SEED.jsonl``, and the same command goes on from
there. For every disagreement a model file is written with as few blocks as still show it.
"""

import argparse
import json
import sys
import time
from collections import Counter
from pathlib import Path

from .compare import DISAGREE, compare, shrunk
from .draw import plane_case, space_case
from .engines import ENGINES
from .lane import cases_of, run

SPACE_EVERY = 3
"""One case in this many is in space."""


def draw(seed: int, number: int):
    """Case ``number`` of the mixed series."""
    group, rest = divmod(number, SPACE_EVERY)
    if rest == SPACE_EVERY - 1:
        return space_case(seed, group)
    return plane_case(seed, group * (SPACE_EVERY - 1) + rest)


def written(case, comparison, folder: Path, number: int) -> Path:
    """Model file of a disagreement, with as few blocks as still show it."""
    from limitmason.formats import write_json

    small = shrunk(case)
    final = compare(small)
    assembly, loads = small.build()
    path = folder / f"disagreement-{case.seed[0]}-{number}.json"
    write_json(path, assembly, loads)
    print(
        f"\n{path}: {len(small.free)} free blocks, {small.tags}\n"
        f"  referee {final.referee}; limit analysis {'; turned: '.join(final.theirs)}\n"
        f"  (with all {len(case.free)} blocks: referee {comparison.referee}; {'; turned: '.join(comparison.theirs)})"
    )
    return path


def main(arguments: list[str] | None = None) -> int:
    """Run, and return how many cases disagree."""
    parser = argparse.ArgumentParser(prog="python -m tests.referee", description=__doc__.splitlines()[0])
    parser.add_argument("--engine", choices=["programs", "all", *ENGINES], default="programs")
    parser.add_argument("--cases", type=int)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("referee"))
    options = parser.parse_args(arguments)
    if options.engine != "programs":
        chosen = list(ENGINES) if options.engine == "all" else [options.engine]
        return sum(run(ENGINES[e], options.cases or cases_of(e), options.seed, options.out) for e in chosen)
    return programs(options.cases or 1000, options.seed, options.out)


def programs(cases: int, seed: int, out: Path) -> int:
    """Limit analysis beside the programs of ``plane`` and ``space``."""
    out.mkdir(parents=True, exist_ok=True)
    record = out / f"cases-{seed}.jsonl"
    rows = (
        [json.loads(line) for line in record.read_text().splitlines() if line.endswith("}")] if record.exists() else []
    )
    done = {row["case"] for row in rows}
    counts = Counter((row["space"], row["shape"], row["outcome"]) for row in rows)
    todo = [k for k in range(cases) if k not in done]
    begun = time.monotonic()
    try:
        with record.open("a") as log:
            for k, number in enumerate(todo):
                case = draw(seed, number)
                comparison = compare(case)
                row = {"case": number, "space": not case.plane, **case.tags, "outcome": comparison.outcome}
                if comparison.outcome != "agree":
                    row |= {"referee": comparison.referee, "theirs": comparison.theirs}
                if comparison.outcome == DISAGREE:
                    row["file"] = written(case, comparison, out, number).name
                log.write(json.dumps(row) + "\n")
                log.flush()
                counts[not case.plane, case.tags["shape"], comparison.outcome] += 1
                if sys.stderr.isatty() or k % 50 == 49:
                    left = (time.monotonic() - begun) / (k + 1) * (len(todo) - k - 1)
                    end = "\r" if sys.stderr.isatty() else "\n"
                    print(f"{k + 1} of {len(todo)}, {left:.0f} s left   ", end=end, file=sys.stderr, flush=True)
    except KeyboardInterrupt:
        print("\nstopped; the same command goes on from here", file=sys.stderr)
    report(counts)
    return sum(n for (_, _, outcome), n in counts.items() if outcome == DISAGREE)


def report(counts: Counter) -> None:
    """Table of outcomes by shape."""
    outcomes = ["agree", "DISAGREE", "refused", "undecided"]
    print(f"\n{'':<24}" + "".join(f"{o:>11}" for o in outcomes))
    for space, shape in sorted({(s, h) for s, h, _ in counts}):
        name = f"{shape}, {'space' if space else 'plane'}"
        print(f"{name:<24}" + "".join(f"{counts[space, shape, o]:>11}" for o in outcomes))
    print(f"{'all':<24}" + "".join(f"{sum(n for k, n in counts.items() if k[2] == o):>11}" for o in outcomes))


if __name__ == "__main__":
    sys.exit(min(main(), 1))
