"""What data say of parameters near a fit: deviations, correlations, the combinations that stay free, the next test."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import exp, inf, isinf
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags
from limitmason.calibration.parameter import ParameterScale
from limitmason.display.text_table import aligned
from limitmason.storage.frozen import ReadOnly

KINK = 2.0
"""Slopes to both sides that differ by less than this factor are those of a curve, and their mean counts."""

BLIND = 1e-7
"""Singular values below this part of one standard deviation per resolution are zero: the data do not see the move."""

_ROUNDING = 1e-10  # of the largest singular value: below it one is rounding of the decomposition
_PART = 1e-4  # of a unit move: smaller components of a parameter are rounding of the singular vectors
_TAKES = 0.1  # of a unit move: a parameter with no larger component takes no part in it; chosen, for what is told


class UnresolvedDirection(NamedTuple):
    """A joint move of parameters that the data do not resolve.

    Parameters
    ----------
    moves : for one standard deviation, the factor of every parameter that takes part, or the difference of one that is
        not on a log scale, by name
    deviation : that standard deviation in resolutions, infinite where only the bounds end it
    differences : names of the parameters that move by a difference
    """

    moves: Mapping[str, float]
    deviation: float
    differences: tuple[str, ...] = ()

    def __str__(self) -> str:
        """The parameters that move, and how far."""
        end = "up to the bounds" if isinf(self.deviation) else "within one deviation"
        told = [f"{n} {v:+.3g}" if n in self.differences else f"{n} x {v:.3g}" for n, v in self.moves.items()]
        return " with ".join(told) + f" {end}"


@dataclass(frozen=True, eq=False)
class Information(ReadOnly):
    """Fisher information of a fit.

    Parameters
    ----------
    scale : names, bounds and resolution of the p parameters
    slopes : derivative of n residuals, in standard deviations, by each parameter on the scale of the fit, shape (n, p)
    variance : of a residual [-]; 1 where the scatter is known
    sides : slopes to below and above, NaN where a bound leaves no room, shape (2, n, p)
    """

    scale: ParameterScale
    slopes: Array
    variance: float
    sides: Array

    def _parts(self, slopes: Array | None = None) -> tuple[Array, Array]:
        """Principal moves of the parameters, and how well the data hold each of them.

        A move has one component per parameter, counted in that parameter's resolution. Principal moves are the right
        singular vectors of the slopes per resolution, U S V^T. A move of one unit changes the residuals by its singular
        value s, so that its deviation is sqrt(variance) / s.

        Parameters
        ----------
        slopes : of the residuals, shape (n, p); the fit's own by default

        Returns
        -------
        size, moves : deviation of each move in resolutions, infinite where unseen, (p,); one move a row, (p, p)
        """
        p = len(self.scale)
        # rows of zeros: with fewer data than parameters the moves that no datum sees are vectors too
        seen = (self.slopes if slopes is None else slopes) * self.scale.resolution
        _, size, moves = np.linalg.svd(np.vstack([seen, np.zeros((p, p))]), full_matrices=False)
        floor = max(BLIND, _ROUNDING * float(size.max(initial=0.0)))
        with np.errstate(divide="ignore"):
            return np.where(size > floor, np.sqrt(self.variance) / np.maximum(size, 1e-300), inf), moves

    def _deviation(self, slopes: Array) -> Array:
        """Standard deviation of every parameter on the scale of the fit, shape (p,).

        It is infinite where a move that no datum sees changes the parameter.

        Parameters
        ----------
        slopes : derivative of the residuals by the parameters, shape (n, p)
        """
        size, moves = self._parts(slopes)
        blind = np.isinf(size)
        # variance of every parameter by every move that is seen, (p, p); and whether an unseen one changes it
        seen = (np.where(blind, 0.0, size)[:, None] * moves) ** 2
        hidden = (moves[blind] ** 2).sum(axis=0) > _PART**2
        return np.where(hidden, inf, np.sqrt(seen.sum(axis=0))) * self.scale.resolution

    @property
    def _box(self) -> Array:
        """Deviation of a value uniform between its bounds, in resolutions, shape (p,).

        It is width / sqrt(12).
        """
        return np.asarray((self.scale.high - self.scale.low) / np.sqrt(12.0) / self.scale.resolution)

    @property
    def to_sides(self) -> Array:
        """Fisher deviation of every parameter to below and above, shape (2, p).

        Both are equal unless the residuals have a kink in that parameter: their slopes to its two sides differ in size
        by more than the factor `KINK`. Each side then has the deviation that its own slopes give.
        """
        out = np.zeros((2, len(self.scale)))
        for side, own in enumerate(self.sides):
            for k in range(len(self.scale)):
                slopes = self.slopes.copy()
                sizes = np.linalg.norm(self.sides[:, :, k], axis=1)
                # NaN: a bound leaves no room on one side, so that no kink can be seen
                if not sizes.max() <= KINK * sizes.min() and not np.isnan(sizes).any():
                    slopes[:, k] = own[:, k]
                out[side, k] = self._deviation(slopes)[k]
        return out

    @property
    def deviation(self) -> Array:
        """Fisher deviation on the scale of the fit, of the weaker side.

        It is infinite where the data see nothing there.
        """
        return np.asarray(self.to_sides.max(axis=0))

    @property
    def covariance(self) -> Array:
        """Covariance on the scale of the fit, shape (p, p).

        It is the sum over the principal moves of the fit, each as wide as its deviation. A move that the data do not
        see, or hardly, is as wide as values that are uniform between the bounds.
        """
        size, moves = self._parts()
        widest = np.sqrt((moves**2 * self._box**2).sum(axis=1))
        scaled = (moves.T * np.minimum(size, widest) ** 2) @ moves
        return scaled * np.outer(self.scale.resolution, self.scale.resolution)

    @property
    def correlation(self) -> Array:
        """Correlation of the parameters, shape (p, p)."""
        c = self.covariance
        d = np.sqrt(np.diag(c))
        return c / np.outer(d, d)

    @property
    def identified(self) -> Flags:
        """Whether the deviation of each parameter is within its resolution, shape (p,)."""
        return np.asarray(self.deviation <= self.scale.resolution)

    @property
    def unresolved_directions(self) -> tuple[UnresolvedDirection, ...]:
        """Principal moves wider than the resolution, joined by an unidentified parameter.

        A move of unit length is cut at the deviation of a value that is uniform between its bounds. A parameter with a
        component of 0.1 or less takes no part in it. Parameters on a logarithmic scale are told as factors.
        """
        size, moves = self._parts()
        loose, out = ~self.identified, []
        for d, v in zip(size, moves, strict=True):
            if d <= 1.0 or not (np.abs(v[loose]) > _TAKES).any():
                continue
            reach = min(d, float(np.sqrt((v**2 * self._box**2).sum())))
            # a singular vector has no sign of its own: the parameter that moves most rises
            lead = 1.0 if v[np.argmax(np.abs(v))] > 0.0 else -1.0
            step = lead * reach * v * self.scale.resolution
            taking = sorted((k for k in range(len(v)) if abs(v[k]) > _TAKES), key=lambda k: -abs(v[k]))
            own = [(p.name, p.log, float(x)) for p, x in zip(self.scale.parameters, step, strict=True)]
            shown = {name: exp(x) if log else x for name, log, x in (own[k] for k in taking)}
            linear = tuple(name for name, log, _ in own if name in shown and not log)
            out.append(UnresolvedDirection(moves=shown, deviation=float(d), differences=linear))
        return tuple(out)

    def with_slopes(self, more: Array) -> Information:
        """The information with further residuals.

        Parameters
        ----------
        more : their slopes, shape (m, p), the same to both sides of the fit
        """
        return Information(self.scale, np.vstack([self.slopes, more]), self.variance,
                           np.concatenate([self.sides, [more, more]], axis=1))

    def of(self, kept: Array, variance: float) -> Information:
        """The information of some of the residuals.

        Parameters
        ----------
        kept : which residuals, boolean, shape (n,)
        variance : of one of them [-]
        """
        return Information(self.scale, self.slopes[kept], variance, self.sides[:, kept])


class Candidate(NamedTuple):
    """A test that could be made, and what it would tell.

    Parameters
    ----------
    name : of the test
    identified : names of the parameters whose deviation would be within the resolution
    deviations : over the resolution, by parameter [-]
    gain : half the growth of the log determinant of the information, the bounds counted as knowledge [-]
    """

    name: str
    identified: tuple[str, ...]
    deviations: Mapping[str, float]
    gain: float


@dataclass(frozen=True)
class NextTest:
    """Candidates, the best first.

    They are ordered by the number of parameters identified, then by gain.

    Parameters
    ----------
    candidates : tests that could be made, best first
    before : names of the parameters that the data so far identify
    """

    candidates: tuple[Candidate, ...]
    before: tuple[str, ...]

    @property
    def best(self) -> Candidate:
        """The candidate that identifies most parameters, of equals that with the largest gain."""
        return self.candidates[0]

    def __str__(self) -> str:
        """A line per candidate."""
        rows = [[c.name, f"{len(c.identified)}", ", ".join(n for n in c.identified if n not in self.before) or "none",
                 f"{c.gain:.2f}"] for c in self.candidates]
        return aligned([["test", "identified", "new", "gain [-]"], *rows], "<><>")


def ranked(base: Information, slopes: Mapping[str, Array]) -> NextTest:
    """Candidate tests in order, from the slopes of the residuals that each would add.

    More identified parameters come first, then the gain of information: half the logarithm of the determinant, with the
    bounds of every parameter as a uniform prior so that it exists.

    gain = (log det(J'J / s^2 + 12 / width^2) with the test - the same without) / 2

    Parameters
    ----------
    base : information of the data so far
    slopes : by name of the test, derivative of its residuals by the parameters, shape (m, p)
    """
    names = base.scale.names
    box = np.diag(12.0 / (base.scale.high - base.scale.low) ** 2)

    def weight(x: Information) -> float:
        """Log determinant of the information with the bounds counted as knowledge."""
        return float(np.linalg.slogdet(x.slopes.T @ x.slopes / x.variance + box)[1])

    out = []
    for name, more in slopes.items():
        new = base.with_slopes(more)
        kept = tuple(n for n, yes in zip(names, new.identified, strict=True) if yes)
        share = dict(zip(names, (new.deviation / base.scale.resolution).tolist(), strict=True))
        gain = 0.5 * (weight(new) - weight(base))
        out.append(Candidate(name=name, identified=kept, deviations=share, gain=gain))
    out.sort(key=lambda c: (-len(c.identified), -c.gain))
    return NextTest(tuple(out), tuple(n for n, yes in zip(names, base.identified, strict=True) if yes))
