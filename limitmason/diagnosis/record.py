"""A diagnosis as plain numbers and words that any program reads: what a file in JSON holds."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.diagnosis.report import headline, meaning, warnings
from limitmason.diagnosis.result import Diagnosis
from limitmason.diagnosis.words import if_it_were_missing
from limitmason.storage.files import write_text


def record(diagnosis: Diagnosis) -> dict[str, Any]:
    """Verdict, sizes, what stands behind a name, gain, rehearsal, shared noise and list, as JSON can hold them.

    Sizes are in the unit of each cause; log-likelihoods are natural; shares lie between 0 and 1.
    """
    verdict, earned, doubt = diagnosis.verdict, diagnosis.earned, diagnosis.verdict.doubt
    rehearsed, gain = verdict.rehearsed, diagnosis.gain
    units = {c.name: c.unit for c in diagnosis.listed}
    return {
        "kind": str(diagnosis.kind),
        "headline": headline(diagnosis),
        "in words": meaning(diagnosis),
        "causes": list(diagnosis.causes),
        "pairs": [list(p) for p in diagnosis.pairs],
        "the name is earned": diagnosis.named,
        "covariate": diagnosis.covariate,
        "sizes": {
            n: {"size": e.size, "low": e.low, "high": e.high, "unit": units[n]} for n, e in diagnosis.estimates.items()
        },
        "behind the name": None if earned is None else {
            "missing": list(earned.missing), "nearest without a name": earned.along, "excess": earned.excess,
            "margin": earned.margin, "expected excess": earned.expected, "chance to earn it": earned.chance,
            "slope": earned.slope, "slope error": earned.slope_error, "left out, ahead by": earned.ahead,
        },
        "if the true cause were missing": None if rehearsed is None else {
            "in words": if_it_were_missing(diagnosis), "share named": rehearsed.rate, "data sets": rehearsed.trials,
        },
        "shared noise": dict(diagnosis.shares.shares),
        "shared unrecorded": None if doubt is None else {
            "by the tests of": list(doubt.names), "not recorded": list(doubt.unrecorded),
            "p": dict(doubt.p), "the alarm stands": doubt.holds,
        },
        "gain": None if gain is None else {
            "error before": gain.error_before, "error after": gain.error_after,
            "error left out": gain.error_left_out, "log score left out": gain.leave_one_out.total,
        },
        "list": [c.name for c in diagnosis.listed],
        "set aside": dict(diagnosis.aside),
        "specimens": diagnosis.n,
        "noise": str(diagnosis.noise),
        "seed": diagnosis.seed,
        "warnings": list(warnings(diagnosis)),
    }  # fmt: skip


def write_record(path: str | Path, diagnosis: Diagnosis) -> Path:
    """Write :func:`record` as JSON."""
    text = json.dumps(record(diagnosis), indent=2, ensure_ascii=False, default=_plain)
    return write_text(path, text + "\n")


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} has no place in a record")
