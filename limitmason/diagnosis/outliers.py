"""Specimens that stand out: which, by how much, and if they carry the verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import comb
from typing import Any

import numpy as np

from limitmason.diagnosis.inference.trends import is_numeric
from limitmason.diagnosis.result import Findings

TAIL = 0.05  # chance that noise alone makes any specimen of the study stand out
SHARED = 0.05  # the same for what they share, over all recorded columns


@dataclass(frozen=True)
class Outliers:
    """Specimens whose residuals noise does not make, with the best explanation.

    Parameters
    ----------
    specimens : what each is called
    values : the largest residual of each in units of its noise, with the name of its row
    share : what they have in common and others seldom have, in words; empty where nothing
    carries : whether the residuals of all others, as they are, are those of noise
    """

    specimens: tuple[str, ...]
    values: tuple[tuple[str, float], ...]
    share: str
    carries: bool


def outliers(diagnosis: Findings) -> Outliers | None:
    """Specimens that stand out, or None.

    With r the residuals of a specimen's k values in units of the noise, (sum r^2 - k) / sqrt(2 k) is compared with the
    largest over all specimens in data sets of noise alone, which a study exceeds with probability ``TAIL``. None also
    where all of a study's specimens stand out: they are then no exception.
    """
    sd = diagnosis.noise_sd or 1.0
    residuals = diagnosis.judged.apart(diagnosis.best.residuals[0]) / sd
    columns = diagnosis.covariates
    names = [str(v) for v in columns.get("specimen", diagnosis.specimens)]
    each = {name: np.array([n == name for n in names]) for name in dict.fromkeys(names)}
    inside = np.array(list(each.values()), dtype=float)
    count = inside.sum(axis=1)

    def size(r: np.ndarray) -> np.ndarray:
        """(sum r^2 - k) / sqrt(2 k) of specimens, from residuals, (..., specimens)."""
        return (r**2 @ inside.T - count) / np.sqrt(2.0 * count)

    drawn = size(diagnosis.draws.errors)
    found = size(residuals)
    out = found > np.quantile(drawn.max(axis=1), 1.0 - TAIL)
    if not out.any() or 2 * out.sum() > len(out):
        return None
    rest = ~out
    # without them the others fit within the noise, by their largest and by their mean
    carries = bool(found[rest].max() <= np.quantile(drawn[:, rest].max(axis=1), 1.0 - TAIL)
                   and found[rest].mean() <= np.quantile(drawn[:, rest].mean(axis=1), 1.0 - TAIL))
    chosen = [name for name, is_out in zip(each, out, strict=True) if is_out]
    worst = [int(np.argmax(np.where(each[name], np.abs(residuals), -1.0))) for name in chosen]
    first = [int(np.argmax(each[name])) for name in each]  # a covariate is the same in all rows of a specimen
    plain = {k: [v[i] for i in first] for k, v in columns.items() if diagnosis.design.recorded_as(k) == k}
    values = tuple((diagnosis.specimens[i], float(residuals[i])) for i in worst)
    return Outliers(tuple(chosen), values, _shared(plain, out), carries)


def _shared(columns: Mapping[str, Sequence[Any]], out: np.ndarray) -> str:
    """What the specimens that stand out have in common, in words, or empty.

    That is a label, or a side of a number. It is told where chance finds as much with probability ``SHARED`` at most.
    Empty where one specimen stands out.

    Parameters
    ----------
    columns : covariates by name, one entry per specimen
    out : which specimens stand out, boolean, shape (specimens,)
    """
    count, found = int(out.sum()), []
    asked = {k: v for k, v in columns.items() if k not in ("specimen", "quantity") and len({str(x) for x in v}) > 1}
    for name, column in asked.items() if count > 1 else ():
        if is_numeric(column):
            x = np.asarray(column, dtype=float)
            sides = [(x >= x[out].min(), f"{name} of {x[out].min():g} and more"),
                     (x <= x[out].max(), f"{name} of {x[out].max():g} and less")]
        else:
            labels = np.array([str(v) for v in column])
            sides = [(labels == labels[out][0], f"{name} = {labels[out][0]}")]
        for those, words in sides:
            if those[out].all():
                # that as many specimens picked at random all have it, times all that was looked at (Bonferroni)
                chance = len(sides) * len(asked) * comb(int(those.sum()), count) / comb(len(out), count)
                found.append((chance, f"{words} ({int(those.sum())} of {len(out)} have it)"))
    return min(found)[1] if found and min(found)[0] <= SHARED else ""


def outlier_words(diagnosis: Findings) -> list[str]:
    """Which specimens stand out, by how much, and what they share, or empty."""
    found = outliers(diagnosis)
    if found is None:
        return []
    each = ", ".join(f"{name} ({value:+.1f} sd)" for name, value in found.values)
    after = f" beside {' and '.join(diagnosis.kept[0])}" if diagnosis.kept else ""
    share = f" They share {found.share}." if found.share else ""
    share = share or (" Nothing that is recorded is theirs alone." if len(found.specimens) > 1 else "")
    carry = " They carry the verdict: the others fit within the noise." if carried_by_outliers(diagnosis) else ""
    return [f"Standing out{after}: {each}.{share}{carry}"]


def carried_by_outliers(diagnosis: Findings) -> bool:
    """Whether an alarm that no cause explains is that of the specimens that stand out."""
    found = outliers(diagnosis)
    return found is not None and found.carries and diagnosis.kind in ("unexplained", "scatter")
