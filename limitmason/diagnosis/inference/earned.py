"""Whether a name is earned: the data hold the contrast that only this cause makes, nothing nameless does as well."""

from collections.abc import Mapping, Sequence

import numpy as np

from limitmason.diagnosis.inference.bootstrap import Draws
from limitmason.diagnosis.inference.decide import Rule, drawn_data, noise_of
from limitmason.diagnosis.inference.design import Design, Names
from limitmason.diagnosis.inference.fit import Fit, values_of
from limitmason.diagnosis.inference.fit import fit as best_fit
from limitmason.diagnosis.inference.gain import left_out, log_score
from limitmason.diagnosis.inference.grid import Grid
from limitmason.diagnosis.inference.likelihood import Likelihood
from limitmason.diagnosis.inference.nameless import Nameless, about
from limitmason.diagnosis.inference.verdict import CONDITIONS, Earned

DRAWN = 699  # data sets drawn from the explanation: its own distribution of the excess
SURE = 3.0  # standard errors by which the slope along its own contrast must differ from 0, and at most from 1


class Rivals:
    """Nameless biases of a design, by the column of labels that the cause in question is about.

    Parameters
    ----------
    design : tables
    covariates : name to values of all specimens
    sd : noise in stated units, where the noise is unknown
    """

    def __init__(self, design: Design, covariates: Mapping[str, Sequence], sd: float = 1.0):
        self.design, self.covariates, self.sd = design, covariates, sd
        self.slopes = slopes_of(design.null) / sd
        self._made: dict[str | None, Nameless] = {}
        self._about: dict[Names, str | None] = {}

    def of(self, names: Names) -> Nameless:
        """Biases that could stand in for an explanation: all but that along the labels it is about."""
        column = self.column(names)
        if column not in self._made:
            rest = {k: v for k, v in self.covariates.items() if k != column}
            self._made[column] = Nameless.of(rest, self.design.scale, self.slopes, self.design.mix)
        return self._made[column]

    def column(self, names: Names) -> str | None:
        """Column of labels that a single cause is about, None for most."""
        if names not in self._about:
            grid, cause = self.design.grid(names), {c.name: c for c in self.design.causes}
            effect = None
            if len(names) == 1:
                far = int(np.argmax(np.abs(grid.sizes[0] - cause[names[0]].baseline)))
                null = self.design.null
                effect = grid.at_size(float(far)).between(_zero(grid)) - null.between(_zero(null))
            plain = effect if effect is None else self.design.apart(effect)
            self._about[names] = None if plain is None else about(plain, self.design.scale, self.covariates)
        return self._about[names]

    def excess(
        self,
        names: Names,
        fit: Fit,
        y: np.ndarray,
        replicate: float | np.ndarray = 1.0,
        parts: Sequence[np.ndarray] = (),
    ) -> np.ndarray:
        """Log-likelihood of fits over the evidence of the best nameless bias, shape (b,).

        Parameters
        ----------
        names, fit : explanation and its fits
        y, replicate : what was fitted
        parts : of a pair, the effect of each cause, shape (n,): each must beat what is nameless beside the other, and
            the smaller excess counts
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
            at = [float(np.interp(size, grid.sizes[0], np.arange(len(grid.sizes[0])))), *_zero(grid)]
            out.append(grid.between(at) - null.between(_zero(null)))
        return out

    def structure(self, names: Names, fit: Fit, replicate: float | np.ndarray = 1.0) -> np.ndarray:
        """Evidence of a nameless bias in the residuals of fits over that of none, shape (b,)."""
        like = self.design.like if self.design.like.tails is None else Likelihood()
        plain = like.loglik((fit.residuals**2).sum(axis=1), 0.0, float(self.design.n), replicate)
        return self.of(names).evidence(fit.residuals, like, replicate) - plain


def earned(
    design: Design,
    names: Names,
    fit: Fit,
    y: np.ndarray,
    draws: Draws,
    rule: Rule,
    rivals: Rivals,
    margin: float,
    folds: np.ndarray,
) -> Earned:
    """Hold one explanation against everything nameless.

    Parameters
    ----------
    names, fit : the explanation and its fit to the data
    y : whitened data, shape (n,)
    draws : standard errors
    rule : thresholds
    rivals : nameless biases of the design
    margin : by how much it must beat them
    folds : number of the group of each specimen, left out together, shape (n,)
    """
    nameless, sd = rivals.of(names), noise_of(design, names, fit)
    like, data, _ = _gaussian(design.like, fit, y[None])
    parts = rivals.parts(names, fit)
    observed = float(rivals.excess(names, fit, y, parts=parts)[0])
    left = float(rivals.structure(names, fit)[0])
    rows = slice(0, min(DRAWN, len(draws.errors), rule.draws))
    drawn, z, replicate = drawn_data(design, names, fit, draws, rows)
    again = best_fit(design.grid(names), drawn, z, design.like, replicate)
    # the inputs' own data are part of the draw: what the fit leaves of them is a shift of the values to first order
    shifted = drawn - z @ (rivals.slopes * rivals.sd).T
    over = rivals.excess(names, again, shifted, replicate, parts)
    more = rivals.structure(names, again, replicate)
    effect = effect_of(design.null, design.grid(names), fit)
    number = nameless.best(effect / sd, Likelihood())
    contrast = nameless.weights[number] @ effect
    reach = float(contrast @ effect)
    spread = np.eye(design.n) + rivals.slopes @ rivals.slopes.T
    slope = float(contrast @ data[0]) / reach if reach > 0 else 0.0
    error = sd * float(np.sqrt(contrast @ spread @ contrast)) / reach if reach > 0 else np.inf
    nearest = nameless.best(data, like)
    own = left_out(design, names, y, folds)[0]
    ahead, ahead_error = _ahead(design, own, y, nameless, nearest, folds, sd)
    gain = float(np.sum(own - left_out(design, (), y, folds)[0]))
    p = (1.0 + np.count_nonzero(over <= observed)) / (1.0 + len(over))
    holds = {
        "lever": float(np.median(over)) >= margin,
        "dose": slope >= SURE * error and abs(slope - 1.0) <= SURE * error,
        "excess": observed >= margin,
        "usual": p >= rule.usual,
        "left out": gain > 0.0 and ahead + ahead_error >= 0.0,
    }
    return Earned(
        names,
        tuple(name for name in CONDITIONS if not holds[name]),
        nameless.along[nearest],
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
    )


def tests_that_earn(
    nameless: Nameless, slopes: np.ndarray, effect: np.ndarray, tested: int, k: int
) -> tuple[list[int], float, float]:
    """Greedy choice of specimens after which an effect, without noise, most exceeds every nameless bias.

    Each step adds the specimen that raises min over the biases of f' (S + J J')^-1 f / 2 + log det(S + J J') / 2 most.

    Parameters
    ----------
    nameless : biases of the tested specimens and the pool together
    slopes : J of both, shape (n, number of measured inputs)
    effect : f of both, in units of the noise, shape (n,)
    tested : how many of them are tested, first
    k : how many to choose

    Returns
    -------
    chosen, before, after : positions in the pool; expected excess without and with them
    """
    n = len(effect)
    whole = nameless.kernels + np.eye(n) + slopes @ slopes.T
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
    design: Design, own: np.ndarray, y: np.ndarray, nameless: Nameless, number: int, folds: np.ndarray, sd: float
) -> tuple[float, float]:
    """Log score of values left out, explanation (``own``) minus one bias, and its standard error over the folds."""
    miss, spread = nameless.left_out(number, y, folds)
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


def slopes_of(null: Grid) -> np.ndarray:
    """Change of the baseline's grid per standard deviation of each measured input, whitened, shape (n, k)."""
    out = np.zeros((null.n, len(null.z)))
    for axis, nodes in enumerate(null.z):
        ends = []
        for step in (-1.0, 1.0):
            at = np.zeros(len(null.z))
            at[axis] = np.clip(step, nodes[0], nodes[-1])
            ends.append((at[axis], null.between(_place(null, at))))
        (low, before), (high, after) = ends
        out[:, axis] = (after - before) / (high - low)
    return out


def effect_of(null: Grid, grid: Grid, fit: Fit) -> np.ndarray:
    """Whitened change of the predictions by an explanation at its fit, measured inputs included, shape (n,).

    Parameters
    ----------
    null : grid of the baseline
    grid : of the explanation, fitted or with the same nodes
    """
    return values_of(grid, fit)[0] - null.between(_place(null, grid.z_at(fit.position)[0]))


def _place(grid: Grid, inputs: np.ndarray) -> list[float]:
    return [float(np.interp(v, a, np.arange(len(a)))) for v, a in zip(inputs, grid.z, strict=True)]


def _zero(grid: Grid) -> list[float]:
    return _place(grid, np.zeros(len(grid.z)))
