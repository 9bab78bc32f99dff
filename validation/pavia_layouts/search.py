"""Which layouts of a catalogue reproduce two published multipliers, and whether finding one means anything.

Where the drawing of a specimen is lost but two computed values of it are published, layouts that give both values can
be searched for. With a dense catalogue almost any pair of numbers is met by some layout, so the search is repeated on
*permuted* pairs, the first value of one specimen with the second value of another: where these are met as often, a
compatible layout says nothing about the specimen. What is found is inferred, not measured.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import hypergeom

from limitmason.errors import InputError
from limitmason.storage.frozen import ReadOnly
from limitmason.study.table import Table

Array = NDArray[np.float64]
Pairs = Mapping[str, tuple[float, float]]

INFERRED = "inferred, not measured"
SIGNIFICANT = 0.05


@dataclass(frozen=True)
class Control:
    """How often permuted pairs are fitted.

    Parameters
    ----------
    admitted : which permuted pairs count
    pairs, fitted : how many of them there are, and how many some layout fits
    layouts : mean number of layouts that fit one of them
    chance : of at least as many published pairs among all fitted ones, were both kinds alike (Fisher's exact test,
        one-sided); 1 where there is no permuted pair
    """

    admitted: str
    pairs: int
    fitted: int
    layouts: float
    chance: float


@dataclass(frozen=True)
class Finding:
    """Range of a quantity over the whole compatible set of one specimen; ``side`` is "open" where it spans ``about``.

    Parameters
    ----------
    side : "below", "above" or "open"; "no layout" for an empty set
    """

    specimen: str
    layouts: int
    low: float
    high: float
    about: float
    side: str


@dataclass(frozen=True, eq=False)
class LayoutSearch(ReadOnly):
    """Outcome of :func:`search_layouts`.

    Parameters
    ----------
    pairs : published values by specimen
    catalogue : layouts with their computed values, one per row
    columns : of the first and of the second value
    tolerance : largest difference of each value from the published one, relative [-]
    compatible : numbers of the rows that fit, by specimen: the whole set
    misfit : smallest larger-of-two relative difference over the catalogue, by specimen [-]
    controls : permuted pairs; the last one decides
    informative : whether the published pairs are fitted more often than permuted ones
    verdict : the same in words
    """

    pairs: Pairs
    catalogue: Table
    columns: tuple[str, str]
    tolerance: float
    compatible: Mapping[str, tuple[int, ...]]
    misfit: Mapping[str, float]
    controls: tuple[Control, ...]
    informative: bool
    verdict: str

    def layouts(self, specimen: str) -> Table:
        """The compatible layouts of one specimen, marked as inferred."""
        if specimen not in self.compatible:
            raise InputError(f"no specimen {specimen!r}; specimens: {', '.join(self.compatible)}")
        rows = tuple(self.catalogue.rows[k] for k in self.compatible[specimen])
        return Table(rows, self.catalogue.units, (f"layouts {INFERRED}",))

    def summary(self) -> Table:
        """One row per specimen: published pair, number of compatible layouts, smallest misfit [%]."""
        return Table(
            tuple(
                {"specimen": name, self.columns[0]: pair[0], self.columns[1]: pair[1],
                 "compatible": len(self.compatible[name]), "smallest misfit": 100.0 * self.misfit[name]}
                for name, pair in self.pairs.items()
            ),
            {"smallest misfit": "%"},
            (f"of {len(self.catalogue)} layouts, both values within {100 * self.tolerance:g} %; layouts {INFERRED}",),
        )

    def over_sets(
        self, quantity: Callable[[Mapping[str, Any], str], float], *, about: float = 1.0
    ) -> tuple[Finding, ...]:
        """Range of a quantity over the whole compatible set of every specimen.

        A conclusion may be drawn where all compatible layouts lie on one side of ``about``, and nowhere else.

        Parameters
        ----------
        quantity : from a row of the catalogue and the name of the specimen; NaN where it is unknown
        about : value to compare with

        Notes
        -----
        A quantity made of the two fitted values alone, such as their ratio, repeats the published pair to within the
        tolerance: that is the condition of the search, not a result of it.
        """
        found = []
        for name, numbers in self.compatible.items():
            values = np.array([quantity(self.catalogue.rows[k], name) for k in numbers], dtype=float)
            if not len(values):
                found.append(Finding(name, 0, np.nan, np.nan, about, "no layout"))
                continue
            low, high = float(values.min()), float(values.max())  # NaN if one is unknown: then nothing holds over all
            side = "below" if high < about else "above" if low > about else "open"
            found.append(Finding(name, len(values), low, high, about, side))
        return tuple(found)


def search_layouts(
    catalogue: Table, pairs: Pairs, *, columns: tuple[str, str], tolerance: float = 0.05
) -> LayoutSearch:
    """Find, for every specimen, all layouts whose two computed values meet the two published ones.

    |c_1 / p_1 - 1| <= tolerance and |c_2 / p_2 - 1| <= tolerance for computed c and published p.

    Parameters
    ----------
    catalogue : one row per layout, with two columns of computed values; rows in which one is missing never fit
    pairs : published values by specimen; repeats of one layout must be given once, or they would count twice
    columns : of the catalogue, for the first and the second value
    tolerance : [-]

    Returns
    -------
    LayoutSearch
        With three controls on permuted pairs: all of them; those in which the first value does not exceed the second;
        and those whose ratio of values lies within the range of the published ratios, which look as plausible as the
        published ones. The last decides: unless the published pairs are fitted significantly more often (chance below
        0.05), the search says nothing.

    Raises
    ------
    InputError
        For no pairs, values that are not positive, an empty catalogue and missing columns.

    Notes
    -----
    Wrong as a measure of likelihood: how many layouts fit depends on how the catalogue was drawn.
    """
    if not pairs:
        raise InputError("no published pairs are given")
    for name, pair in pairs.items():
        if len(pair) != 2 or not (np.isfinite(pair).all() and min(pair) > 0.0):
            raise InputError(f"the published pair of {name!r} must be two positive numbers, got {pair!r}")
    if not tolerance > 0.0:
        raise InputError(f"tolerance must be positive, got {tolerance!r}")
    if not len(catalogue):
        raise InputError("the catalogue holds no layout")
    computed = np.column_stack([catalogue[c] for c in columns]).astype(float)
    published = np.array(list(pairs.values()), dtype=float)

    first, second = (np.abs(computed[:, None, k] / published[None, :, k] - 1.0) for k in (0, 1))
    # misfit[i, j]: of the first value of specimen i with the second one of specimen j, for the layout nearest to both
    both = np.fmax(first[:, :, None], second[:, None, :])
    both[~np.isfinite(first[:, :, None] + second[:, None, :])] = np.inf
    misfit, number = both.min(axis=0), (both <= tolerance).sum(axis=0)
    ratio = published[:, None, 0] / published[None, :, 1]
    own = np.diag(ratio)
    admitted = {
        "all": np.ones_like(number, dtype=bool),
        "first value not above the second": ratio <= max(1.0, float(own.max())),
        "ratio of the values as published": (ratio >= own.min()) & (ratio <= own.max()),
    }
    controls = tuple(_control(label, number, mask) for label, mask in admitted.items())
    informative, verdict = _verdict(number, controls[-1], tolerance)
    compatible = {
        name: tuple(int(n) for n in np.flatnonzero(both[:, k, k] <= tolerance)) for k, name in enumerate(pairs)
    }
    return LayoutSearch(
        dict(pairs), catalogue, columns, tolerance, compatible,
        {name: float(misfit[k, k]) for k, name in enumerate(pairs)}, controls, informative, verdict,
    )


def _control(label: str, number: NDArray[np.intp], admitted: NDArray[np.bool_]) -> Control:
    """Control from the number of layouts that fit the pair (first value of i, second value of j)."""
    permuted = number[admitted & ~np.eye(len(number), dtype=bool)]
    own, fitted = int((np.diag(number) > 0).sum()), int((permuted > 0).sum())
    chance = float(hypergeom.sf(own - 1, len(number) + len(permuted), own + fitted, len(number)))
    return Control(label, len(permuted), fitted, float(permuted.mean()) if len(permuted) else np.nan, chance)


def _verdict(number: NDArray[np.intp], control: Control, tolerance: float) -> tuple[bool, str]:
    own, n = np.diag(number), len(number)
    if not own.any():
        return False, f"no layout of the catalogue fits any of the {n} published pairs within {100 * tolerance:g} %"
    if not control.pairs:
        return False, "the search says nothing: there is no permuted pair to compare with"
    counts = (
        f"{(own > 0).sum()} of {n} published pairs are fitted, by {own.mean():.3g} layouts on average. Of the permuted "
        f"ones ({control.admitted}) {control.fitted} of {control.pairs} are, by {control.layouts:.3g}. The chance of "
        f"this or more, were they alike, is {control.chance:.2g}"
    )
    if control.chance <= SIGNIFICANT:
        return True, f"the search says something. {counts}"
    return False, f"the search says nothing. {counts}"
