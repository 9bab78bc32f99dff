"""Model discrepancy: smooth biases without a cause, and whether the data identify a cause beside them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from limitmason.diagnosis.inference.bootstrap import Draws
from limitmason.diagnosis.inference.decide import Rule, drawn_data, noise_of
from limitmason.diagnosis.inference.design import Design, Names, is_numeric
from limitmason.diagnosis.inference.fit import Fit
from limitmason.diagnosis.inference.gain import left_out, log_score
from limitmason.diagnosis.inference.kinds import LEVER, agree, by_kind, lever_kernels
from limitmason.diagnosis.inference.noise import Likelihood
from limitmason.diagnosis.inference.verdict import CONDITIONS, Identification

AMPLITUDES = (1.5, 3.0, 6.0, 12.0, 24.0)  # of the bias in units of the noise
REACH = 1.0  # length over which a curved bias changes, in standard deviations of its covariate
JOINT = (1.0, 2.0)  # the same for all numeric covariates at once
CONSTANT, TOGETHER = "nothing recorded", "several covariates"
DRAWN = 699  # data sets drawn from the explanation: its own distribution of the excess
SURE = 3.0  # standard errors by which the slope along its own contrast must differ from 0, and at most from 1


@dataclass(frozen=True)
class Discrepancy:
    """Log evidence of smooth biases: one covariate at a time, all of them together, or one bias for all specimens.

    With the covariance of a bias S = I + a^2 (K + 11') or I + a^2 K in units of the noise, J the change of the baseline
    per standard deviation of each measured input, and y the data from the baseline::

        log E(y) = max over K and a of  log L(y' (S + J J')^-1 y) - log det(S) / 2

    where log L is the likelihood of the noise statement. K is x x' of a numeric covariate, its squared-exponential
    kernel, the same-label kernel of a column of labels, the sum of these, or the kernel of all numbers at once. The
    determinant is the price of a bias that could have been anything.

    Parameters
    ----------
    along : covariate of every bias, shape (m,); ``CONSTANT`` and ``TOGETHER`` for those of none and of several
    weights : (S + J J')^-1, shape (m, n, n)
    kernels : S - I, shape (m, n, n)
    prices : log det(S) / 2, shape (m,)

    Notes
    -----
    Squared-exponential and linear kernels: C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine
    Learning (2006), eq. 2.16, 4.9 and 5.8. Measured inputs act to first order. Wrong for a bias that jumps within a
    covariate, such as a change of mechanism, which this takes for noise. The price grows with the logarithm of the
    amplitude: an effect many times the noise that has the very shape of a listed one wins its name (a cap on the price
    kept fewer true names at equal wrong ones). Errors with Student tails are taken as
    Gaussian ones once their residuals are drawn in.
    """

    along: tuple[str, ...]
    weights: np.ndarray
    kernels: np.ndarray
    prices: np.ndarray

    @classmethod
    def of(
        cls, covariates: Mapping[str, Sequence], scale: np.ndarray, slopes: np.ndarray, mix: np.ndarray | None = None
    ) -> "Discrepancy":
        """All biases of a design.

        Parameters
        ----------
        covariates : name to values, numbers or labels
        scale : standard deviation of each specimen's noise, shape (n,): a bias counts less where the noise is larger
        slopes : J in units of the noise, shape (n, number of measured inputs)
        mix : what makes shared noise independent, shape (n, n); None where the noise is not shared
        """
        n = len(scale)
        weight = np.mean(scale) / np.asarray(scale, dtype=float)
        one = np.ones((n, n))
        along, kernels = [CONSTANT], [np.zeros((n, n))]
        for name, kernel in [(CONSTANT, None), *_kernels(covariates)]:
            for amplitude in AMPLITUDES:
                for constant in (1.0,) if kernel is None else (0.0, 1.0):
                    along.append(name)
                    kernels.append(amplitude**2 * (constant * one + (0.0 if kernel is None else kernel)))
        stack = np.outer(weight, weight) * np.array(kernels)
        if mix is not None:
            stack = mix @ stack @ mix.T
        whole = stack + np.eye(n)
        weights = np.linalg.inv(whole + slopes @ slopes.T)
        return cls(tuple(along), weights, stack, 0.5 * np.linalg.slogdet(whole)[1])

    def evidence(self, y: np.ndarray, like: Likelihood, replicate: float | np.ndarray = 1.0) -> np.ndarray:
        """Log evidence of the best bias for each data set, shape (b,)."""
        return self.each(y, like, replicate).max(axis=1)

    def best(self, y: np.ndarray, like: Likelihood) -> int:
        """Number of the best bias for one data set."""
        return int(self.each(y, like)[0].argmax())

    def each(self, y: np.ndarray, like: Likelihood, replicate: float | np.ndarray = 1.0) -> np.ndarray:
        """Log evidence of every bias for each data set, shape (b, m)."""
        y = np.atleast_2d(y)
        m, n = len(self.along), y.shape[1]
        turned = (y @ self.weights.transpose(1, 0, 2).reshape(n, m * n)).reshape(len(y), m, n)
        squares = np.einsum("bmn,bn->bm", turned, y)
        replicate = np.broadcast_to(np.asarray(replicate, dtype=float), (len(y),))[:, None]
        return like.loglik(squares, 0.0, float(n), replicate) - self.prices

    def left_out(self, number: int, y: np.ndarray, folds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual and variance of every value of one data set, predicted by a bias without its fold, shape (n,).

        With Q the weights, the fold F is missed by (Q_FF)^-1 (Q y)_F with covariance (Q_FF)^-1.
        """
        q = self.weights[number]
        pull = q @ y
        miss, spread = np.empty(len(y)), np.empty(len(y))
        for fold in np.unique(folds):
            rows = np.flatnonzero(folds == fold)
            covariance = np.linalg.inv(q[np.ix_(rows, rows)])
            miss[rows], spread[rows] = covariance @ pull[rows], np.diag(covariance)
        return miss, spread


def _kernels(covariates: Mapping[str, Sequence]) -> Iterator[tuple[str, np.ndarray]]:
    """Name and kernel of every bias that is not constant, each with a mean diagonal of one."""
    parts, numbers = [], []
    for name, column in covariates.items():
        labels = [str(v) for v in column]
        levels = set(labels)
        if len(levels) < 2:
            continue
        if is_numeric(column):
            x = np.asarray(column, dtype=float)
            if np.ptp(x) <= 1e-12 * np.abs(x).max():
                continue
            x = (x - x.mean()) / x.std()
            yield name, np.outer(x, x)
            if len(levels) > 2:
                yield name, np.exp(-0.5 * ((x[:, None] - x[None]) / REACH) ** 2)
            parts.append(np.outer(x, x))
            numbers.append(x)
        elif len(levels) < len(labels):
            same = np.array([[float(a == b) for b in labels] for a in labels])
            yield name, same
            parts.append(same)
    if len(parts) > 1:
        yield TOGETHER, np.sum(parts, axis=0) / len(parts)
    if len(numbers) > 1:
        apart = np.sum([(x[:, None] - x[None]) ** 2 for x in numbers], axis=0) / len(numbers)
        for reach in JOINT:
            yield TOGETHER, np.exp(-0.5 * apart / reach**2)


class Rivals:
    """Model discrepancies of a design, by the columns that the cause in question declares as its own.

    Parameters
    ----------
    design : tables
    covariates : name to values of all specimens
    sd : noise in stated units, where the noise is unknown
    """

    def __init__(self, design: Design, covariates: Mapping[str, Sequence], sd: float = 1.0):
        self.design, self.covariates, self.sd = design, covariates, sd
        self.slopes = design.null.slopes / sd
        self._made: dict[tuple[str, ...], Discrepancy] = {}

    def of(self, names: Names) -> Discrepancy:
        """Biases that could stand in for an explanation: all but those along its own columns."""
        own = self.own(names)
        if own not in self._made:
            rest = {k: v for k, v in self.covariates.items() if k.split(" in ")[0] not in own}
            self._made[own] = Discrepancy.of(rest, self.design.scale, self.slopes, self.design.mix)
        return self._made[own]

    def own(self, names: Names) -> tuple[str, ...]:
        """Columns that the causes of an explanation declare as their own."""
        return tuple(column for c in self.design.causes if c.name in names for column in getattr(c, "own", ()))

    def levers(self, names: Names) -> Discrepancy:
        """Listed levers with another dependence."""
        inner = tuple(f" in {kind}" for kind in set(self.design.kinds))
        plain = {k: v for k, v in self.covariates.items() if not k.endswith(inner) and k != "specimen"}
        along, kernels = lever_kernels(self.design, plain, self.own(names))
        whole = kernels + np.eye(self.design.n)
        weights = np.linalg.inv(whole + self.slopes @ self.slopes.T)
        return Discrepancy(tuple(along), weights, kernels, 0.5 * np.linalg.slogdet(whole)[1])

    def excess(
        self,
        names: Names,
        fit: Fit,
        y: np.ndarray,
        replicate: float | np.ndarray = 1.0,
        parts: Sequence[np.ndarray] = (),
    ) -> np.ndarray:
        """Log-likelihood of fits over the evidence of the best model discrepancy, shape (b,).

        Parameters
        ----------
        names, fit : explanation and its fits
        y, replicate : what was fitted
        parts : of a pair, the effect of each cause, shape (n,): each must beat a model discrepancy beside the
            other, and the smaller excess counts
        """
        like, data, own = _gaussian(self.design.like, fit, np.atleast_2d(y))
        if len(names) == 1:
            return own - self.of(names).evidence(data, like, replicate)
        beside = zip(names, reversed(parts), strict=True)
        return own - np.max([self.of((n,)).evidence(data - part, like, replicate) for n, part in beside], axis=0)

    def parts(self, names: Names, fit: Fit) -> list[np.ndarray]:
        """Effect of each cause of a pair at the fit, at the measured inputs, shape (n,); none for a single cause."""
        out = []
        for axis, name in enumerate(names if len(names) == 2 else ()):
            grid, null = self.design.singles[name], self.design.null
            size = float(self.design.grid(names).sizes_at(fit.position)[0, axis])
            at = [float(np.interp(size, grid.sizes[0], np.arange(len(grid.sizes[0])))), *grid.zero]
            out.append(grid.between(at) - null.between(null.zero))
        return out

    def structure(self, names: Names, fit: Fit, replicate: float | np.ndarray = 1.0) -> np.ndarray:
        """Evidence of a model discrepancy in the residuals of fits over that of none, shape (b,)."""
        like = self.design.like if self.design.like.tails is None else Likelihood()
        plain = like.loglik((fit.residuals**2).sum(axis=1), 0.0, float(self.design.n), replicate)
        return self.of(names).evidence(fit.residuals, like, replicate) - plain


def identification(
    design: Design,
    names: Names,
    fit: Fit,
    y: np.ndarray,
    draws: Draws,
    rule: Rule,
    rivals: Rivals,
    margin: float,
    folds: np.ndarray,
    null: Fit,
) -> Identification:
    """Hold one explanation against every model discrepancy.

    Parameters
    ----------
    names, fit : the explanation and its fit to the data
    y : whitened data, shape (n,)
    draws : standard errors
    rule : thresholds
    rivals : discrepancies of the design
    margin : by how much it must beat them
    folds : number of the group of each specimen, left out together, shape (n,)
    null : fit of the baseline
    """
    discrepancy, sd = rivals.of(names), noise_of(design, names, fit)
    like, data, (own_value,) = _gaussian(design.like, fit, y[None])
    parts = rivals.parts(names, fit)
    observed = float(rivals.excess(names, fit, y, parts=parts)[0])
    left = float(rivals.structure(names, fit)[0])
    rows = slice(0, min(DRAWN, len(draws.errors), rule.draws))
    drawn, z, replicate = drawn_data(design, names, fit, draws, rows)
    again = design.fit(names, drawn, z, replicate)
    # the inputs' own data are part of the draw: what the fit leaves of them is a shift of the values to first order
    shifted = drawn - z @ (rivals.slopes * rivals.sd).T
    over = rivals.excess(names, again, shifted, replicate, parts)
    more = rivals.structure(names, again, replicate)
    effect = design.effect(names, fit)
    number = discrepancy.best(effect / sd, Likelihood())
    contrast = discrepancy.weights[number] @ effect
    reach = float(contrast @ effect)
    spread = np.eye(design.n) + rivals.slopes @ rivals.slopes.T
    slope = float(contrast @ data[0]) / reach if reach > 0 else 0.0
    error = sd * float(np.sqrt(contrast @ spread @ contrast)) / reach if reach > 0 else np.inf
    nearest = discrepancy.best(data, like)
    levers, rival, beyond = rivals.levers(names), "", np.inf
    if levers.along:
        each = levers.each(data, like)[0]
        rival, beyond = levers.along[int(each.argmax())], float(own_value) - float(each.max())
    kinds = by_kind(design, names, fit, null, y, sd)
    together = len(names) == 1 and agree(kinds)
    if together and margin <= rule.margin:
        margin = rule.agreed
    doses = any(is_numeric(rivals.covariates[c]) for c in rivals.own(names) if c in rivals.covariates)
    own = left_out(design, names, y, folds)[0]
    ahead, ahead_error = _ahead(design, own, y, discrepancy, nearest, folds, sd)
    gain = float(np.sum(own - left_out(design, (), y, folds)[0]))
    p = (1.0 + np.count_nonzero(over <= observed)) / (1.0 + len(over))
    holds = {
        "lever": float(np.median(over)) >= margin,
        "dose": slope >= SURE * error and abs(slope - 1.0) <= SURE * error,
        "excess": observed >= margin,
        "usual": p >= rule.usual,
        "left out": gain > 0.0 and ahead + ahead_error >= 0.0,
        "rival levers": beyond >= LEVER,
        "kinds": together or (len(names) == 1 and doses and not any(k.absent for k in kinds)),
    }
    return Identification(
        names,
        tuple(name for name in CONDITIONS if not holds[name]),
        discrepancy.along[nearest],
        observed,
        margin,
        float(np.median(over)),
        float(np.mean(over >= margin)),
        float(p),
        slope,
        error,
        ahead,
        ahead_error,
        float((1.0 + np.count_nonzero(more >= left)) / (1.0 + len(more))),
        kinds,
        rival,
        beyond,
    )


def tests_that_identify(
    discrepancy: Discrepancy, slopes: np.ndarray, effect: np.ndarray, tested: int, k: int
) -> tuple[list[int], float, float]:
    """Greedy choice of specimens after which an effect, without noise, most exceeds every model discrepancy.

    Each step adds the specimen that raises min over the biases of f' (S + J J')^-1 f / 2 + log det(S + J J') / 2 most.

    Parameters
    ----------
    discrepancy : biases of the tested specimens and the pool together
    slopes : J of both, shape (n, number of measured inputs)
    effect : f of both, in units of the noise, shape (n,)
    tested : how many of them are tested, first
    k : how many to choose

    Returns
    -------
    chosen, before, after : positions in the pool; expected excess without and with them
    """
    n = len(effect)
    whole = discrepancy.kernels + np.eye(n) + slopes @ slopes.T
    done, chosen, values = list(range(tested)), list[int](), list[float]()
    for _ in range(k + 1):
        part = whole[:, done][:, :, done]
        inverse = np.linalg.inv(part)
        own = np.eye(len(done)) + slopes[done] @ slopes[done].T
        price = 0.5 * (np.linalg.slogdet(part)[1] - np.linalg.slogdet(own)[1])
        square = 0.5 * np.einsum("i,mij,j->m", effect[done], inverse, effect[done])
        values.append(float((square + price).min()))
        if len(chosen) == k:
            break
        rest = [i for i in range(tested, n) if i not in done]
        across = whole[:, done][:, :, rest]
        pulled = inverse @ across
        spread = whole[:, rest, rest] - np.einsum("mir,mir->mr", across, pulled)
        missed = effect[rest] - np.einsum("i,mir->mr", effect[done], pulled)
        worth = (square + price)[:, None] + 0.5 * missed**2 / spread + 0.5 * np.log(spread)
        best = rest[int(np.argmax(worth.min(axis=0)))]
        chosen.append(best - tested)
        done.append(best)
    return chosen, values[0], values[-1]


def _ahead(
    design: Design, own: np.ndarray, y: np.ndarray, discrepancy: Discrepancy, number: int, folds: np.ndarray, sd: float
) -> tuple[float, float]:
    """Log score of values left out, explanation (``own``) minus one bias, and its standard error over the folds."""
    miss, spread = discrepancy.left_out(number, y, folds)
    other = log_score(design, miss, spread * sd**2)
    parts = np.bincount(folds, weights=own - other)
    return float(parts.sum()), float(np.sqrt(len(parts)) * parts.std(ddof=1)) if len(parts) > 1 else 0.0


def _gaussian(like: Likelihood, fit: Fit, y: np.ndarray) -> tuple[Likelihood, np.ndarray, np.ndarray]:
    """Likelihood, data and log-likelihood of fits to be held against Gaussian biases; blunders are drawn in first."""
    if like.tails is None:
        return like, y, fit.loglik
    pull = np.minimum(1.0, np.sqrt((like.tails + 1.0) / (like.tails + fit.residuals**2)))
    inside = fit.residuals * pull
    return Likelihood(), y - fit.residuals + inside, -0.5 * ((inside**2).sum(axis=1) + fit.penalty)
