"""Measured walls with their missing inputs drawn: what of the scatter comes from what was not printed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitmason.comparison.wall_ladder import predict_wall
from limitmason.experiments.modern_walls import MODELS
from limitmason.experiments.modern_walls.inputs import ASSUMED, draws, inputs_of
from limitmason.study.memo import Memo
from limitmason.study.run_fingerprint import fingerprint
from validation.wall_tests import ROWS, Measured

NUMBER = 10  # of draws


def missing(wall: str) -> list[str]:
    """Inputs of a wall that are not printed, and have a stated distribution instead."""
    return [name for name, i in inputs_of(ROWS[wall]).items() if i.kind == ASSUMED]


def drawn_logs(
    walls: Sequence[Measured], store: Path, *, number: int = NUMBER, workers: int = 1
) -> NDArray[np.float64]:
    """ln(predicted / measured) by the extended model, missing inputs drawn, shape (number, walls).

    Printed inputs stay at their values. Draws of one wall do not depend on the other walls.
    """
    memo = Memo(store, kind=dict)
    jobs: dict[Any, dict[str, Any]] = {}
    keys = []
    for m in walls:
        names = missing(m.wall)
        for values in draws(ROWS[m.wall], number):
            options = {**MODELS["extended"], **{name: values[name] for name in names}}
            key = (m.wall, fingerprint(options))
            jobs[key] = {"wall": m.wall, "method": "extended", "options": options, "spread": False}
            keys.append(key)
    for done, (key, _) in enumerate(memo.map(predict_wall, jobs, workers=workers), 1):
        if not done % 100:
            print(f"drawn inputs: {done} runs, wall {key[0]}", flush=True)
    forces = np.array([memo[key]["force"] for key in keys]).reshape(len(walls), number)
    return np.log(forces / np.array([[m.force] for m in walls])).T
