"""A lane of one engine: structure after structure, kept line by line; the same command goes on where it stopped."""

import json
import time
from collections import Counter
from pathlib import Path

import numpy as np

from .engine import RAW, REFUSED, WHY, Engine
from .laws import SLOW, broken

AGREE, DISAGREE = "agree", "DISAGREE"

CASES = {"pushover": 300, "dem": 100}
"""How many cases a lane has unless told, by how an engine's name begins; 2,000 of the others."""


def cases_of(name: str) -> int:
    """Cases of a lane unless told."""
    return next((n for begins, n in CASES.items() if name.startswith(begins)), 2000)


def trial(engine: Engine, seed: int, number: int, laws: tuple[str, ...] | None = None) -> dict:
    """One structure: what own statics say, and which laws are broken; ``laws`` of the engine by default."""
    model = engine.model(seed, number)
    begun = time.process_time()
    answer = engine.ask(model)
    row = {"case": number, "space": not model.plane, **{k: v for k, v in model.tags.items() if k in ("shape", "law")}}
    complaints: dict[str, list[str]] = {}
    if RAW in answer:
        complaints["raw error"] = [str(answer[RAW])]
    elif SLOW not in answer:
        if found := engine.judged(model, answer):
            complaints["own statics"] = found
        for k, name in enumerate(engine.laws if laws is None else laws):
            if found := broken(engine, model, name, answer, np.random.default_rng([seed, number, k, 9])):
                complaints[name] = found
    outcome = DISAGREE if complaints else next((w for w in (SLOW, REFUSED) if w in answer), AGREE)
    row |= {"outcome": outcome, "seconds": round(time.process_time() - begun, 2)}
    if complaints:
        row["complaints"] = complaints
    if WHY in answer:
        row["why"] = str(answer[WHY])
    return row


def run(engine: Engine, cases: int, seed: int, out: Path) -> int:
    """Go on with a lane and return how many cases disagree."""
    out.mkdir(parents=True, exist_ok=True)
    record = out / f"{engine.name.replace(' ', '-')}-{seed}.jsonl"
    lines = record.read_text().splitlines() if record.exists() else []
    rows = [json.loads(line) for line in lines if line.endswith("}")]
    done = {row["case"] for row in rows}
    try:
        with record.open("a") as log:
            for number in (k for k in range(cases) if k not in done):
                row = trial(engine, seed, number)
                rows.append(row)
                log.write(json.dumps(row) + "\n")
                log.flush()
                for name, found in row.get("complaints", {}).items():
                    print(f"{engine.name} {seed}, {number} ({row['shape']}) {name}: {'; '.join(found)}", flush=True)
    except KeyboardInterrupt:
        print("\nstopped; the same command goes on from here")
    counts = Counter(row["outcome"] for row in rows)
    seconds = sum(row["seconds"] for row in rows)
    print(f"{engine.name}: " + ", ".join(f"{n} {word}" for word, n in counts.items()) + f", {seconds:.0f} s")
    return counts[DISAGREE]
