"""Noise that tests share by a batch, day or set-up: estimated and carried.

The batch, day or set-up is recorded, or nobody wrote it down.

``y`` are whitened values, shape (n,), ``r`` residuals in units of the noise, (n,), and ``along`` directions in which
these are free, (n, k). ``shares`` are parts of the noise's variance by column [-].
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage

from limitmason.diagnosis.inference.design import Design, Listed
from limitmason.diagnosis.inference.grid import at_measured
from limitmason.diagnosis.inference.next_tests import NINE_IN_TEN
from limitmason.diagnosis.inference.trends import is_numeric, one_of_each, same

CIRCUMSTANCES = {
    "batch": ("batch",), "day": ("day", "session"),
    "set-up": ("operator", "sensor", "laboratory", "rig", "setup", "set-up", "set up"),
}
SHARES = tuple(0.05 * i for i in range(19))  # of the variance: 0 to 0.9
MOST = 0.9  # of the variance, over all columns
SWEEPS = 3  # over all columns at most (chosen, not derived)
ASIDE = 0.25  # of a cell, over which the change with the size of a cause is taken
EVIDENCE = 2.7  # log-likelihood by which a share must improve an explanation: p = 0.01 by a mixture of chi-squares
LEAST = 0.1  # a smaller share is not carried (chosen, not derived)
PLAUSIBLE = 0.5  # assumed where a share cannot be estimated (chosen, not derived)
ALIKE = 4  # specimens in a group of like ones, where no group is recorded
ROUNDING = 1e-9  # of shares and log-likelihoods: what is nearer counts as equal
EVEN = 0.05  # standard deviation over mean of an effect that acts on all specimens alike


@dataclass(frozen=True)
class Shares:
    """Shares of the noise's variance that the tests with one label have in common.

    Parameters
    ----------
    shares : by column, those that are carried
    correlation : of the noise between specimens, shape (n, n)
    estimated : columns whose share was estimated
    """

    shares: Mapping[str, float]
    correlation: np.ndarray
    estimated: tuple[str, ...] = ()


def estimated_shares(
    design: Design, y: np.ndarray, shared: Sequence[str] | None = None, *, price: float | None = None
) -> Shares:
    """Shares with the largest likelihood of the residuals of the best model.

    That is the baseline, or what explains the data best beside it.

    With r the data from the explanation, G its change with the size of each cause, J the change of the baseline per
    standard deviation of each measured input, and same_f one where two specimens have one label of column f (and, for
    several quantities, also where in addition they are of one quantity)::

        C = (1 - sum rho_f) I + sum rho_f same_f,    W = (C + J J')^-1
        -log L = min over a of (r - G a)' W (r - G a) / 2 + log det(C) / 2

    The total is what the noise statement says, so that the scatter within the labels bounds the shares.

    Parameters
    ----------
    design : independent noise
    y : whitened data, shape (n,)
    shared : columns that are meant; None are those that by name are circumstances of a test and that no cause of the
        list is about
    price : log-likelihood by which every cause of an explanation must improve it: the baseline, single causes and the
        best one with a second are then tried. None is the baseline alone, which is what a test of it asks for; an
        effect that goes with a column would pass for noise shared within it

    Notes
    -----
    Variance components by maximum likelihood: S. R. Searle, G. Casella and C. E. McCulloch, Variance Components (1992),
    chapter 6; effects about their fit to independent noise, to first order. Wrong where the stated noise is that within
    a label only: the scatter then exceeds it.
    """
    if shared is None:
        taken = design.own(tuple(c.name for c in design.causes))
        shared = [k for k in circumstances(design.columns) if k not in taken]
    if not shared:
        return Shares({}, np.eye(design.n))
    blocks = {name: one_of_each(design.columns[name]) for name in shared}
    if "quantity" in design.columns:  # what each was measured with
        for name in shared:
            pairs = zip(design.columns["quantity"], design.columns[name], strict=True)
            within = one_of_each([f"{q} of {label}" for q, label in pairs])
            if within.shape[1] < design.n:
                blocks[f"{name} of each quantity"] = within
    components, unfitted = Components(design, blocks), np.zeros((design.n, 0))
    # costs are minus log-likelihoods, each with the shares that suit its explanation best
    cost_of_baseline, shares = components.likeliest(y, unfitted)
    if price is not None:
        # single causes: residuals about the fit, and the direction in which the size of the cause moves them
        about = {c.name: _about_its_fit(design, c, y) for c in design.causes}
        cost_of_single = {name: components.likeliest(r, g)[0] for name, (r, g) in about.items()}
        single = min(cost_of_single, key=lambda name: cost_of_single[name])
        residuals, direction = about[single]
        # the explanation that is worth its causes: none, the best single one, or that with a second
        options = [(cost_of_baseline, y, unfitted), (cost_of_single[single] + price, residuals, direction)]
        for second in design.causes:
            both = np.hstack([direction, _whole_effect(design, second)])
            options.append((components.likeliest(residuals, both)[0] + 2.0 * price, residuals, both))
        _, r, free = min(options, key=lambda option: option[0])
        least, shares = components.likeliest(r, free)
        # noise counts as shared where that is likelier both beside the best single cause and beside what was chosen
        none = dict.fromkeys(blocks, 0.0)
        evidence = [
            components.cost(none, residuals, direction) - cost_of_single[single], components.cost(none, r, free) - least
        ]
        if min(evidence) < EVIDENCE:
            shares = none
    kept = {k: v for k, v in shares.items() if v >= LEAST - ROUNDING}
    carried = {name: blocks[name] @ blocks[name].T for name in kept}
    return Shares(kept, _correlation(design.n, kept, carried), tuple(shared))


class Components:
    """Likelihood of residuals with shares of noise within labels of some columns.

    With Z_f a column of ones and zeros per label of f and D the shares, C = s (I + Z D Z' / s), s = 1 - sum D: its
    inverse and determinant take as many columns as there are labels, whatever the number of rows.

    Parameters
    ----------
    design : independent noise
    labels : Z of each column, shape (n, its labels)
    """

    def __init__(self, design: Design, labels: Mapping[str, np.ndarray]):
        """Lay all labels and slopes side by side.

        Parameters
        ----------
        labels : one column for each label of a recorded column, 1 where a specimen has it, shape (n, labels)
        """
        self.design, self.labels, self.slopes = design, labels, design.null.slopes
        self._made: dict[tuple[float, ...], tuple[np.ndarray, float]] = {}
        whole = np.hstack([*labels.values(), self.slopes])
        ends = np.cumsum([0, *(z.shape[1] for z in labels.values())])
        self._columns = {k: np.arange(a, b) for k, a, b in zip(labels, ends, ends[1:], strict=False)}
        self._whole, self._products = whole, whole.T @ whole

    def _weight(self, shares: Mapping[str, float]) -> tuple[np.ndarray, float]:
        """M with (C + J J')^-1 = (I - A M A') / s, and log det(C) / 2, for given shares.

        A = [Z, J] holds all labels and slopes side by side, and V is the diagonal of shares and of ones for slopes. By
        Woodbury (s I + A V A')^-1 gives M = R (I + R A'A R)^-1 R with R = (V / s)^0.5.
        """
        rest = 1.0 - sum(shares.values())
        variance = np.zeros(len(self._products))
        for name, share in shares.items():
            variance[self._columns[name]] = share
        count = len(variance) - self.slopes.shape[1]  # columns of labels
        variance[count:] = 1.0  # of every measured input, in its standard deviations
        root = np.sqrt(variance / rest)
        inner = np.eye(len(root)) + root[:, None] * self._products * root
        price = 0.5 * self.design.n * np.log(rest)
        price += float(np.log(np.diag(np.linalg.cholesky(inner[:count, :count]))).sum())
        return root[:, None] * np.linalg.inv(inner) * root, price

    def cost(self, shares: Mapping[str, float], r: np.ndarray, along: np.ndarray) -> float:
        """Minus the log-likelihood of residuals whose noise is shared in part.

        Parameters
        ----------
        shares : of the noise variance within the labels of each column [-]
        r : residuals in units of the noise, shape (n,)
        along : directions along which the residuals are free, integrated out, shape (n, k)
        """
        key = tuple(shares.values())
        if key not in self._made:
            self._made[key] = self._weight(shares)
        # (C + J J')^-1 = (I - A middle A') / rest (Woodbury), price = log det(C) / 2
        middle, price = self._made[key]
        rest = 1.0 - sum(shares.values())
        basis = np.linalg.svd(along, full_matrices=False)[0] if along.shape[1] else along
        both = np.column_stack([r, basis])
        # the whole A: all labels, then the slopes of the measured inputs
        seen = self._whole.T @ both
        products = (both.T @ both - seen.T @ middle @ seen) / rest
        square = float(products[0, 0])
        if along.shape[1]:
            # what lies along the free directions costs nothing but their determinant
            inner, onto = products[1:, 1:], products[1:, 0]
            square -= float(onto @ np.linalg.solve(inner, onto))
            price += 0.5 * float(np.linalg.slogdet(inner)[1])
        return price - float(self.design.like.loglik(square, penalty=0.0, count=float(self.design.n)))

    def likeliest(self, r: np.ndarray, along: np.ndarray) -> tuple[float, dict[str, float]]:
        """Least cost and its shares, column after column until none changes.

        Parameters
        ----------
        r, along : residuals, and directions in which they cost nothing, as :meth:`cost` takes them
        """
        shares = dict.fromkeys(self.labels, 0.0)
        best = self.cost(shares, r, along)
        for _ in range(SWEEPS):
            before = dict(shares)
            for name in self.labels:
                room = MOST - sum(v for k, v in shares.items() if k != name)
                for share in SHARES:
                    if share <= room + ROUNDING:
                        value = self.cost({**shares, name: share}, r, along)
                        if value < best - ROUNDING:
                            best, shares = value, {**shares, name: share}
            if shares == before:
                break
        return best, shares


def _about_its_fit(design: Design, cause: Listed, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Residuals of a fitted cause at the inputs, and their change with its size.

    Shapes (n,) and (n, 1), both in units of the noise.
    """
    grid = design.singles[cause.name]
    (found,) = design.fits([(cause.name,)], y, residuals=True)
    left = found.residuals[0] + design.null.slopes @ grid.z_at(found.position)[0]
    before, after = found.position.copy(), found.position.copy()
    before[:, 0] = np.maximum(before[:, 0] - ASIDE, 0.0)
    after[:, 0] = np.minimum(after[:, 0] + ASIDE, len(grid.sizes[0]) - 1.0)
    change = grid.values_from(found.node, after) - grid.values_from(found.node, before)
    return left, change.T


def _whole_effect(design: Design, cause: Listed) -> np.ndarray:
    """Change of predictions from the baseline to the bound of most effect, (n, 1)."""
    values = at_measured(design.singles[cause.name])
    sizes = design.singles[cause.name].sizes[0]
    change = values - values[int(np.argmin(np.abs(sizes - cause.baseline)))]
    return change[int(np.argmax((change**2).sum(axis=1)))][:, None]


def assumed(column: Sequence, share: float = PLAUSIBLE) -> np.ndarray:
    """Correlation of the noise with one share within labels of a column, (n, n)."""
    return _correlation(len(column), {"": share}, {"": same(column)})


def alike(covariates: Mapping[str, Sequence]) -> list[int] | None:
    """Number of the group of each specimen, those with like covariates in one.

    Noise that such specimens share unstated would do most harm. The groups come from average linkage by the distance
    of covariates: numbers over their standard deviation, labels that differ (1) or agree (0). None where nothing is
    recorded or there are too few specimens for two groups.
    """
    parts = []
    for column in covariates.values():
        if is_numeric(column):
            x = np.asarray(column, dtype=float)
            if np.ptp(x) > 0:
                parts.append((x[:, None] - x[None]) ** 2 / (2.0 * x.var()))  # 2 var: mean square of a difference
        elif 1 < len({str(v) for v in column}) < len(column):
            parts.append(1.0 - same(column))
    if not parts or len(parts[0]) < 2 * ALIKE:
        return None
    apart = np.sqrt(sum(parts))
    n = len(apart)
    condensed = apart[np.triu_indices(n, 1)]  # each pair once, as linkage takes distances
    labels = fcluster(linkage(condensed, "average"), max(2, round(n / ALIKE)), "maxclust")
    return [int(v) for v in labels] if len(set(labels)) > 1 else None


def circumstances(covariates: Mapping[str, Sequence]) -> dict[str, Sequence]:
    """Columns of labels within which tests may share noise, by their names.

    They are circumstances of a test, and the specimen: what is peculiar to one changes all values read on it. Labels
    must differ, and repeat: noise that all rows share, or none, cannot be told from the rest.

    Parameters
    ----------
    covariates : columns by name, numbers or labels
    """
    out = {}
    for name, column in covariates.items():
        labels = {str(v) for v in column}
        told = _called(name) == "specimen" or is_circumstance(name)
        if told and 1 < len(labels) < len(column):
            out[name] = column
    return out


def unstated(columns: Iterable[str]) -> tuple[str, ...]:
    """Kinds of circumstances that no column names, of batch, day and set-up."""
    names = {_called(name) for name in columns}
    return tuple(kind for kind, words in CIRCUMSTANCES.items() if not names & set(words))


def is_circumstance(name: object) -> bool:
    """Whether a column is by its name a circumstance of a test."""
    return isinstance(name, str) and any(_called(name) in words for words in CIRCUMSTANCES.values())


def _called(name: str) -> str:
    """Name of a column as it is compared: small letters, spaces for underscores."""
    return name.lower().replace("_", " ").strip()


def _correlation(n: int, shares: Mapping[str, float], blocks: Mapping[str, np.ndarray]) -> np.ndarray:
    """Correlation of the noise, (n, n): 1, and a share within one label.

    Parameters
    ----------
    blocks : 1 for every two specimens of one label, by column, shape (n, n)
    """
    out = (1.0 - sum(shares.values())) * np.eye(n)
    for name, share in shares.items():
        out += share * blocks[name]
    return out


def seen_if_shared(design: Design, effects: np.ndarray) -> np.ndarray:
    """Distance from the baseline that nine in ten data sets with an effect reach.

    The test takes half of the noise as shared, while the noise itself is independent. With f an effect, J the change of
    the baseline per standard deviation of each measured input, C the correlation with half of the variance shared by
    the specimens that f acts on much, and by the others, and w = (C + J J')^-1 f::

        d = sqrt(f' w) - 1.28 sqrt(w' (I + J J') w / f' w)

    Parameters
    ----------
    design : independent noise, known
    effects : whitened changes of the predictions, shape (b, n)

    Returns
    -------
    d of every effect in units of the noise, shape (b,); minus infinity for one that changes nothing and is never seen
    """
    slopes = design.null.slopes
    extra, one = slopes @ slopes.T, np.eye(design.n)
    out = np.full(len(effects), -np.inf)
    for k, effect in enumerate(effects):
        groups = same(two_groups_by_effect(effect * design.scale))
        weight = np.linalg.solve((1.0 - PLAUSIBLE) * one + PLAUSIBLE * groups + extra, effect)
        square = float(effect @ weight)
        if square > 0.0:
            out[k] = np.sqrt(square) - NINE_IN_TEN * np.sqrt(weight @ (one + extra) @ weight / square)
    return out


def two_groups_by_effect(effect: np.ndarray) -> list[int]:
    """1 where a cause acts much, 0 where little: the two tightest groups.

    Parameters
    ----------
    effect : change of every specimen, shape (n,); all are one group where it is the same but for ``EVEN``
    """
    size = np.abs(effect)
    if size.std() <= EVEN * size.mean():
        return [1] * len(size)
    # the cut of the ordered effects that leaves least squares about the means of both groups
    ordered = np.sort(size)
    cuts = range(1, len(size))
    scatter = [j * np.var(ordered[:j]) + (len(size) - j) * np.var(ordered[j:]) for j in cuts]
    cut = 1 + int(np.argmin(scatter))
    return [int(v >= 0.5 * (ordered[cut - 1] + ordered[cut])) for v in size]
