"""Noise that tests of one batch, day, set-up or operator share: its shares estimated, and carried into every fit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage

from limitmason.diagnosis.inference.design import Design
from limitmason.diagnosis.inference.earned import Rivals
from limitmason.diagnosis.inference.shapes import Shapes, is_numeric

CIRCUMSTANCES = ("batch", "day", "session", "operator", "sensor", "laboratory", "rig", "setup", "set-up", "set up")
SHARES = tuple(0.05 * i for i in range(19))  # of the variance: 0 to 0.9
MOST = 0.9  # of the variance, over all columns
SWEEPS = 3
LEAST = 0.1  # a smaller share is not carried
PLAUSIBLE = 0.5  # assumed, where a share cannot be estimated
ALIKE = 4  # specimens in a group of like ones, where no group is recorded


@dataclass(frozen=True)
class Shares:
    """Shares of the noise's variance that the tests with one label have in common.

    Parameters
    ----------
    shares : by column, those that are carried
    correlation : of the noise between specimens, shape (n, n)
    looked_at : columns whose share was estimated
    """

    shares: Mapping[str, float]
    correlation: np.ndarray
    looked_at: tuple[str, ...] = ()


def same(column: Sequence) -> np.ndarray:
    """1 where two specimens have one label, shape (n, n)."""
    labels = np.unique([str(v) for v in column], return_inverse=True)[1]
    return (labels[:, None] == labels[None]).astype(float)


def estimated_shares(
    design: Design, y: np.ndarray, covariates: Mapping[str, Sequence], *, every: bool = False
) -> Shares:
    """Shares with the largest likelihood of the residuals at the baseline.

    With y the data from the baseline, J its change per standard deviation of each measured input, and same_f one where
    two specimens have one label of column f::

        C = (1 - sum rho_f) I + sum rho_f same_f,    -log L = y'(C + J J')^-1 y / 2 + log det(C) / 2

    The total is what the noise statement says, so that the scatter within the labels bounds the shares.

    Parameters
    ----------
    design : independent noise
    y : whitened data, shape (n,)
    covariates : name to values of all specimens
    every : whether all of them are meant; else those that by name are circumstances of a test and that no cause of the
        list is about

    Notes
    -----
    Variance components by maximum likelihood: S. R. Searle, G. Casella and C. E. McCulloch, Variance Components (1992),
    chapter 6. Wrong where the stated noise is that within a label only: the scatter then exceeds it.
    """
    rivals = Rivals(design, covariates)
    columns = dict(covariates)
    if not every:
        taken = {rivals.column((c.name,)) for c in design.causes}
        columns = {k: v for k, v in circumstances(covariates).items() if k not in taken}
    blocks = {name: same(column) for name, column in columns.items()}
    extra = rivals.slopes @ rivals.slopes.T
    if not blocks:
        return Shares({}, np.eye(design.n))

    def cost(shares: Mapping[str, float]) -> float:
        c = _correlation(design.n, shares, blocks)
        square = float(y @ np.linalg.solve(c + extra, y))
        loglik = design.like.loglik(square, 0.0, float(design.n))
        return float(0.5 * np.linalg.slogdet(c)[1] - loglik)

    shares = dict.fromkeys(blocks, 0.0)
    best = cost(shares)
    for _ in range(SWEEPS):
        before = dict(shares)
        for name in blocks:
            room = MOST - sum(v for k, v in shares.items() if k != name)
            for share in SHARES:
                if share <= room + 1e-9:
                    value = cost({**shares, name: share})
                    if value < best - 1e-9:
                        best, shares = value, {**shares, name: share}
        if shares == before:
            break
    kept = {k: v for k, v in shares.items() if v >= LEAST - 1e-9}
    return Shares(kept, _correlation(design.n, kept, blocks), tuple(blocks))


def assumed(column: Sequence, share: float = PLAUSIBLE) -> np.ndarray:
    """Correlation of the noise with one share within the labels of a column, shape (n, n)."""
    return _correlation(len(column), {"": share}, {"": same(column)})


def alike(covariates: Mapping[str, Sequence]) -> list[int] | None:
    """Groups of like specimens, by the distance of their covariates: where an unrecorded share would do most harm.

    Average linkage of numbers over their standard deviation and labels that differ (1) or agree (0); None where nothing
    is recorded or there are too few specimens for two groups.
    """
    parts = []
    for column in covariates.values():
        if is_numeric(column):
            x = np.asarray(column, dtype=float)
            if np.ptp(x) > 0:
                parts.append((x[:, None] - x[None]) ** 2 / (2.0 * x.var()))
        elif 1 < len({str(v) for v in column}) < len(column):
            parts.append(1.0 - same(column))
    if not parts or len(parts[0]) < 2 * ALIKE:
        return None
    apart = np.sqrt(sum(parts))
    n = len(apart)
    condensed = apart[np.triu_indices(n, 1)]
    labels = fcluster(linkage(condensed, "average"), max(2, round(n / ALIKE)), "maxclust")
    return [int(v) for v in labels] if len(set(labels)) > 1 else None


def sharing(design: Design, correlation: np.ndarray, covariates: Mapping[str, Sequence]) -> Design:
    """The design in coordinates in which noise of a correlation, shape (n, n), is independent."""
    mix = np.linalg.inv(np.linalg.cholesky(correlation))
    return design.mixed(mix, Shapes(covariates, design.scale, mix))


def circumstances(covariates: Mapping[str, Sequence]) -> dict[str, Sequence]:
    """Columns of labels that by their names are circumstances of a test, whose noise may be shared."""
    out = {}
    for name, column in covariates.items():
        words = name.lower().replace("_", " ").strip()
        labels = {str(v) for v in column}
        if words in CIRCUMSTANCES and 1 < len(labels) < len(column):
            out[name] = column
    return out


def _correlation(n: int, shares: Mapping[str, float], blocks: Mapping[str, np.ndarray]) -> np.ndarray:
    out = (1.0 - sum(shares.values())) * np.eye(n)
    for name, share in shares.items():
        out += share * blocks[name]
    return out
