"""Tables of one set of specimens: made when first asked for, kept for verdicts."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from limitmason.causes.cause import Cause, cause_pairs
from limitmason.checks import choice
from limitmason.diagnosis.error_rates import Rehearsal
from limitmason.diagnosis.inference.design import Design, Names
from limitmason.diagnosis.inference.grid import Grid, Tabulation, at_measured
from limitmason.diagnosis.inference.judge import Judge
from limitmason.diagnosis.inference.noise import Noise
from limitmason.diagnosis.inference.verdict import Verdict
from limitmason.diagnosis.tabulate import Tabulator
from limitmason.errors import NotApplicable, NotConverged

ASSUMED_NOISE = 0.04  # places levels and nodes, and scales distances, where the noise is unknown
PAIR_TABLES = ("verified", "exact", "additive")
PAIR_ERROR = 0.25  # of the noise: largest error of an additive pair table
PAIR_NEAR = 6.0  # log-likelihood deficit within which a pair is verified


class CauseTables:
    """The baseline, causes and pairs of causes, tabulated on first use.

    Parameters
    ----------
    tabulator : makes them
    pair_tables : one of ``PAIR_TABLES``, see :class:`~limitmason.diagnosis.Study`

    Raises
    ------
    InputError
        For another word.
    """

    def __init__(self, tabulator: Tabulator, pair_tables: str = "verified"):
        """Begin without any table: each is made when it is first asked for.

        Parameters
        ----------
        tabulator, pair_tables : as of the class
        """
        choice("pair_tables", pair_tables, PAIR_TABLES)
        self.tabulator = tabulator
        self.pair_tables = pair_tables
        self.aside: dict[Cause, str] = {}
        self._base: Tabulation | None = None
        self._singles: dict[Cause, Tabulation] = {}
        self._true: dict[tuple[Cause, Cause], Tabulation] = {}  # by both causes in the order of the axes
        self._true_pairs: set[frozenset[Cause]] = set()  # whose sum of single effects is wrong

    def base(self) -> Tabulation:
        """Table of the baseline."""
        if self._base is None:
            self._base = self.tabulator.baseline()
        return self._base

    def single(self, cause: Cause) -> Tabulation:
        """Table of one cause."""
        if cause not in self._singles:
            self._singles[cause] = self.tabulator.single(cause)
        return self._singles[cause]

    def between(self, sizes: Mapping[Cause, float], z: Sequence[float] = ()) -> np.ndarray:
        """Predictions on the scale of comparison with any causes, interpolated, (n,).

        The effects of several causes add up on that scale. NaN for a size or an input outside its table.

        Parameters
        ----------
        sizes : of the causes that are switched on
        z : measured inputs in standard deviations from their values; () is the values themselves
        """
        at = tuple(z) or (0.0,) * len(self.tabulator.free)

        def read(table: Tabulation, *size: float) -> np.ndarray:
            """Predictions of a table at a size and the measured inputs, linear between nodes."""
            axes = (*table.sizes, *table.z)
            if not axes:
                return table.values
            inner = RegularGridInterpolator(axes, table.values, bounds_error=False, fill_value=np.nan)
            return np.asarray(inner(np.array([[*size, *at]]))[0])

        base = read(self.base())
        return base + sum((read(self.single(c), s) - base for c, s in sizes.items()), np.zeros(len(base)))

    def computable(self, causes: tuple[Cause, ...]) -> tuple[Cause, ...]:
        """The causes that the simulator computes.

        The others are set aside in ``aside``, with the reason.

        Raises
        ------
        NotApplicable
            Where none is left; an error of the model without any cause comes through as it is.
        """
        self.base()
        for cause in causes:
            if cause not in self.aside:
                try:
                    self.single(cause)
                except (NotApplicable, NotConverged) as reason:
                    self.aside[cause] = str(reason)
        left = tuple(c for c in causes if c not in self.aside)
        if not left:
            raise NotApplicable(f"no cause of the list can be computed; {causes[0].name}: {self.aside[causes[0]]}")
        return left

    def pair(self, first: Cause, second: Cause) -> Tabulation:
        """Table of two causes, by the simulator or own effects, by ``pair_tables``.

        Its first axis is that of ``first``.
        """
        alone = self.single(first), self.single(second), self.base()
        if self.pair_tables != "exact" and frozenset((first, second)) not in self._true_pairs:
            return self.tabulator.pair(*alone, exact=False)  # a sum, which a thousand numbers make too large to keep
        if (first, second) not in self._true:
            self._true[first, second] = self.tabulator.pair(*alone, exact=True)
        return self._true[first, second]

    def design(self, causes: tuple[Cause, ...], noise: Noise, scale: np.ndarray, columns: Mapping) -> Design:
        """All that the rule needs of a list of causes under a statement of the noise.

        Tables are taken from the baseline prediction in units of the noise.

        Parameters
        ----------
        causes, noise : the list, and what is stated
        scale : standard deviation per specimen, shape (n,)
        columns : name to values of all specimens, along which effects may go
        """
        base = self.base()
        origin = at_measured(base)
        by_name = {c.name: c for c in causes}
        singles = {c.name: self.single(c).whitened(origin, scale) for c in causes}
        pairs = tuple((a.name, b.name) for a, b in cause_pairs(causes))

        def pair_table(names: Names) -> Tabulation:
            return self.pair(by_name[names[0]], by_name[names[1]])

        null = base.whitened(origin, scale)
        rows = self.tabulator.rows
        return Design(
            causes=causes, noise=noise.about(origin), scale=scale, origin=origin, null=null, singles=singles,
            columns=columns, pair_table=pair_table, pair_names=pairs, log=rows.log, kinds=rows.kinds,
            measured=tuple(self.tabulator.free),
        )

    def replace_wrong_pairs(self, design: Design, verdict: Verdict) -> bool:
        """Replace additive tables of pairs that are wrong by full ones, True if any was.

        A table is compared with the simulator at the fit and half-way to it. It is wrong beyond ``PAIR_ERROR`` of the
        noise.

        Parameters
        ----------
        design : forgets the pairs that were wrong
        verdict : whose pairs are looked at, those with a deficit of at most ``PAIR_NEAR``
        """
        if self.pair_tables != "verified":
            return False
        by_name: dict[str, Any] = {c.name: c for c in design.causes}
        replaced = False
        for names, tested in verdict.tested.items():
            if len(names) != 2 or tested.deficit > PAIR_NEAR:
                continue
            first, second = by_name[names[0]], by_name[names[1]]
            key = frozenset((first, second))
            if key in self._true_pairs or (first.transforms and second.transforms):
                continue  # two causes of the measurement run no model together
            table = self.pair(first, second)
            z = tuple(float(np.clip(v, a[0], a[-1])) for v, a in zip(tested.z, table.z, strict=True))
            half = tuple(0.5 * (c.baseline + s) for c, s in zip((first, second), tested.sizes, strict=True))
            errors = [self.tabulator.pair_error(table, at, z) for at in (tested.sizes, half)]
            if max(errors) > PAIR_ERROR:
                self._true_pairs.add(key)
                design.forget_pair(names)
                replaced = True
        return replaced

    def forget_sums(self, design: Design) -> None:
        """Drop grids of a design that were made before another list showed their sums of effects to be wrong."""
        for pair in self._true_pairs:
            first, second = (c.name for c in pair)
            design.forget_pair((first, second))
            design.forget_pair((second, first))

    def on(self, specimens: Sequence[Any], placing: np.ndarray) -> "CauseTables":
        """Tables of other specimens by the same simulator, which knows what it computed.

        Parameters
        ----------
        placing : noise per specimen that levels and nodes are placed by, shape (n,)
        """
        return CauseTables(self.tabulator.on(specimens, placing), self.pair_tables)


class PoolGrids(dict):
    """Grids on a pool with the nodes of those on tested specimens, made when asked.

    Parameters
    ----------
    tested : tables of the tested specimens
    pool : specimens that could be tested
    noise : stated for the tested specimens
    causes : the list
    scale : noise of the tested rows, shape (n,): a test of the pool has that of its quantity on average, or
            as planned
    """

    def __init__(
        self, tested: CauseTables, pool: Sequence[Any], noise: Noise, causes: Iterable[Cause], scale: np.ndarray
    ):
        """Take the noise of every row of the pool, and tables at the tested levels.

        A row of the pool has no value yet: its noise is the mean of that of the tested specimens for the same quantity,
        or what is planned. Where the noise is unknown an assumed one places the nodes of the tables.

        Parameters
        ----------
        scale : standard deviation of every tested row, shape (n,)
        """
        super().__init__()
        self.tested = tested
        rows = tested.tabulator.rows
        # one entry for each quantity that is measured or planned, in the order of the rows of a specimen of the pool
        mean = [float(np.mean(scale[rows.column == k])) for k in range(len(rows.needed))]
        mean += [scatter for _, _, scatter in rows.planned.values()]
        self.scale = np.tile(mean, len(pool))
        placing = self.scale if noise.kind != "unknown" else np.full(len(self.scale), ASSUMED_NOISE)
        self.tables = tested.on(pool, placing)
        self.rows = self.tables.tabulator.rows
        self.by_name = {c.name: c for c in causes}

    def __missing__(self, names: Names) -> Grid:
        self[names] = self._table(names).whitened(at_measured(self.tables.base()), self.scale)
        return self[names]

    def _table(self, names: Names) -> Tabulation:
        """Table of an explanation on the pool, at the levels of the tested specimens."""
        base = self.tables.base()
        if not names:
            return base
        causes = [self.by_name[n] for n in names]
        first, *second = [self.tables.tabulator.single(c, self.tested.single(c)) for c in causes]
        return first if not second else self.tables.tabulator.pair(first, second[0], base, exact=True)


def placing_noise(noise: Noise, n: int) -> np.ndarray:
    """Noise that tables are placed by: as stated, or ``ASSUMED_NOISE``, (n,)."""
    return noise.scale(n) if noise.kind != "unknown" else np.full(n, ASSUMED_NOISE)


@dataclass(frozen=True)
class StudyCache:
    """What a study has made so far, shared by its variants.

    It holds the tables and, by list of causes, the designs, judges and rehearsals.
    """

    tables: CauseTables
    designs: dict[tuple[Cause, ...], Design]
    judges: dict[Any, Judge] = field(default_factory=dict)
    rehearsed: dict[tuple[Cause, ...], Rehearsal] = field(default_factory=dict)
