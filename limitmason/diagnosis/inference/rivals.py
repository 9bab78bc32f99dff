"""Rivals of a cause: smooth biases, listed levers in other ways, and drifts.

``y`` are the whitened values of several data sets, shape (b, n), and ``replicate`` their redrawn variances of
replicates.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from limitmason.diagnosis.inference.design import Design, Names
from limitmason.diagnosis.inference.discrepancy import AMPLITUDES, Discrepancy
from limitmason.diagnosis.inference.fit import BestFit
from limitmason.diagnosis.inference.likelihood import Likelihood
from limitmason.diagnosis.inference.trends import ROWS, is_numeric, one_of_each

LEVERS = (3.0, 6.0, 12.0, 24.0)  # amplitudes of a lever with another dependence, in units of the noise
DRIFT = "a drift with an order of tests that is not recorded"
_UNFELT = 1e-9  # root mean square of an effect in units of the noise: less is rounding, no test feels the lever
NEARLY = (0.8, 1.0, 1.25)  # of the fitted effect: mean of a drift


def dependences(columns: Mapping[str, Sequence], *, alone: bool = False) -> dict[str, list[np.ndarray]]:
    """How a lever may differ along each column: factors F, its covariance being F F'.

    A number gives a line with a constant, and a level on either side of its median; labels give a level each.

    Parameters
    ----------
    columns : name to values, numbers or labels, one per row
    alone : whether a level that one label alone has is a factor too

    Returns
    -------
    Factors by column, shape (n, r) each; a column with one value, or with labels that never repeat, gives none.
    """
    out: dict[str, list[np.ndarray]] = {}
    for name, column in columns.items():
        labels: Sequence = [str(v) for v in column]
        factors = []
        if is_numeric(column):
            x = np.asarray(column, dtype=float)
            if np.ptp(x) <= 1e-12 * np.abs(x).max(initial=0.0):  # one value, but for rounding
                continue
            factors.append(np.column_stack([(x - x.mean()) / x.std(), np.ones(len(x))]))
            labels = list(x > np.median(x))
        if 1 < len(set(labels)) < len(labels):
            factors.append(one_of_each(labels))
            factors += list(factors[-1].T[:, :, None]) if alone else []  # each label as a factor of its own, (n, 1)
        if factors:
            out[name] = factors
    return out


class Rivals:
    """Model discrepancies of a design, by the columns that a cause has as its own.

    Parameters
    ----------
    design : tables
    sd : noise in stated units, where the noise is unknown
    """

    def __init__(self, design: Design, sd: float = 1.0):
        """Begin without any rival: they are made when they are asked for."""
        self.design, self.sd = design, sd
        self.slopes = design.null.slopes / sd
        self._made: dict[tuple[str, ...], Discrepancy] = {}
        self._levers: dict[tuple[tuple[str, ...], int], Discrepancy] = {}

    def of(self, names: Names) -> Discrepancy:
        """Biases that could stand in for an explanation ``names``, off its own columns."""
        own = self.design.own(names)
        if own not in self._made:
            rest = {k: v for k, v in self.design.columns.items() if self.design.recorded_as(k) not in own}
            self._made[own] = Discrepancy.of(rest, self.design.scale, self.slopes, self.design.mix)
        return self._made[own]

    def levers(self, names: Names) -> Discrepancy:
        """Levers with another dependence than on the explanation's own columns.

        A rival is the effect of a listed cause at its largest size, or of a measured input, times an unknown factor
        that depends on a column. Effects are scaled to a mean square of one. Such are a friction that differs by
        direction, and a softness that grows with the load. Beside a pair of causes the factor may also differ for one
        label only, but not by quantity: that is a reading, which the list has.

        Parameters
        ----------
        names : causes of the explanation
        """
        own = self.design.own(names)
        if (own, len(names)) not in self._levers:
            self._levers[own, len(names)] = self._levers_but(own, len(names) > 1)
        return self._levers[own, len(names)]

    def _levers_but(self, own: tuple[str, ...], alone: bool) -> Discrepancy:
        """Levers of listed causes times a factor along other columns than ``own``.

        ``alone`` is for pairs: the factor may then differ for one label only, and measured inputs are levers too.
        """
        plain: dict[str, Sequence[Any]] = {
            k: v for k, v in self.design.columns.items()
            if self.design.recorded_as(k) == k and k not in (*own, *(ROWS if alone else ("specimen",)))
        }
        return self._acting(self._effects(measured=alone), dependences(plain, alone=alone), LEVERS)

    @cached_property
    def by_specimen(self) -> Discrepancy:
        """Levers, measured inputs included, that differ by specimen without any order."""
        column = self.design.columns.get("specimen", range(self.design.n))
        return self._acting(self._effects(measured=True), {"specimen": [one_of_each(column)]}, AMPLITUDES)

    def _effects(self, *, measured: bool) -> dict[str, np.ndarray]:
        """Effect of every listed cause at its largest size, by name, shape (n,).

        Where ``measured`` is set, also of every measured input at one standard deviation. In units of the noise, per
        specimen.
        """
        design = self.design
        null = design.null.between(design.null.zero)
        out = dict(zip(design.measured, design.apart(design.null.slopes.T), strict=False)) if measured else {}
        for cause in design.causes:
            grid = design.singles[cause.name]
            far = int(np.argmax(np.abs(grid.sizes[0] - cause.baseline)))
            out[cause.name] = design.apart(grid.at_size(float(far)).between(grid.zero) - null)
        return out

    def _acting(
        self, effects: Mapping[str, np.ndarray], varying: Mapping[str, list[np.ndarray]], amplitudes: Sequence[float]
    ) -> Discrepancy:
        """Effects, at a mean square of one, times unknown factors by columns.

        Parameters
        ----------
        effects : whitened effect of every lever at its largest size, shape (n,)
        varying : how they may differ along each column, see :func:`dependences`: factors, shape (n, r) each
        amplitudes : root mean squares of a lever that are tried, in units of the noise
        """
        along, factors = [], []
        for name, effect in effects.items():
            size = float(np.sqrt(np.mean(effect**2)))
            if size <= _UNFELT:
                continue
            for column, parts in varying.items():
                for part in parts:
                    lever = self.design.turned(effect / size * part.T).T  # F of the bias but for its amplitude, (n, r)
                    for amplitude in amplitudes:
                        along.append(f"{name} by {column}")
                        factors.append(amplitude * lever)
        return Discrepancy(along, factors, self.slopes)

    def over_scatter(self, fit: BestFit, y: np.ndarray) -> np.ndarray:
        """Log evidence of the best lever that differs by specimen, over scatter, (b,).

        More scatter in each kind has the log-likelihood ``-sum (n_k log s_k^2 + R_k / s_k^2) / 2 - P / 2``. R_k is the
        sum of squares that the baseline leaves in the n_k rows of a kind, and P that of the inputs' data; s_k^2 is the
        larger of R_k / n_k and 1.

        Parameters
        ----------
        fit : of the baseline, with residuals
        y : what was fitted, less the shift that the inputs' own data make
        """
        scatter = -0.5 * fit.penalty
        for inside in self.design.of_kind:
            left, count = (fit.residuals[:, inside] ** 2).sum(axis=1), int(inside.sum())
            variance = np.maximum(left / count, 1.0)
            scatter = scatter - 0.5 * (count * np.log(variance) + left / variance)
        return self.by_specimen.evidence(y, self.design.like) - scatter

    def drift(self, names: Names, effect: np.ndarray, y: np.ndarray, like: Likelihood) -> float:
        """Log evidence that the effect grows from test to test, order not recorded.

        Specimen i of m shows t_i of the effect f: a permutation of 0, 2/(m-1), ... 2, of mean 1, variance
        V = (m+1) / 3(m-1) and covariance -V/(m-1), taken as normal. Minus infinity where an order is recorded, or the
        explanation has none.

        Parameters
        ----------
        names : causes of the explanation
        effect : of the fitted explanation, in the coordinates of the design, shape (n,)
        y : one data set, shape (1, n)
        like : of the noise
        """
        design = self.design
        orders = {o for c in design.causes if c.name in names for o in getattr(c, "drifts", ())}
        specimens = design.columns.get("specimen", range(design.n))
        m = len(set(specimens))
        if not orders or orders & set(design.columns) or m < 2:
            return -np.inf
        f = design.apart(effect) / self.sd
        # P: 1 where two rows are of one specimen
        spread = (m + 1.0) * m / (3.0 * (m - 1.0) ** 2)  # V m / (m - 1): covariance V (P - 11' / m) m / (m - 1)
        factor = design.turned(np.sqrt(spread) * f * (one_of_each(specimens) - 1.0 / m).T).T
        made = [Discrepancy([DRIFT], [a * factor], self.slopes).evidence(y - a * effect, like) for a in NEARLY]
        return float(np.max(made))

    def excess(
        self, names: Names, fit: BestFit, y: np.ndarray, replicate: float | np.ndarray = 1.0,
        parts: Sequence[np.ndarray] = (),
    ) -> np.ndarray:
        """Log-likelihood of fits over evidence of the best model discrepancy, shape (b,).

        Parameters
        ----------
        names, fit : explanation and its fits
        y, replicate : what was fitted
        parts : of a pair, the effect of each cause, shape (n,): each must beat a model discrepancy beside the
            other, and the smaller excess counts
        """
        like, data = self.design.like, np.atleast_2d(y)
        if len(names) == 1:
            return fit.loglik - self.of(names).evidence(data, like, replicate)
        # what is left beside the other cause must beat the biases that could stand in for this one
        beside = zip(names, reversed(parts), strict=True)
        return fit.loglik - np.max([self.of((n,)).evidence(data - part, like, replicate) for n, part in beside], axis=0)

    def of_each(
        self, listed: Sequence[Names], fitted: Sequence[BestFit], y: np.ndarray, replicate: float | np.ndarray = 1.0
    ) -> np.ndarray:
        """Log-likelihood of causes over the evidence of all biases, shape (causes, b).

        Biases are weighed once for causes that act along the same columns.

        Parameters
        ----------
        listed : names of every explanation
        fitted : its fits
        y, replicate : whitened data sets, shape (b, n), and variance of their replicates over the stated one, (b,)
        """
        # by own columns, for the last cause that has these
        evidence = {own: self.of(names).evidence(y, self.design.like, replicate)
                    for own, names in {self.design.own(n): n for n in listed}.items()}
        return np.array([f.loglik - evidence[self.design.own(n)] for n, f in zip(listed, fitted, strict=True)])

    def parts(self, names: Names, fit: BestFit) -> list[np.ndarray]:
        """Effect of each cause of a pair at the fit, (n,), or none for a single cause."""
        out = []
        for axis, name in enumerate(names if len(names) == 2 else ()):
            grid, null = self.design.singles[name], self.design.null
            size = float(self.design.grid(names).sizes_at(fit.position)[0, axis])
            at = [float(np.interp(size, grid.sizes[0], np.arange(len(grid.sizes[0])))), *grid.zero]
            out.append(grid.between(at) - null.between(null.zero))
        return out

    def structure(self, names: Names, fit: BestFit, replicate: float | np.ndarray = 1.0) -> np.ndarray:
        """Evidence of a discrepancy in the residuals of fits over none, shape (b,)."""
        like = self.design.like
        squares, n = (fit.residuals**2).sum(axis=1), float(self.design.n)
        plain = like.loglik(squares, penalty=0.0, count=n, replicate=replicate)
        return self.of(names).evidence(fit.residuals, like, replicate) - plain
