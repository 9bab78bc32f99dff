"""Tables of log predictions on (cause size x nuisance), refined where they bend."""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise, product
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator, RegularGridInterpolator

from limitmason.causes.cause import Cause
from limitmason.checks import choice
from limitmason.checks import count as count_of
from limitmason.diagnosis.inference.grid import Tabulation
from limitmason.diagnosis.inference.noise import Measured
from limitmason.diagnosis.observations import Rows
from limitmason.diagnosis.simulator_calls import Job, Simulator
from limitmason.diagnosis.size_nodes import (
    CELL,
    NODES,
    between_sizes,
    is_factor,
    thinned,
    through_zero,
    transformed,
    warn_without_effect,
)
from limitmason.errors import InputError

REACH = 4.0  # standard deviations of a measured input that the refit may use
TOLERANCE = 0.1  # of the noise: largest interpolation error that needs no further level (chosen, not derived)
FEWEST, MOST = 6, 30  # size nodes on each side of the baseline
NESTED = 0.02  # of the noise: by how much a cause at its baseline size may move a prediction (chosen, not derived)
_BEGUN = 5  # levels of a cause with two sides to begin with: its baseline, both bounds, and half-way to each
_FINE = 65  # sizes at which the length of a curve is measured (chosen, not derived)
_EVEN = 0.15  # of the mean length of a piece, added to each: nodes also where the cause does nothing (chosen)
_INPUT_NODES = 2  # nodes of an input on each side of its measured value in the table of a pair
CROSSED = ("full", "corners")
INTERACTION = 0.5  # of the noise: effect of size and inputs on each other above which a specimen is tabulated in full


class Tabulator:
    """Makes tables for one design.

    Parameters
    ----------
    simulator : the calls
    rows : the numbers that are compared
    nuisance : measured inputs by name; those with error 0 are passed on as exact
    noise : standard deviation of every row, by which levels and nodes are placed, shape (n,)
    levels : most sizes per cause at which the simulator is called
    nuisance_levels : values of each measured input at which it is called
    crossed : "full" calls it at every size with every value of the inputs; "corners" at the ends only, see
        :meth:`Tabulator.single`

    Raises
    ------
    InputError
        For more than three measured inputs with an error.
    """

    def __init__(
        self, simulator: Simulator, rows: Rows, nuisance: Mapping[str, Measured], noise: np.ndarray, *,
        levels: int = 17, nuisance_levels: int | None = None, crossed: str = "full",
    ):
        """Separate inputs with an error from exact ones, and place their levels.

        Parameters
        ----------
        rows : what is compared
        noise : standard deviation of every row, shape (n,)
        levels, nuisance_levels : sizes at which a cause is simulated, and values of every input; by default as many as
            pay
        crossed : "full" for all sizes with all values of the inputs, "corners" for their ends alone
        nuisance : measured inputs by name; those with an error are free
        """
        choice("crossed", crossed, CROSSED)
        self.crossed = crossed
        self.simulator, self.rows = simulator, rows
        self.nuisance = dict(nuisance)
        self.fixed = tuple((k, m.value) for k, m in nuisance.items() if m.sd == 0)
        self.free = {k: m for k, m in nuisance.items() if m.sd > 0}
        if len(self.free) not in NODES:
            raise InputError(f"at most {max(NODES)} measured inputs can have an error, got {', '.join(self.free)}")
        self.noise = noise
        self.levels = count_of("levels", levels)
        # levels: values of an input at which the simulator is called; nodes: where the table is interpolated. Both in
        # standard deviations. Calls multiply with every input, so several have the mean and both ends alone
        own = 5 if len(self.free) == 1 else 3
        count = own if nuisance_levels is None else count_of("nuisance_levels", nuisance_levels, least=3)
        reaches = [m.reach(REACH) for m in self.free.values()]
        self.z_levels = tuple(through_zero(*reach, count) for reach in reaches)
        counts = [max(m, count) for m in NODES[len(reaches)]]
        self.z_nodes = tuple(through_zero(*r, m) for r, m in zip(reaches, counts, strict=True))

    def on(self, specimens: Sequence[Any], noise: np.ndarray) -> "Tabulator":
        """This tabulation for other specimens, at the same values of the measured inputs.

        Parameters
        ----------
        specimens : as the simulator takes them
        noise : standard deviation of every new row, shape (n,)
        """
        count = len(self.z_levels[0]) if self.z_levels else None  # every input has as many levels
        rows = self.rows.on(len(specimens))
        return Tabulator(
            self.simulator.on(specimens, rows.needed), rows, self.nuisance, noise, levels=self.levels,
            nuisance_levels=count, crossed=self.crossed,
        )

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self.rows)

    def evaluate(
        self, causes: Sequence[Cause], points: Sequence[tuple[tuple[float, ...], tuple[float, ...]]],
        rows: Sequence[int] | np.ndarray | None = None,
    ) -> np.ndarray:
        """Predictions at given sizes and nuisance values, as logarithms if compared so.

        Parameters
        ----------
        causes : none, one or two; a measurement cause with ``apply`` transforms the prediction after the others
        points : pairs of sizes (one per cause) and nuisance inputs in standard deviations
        rows : numbers of the rows; None is all

        Returns
        -------
        ndarray, shape (len of points, len of rows)
        """
        rows = np.arange(self.n) if rows is None else np.asarray(rows)
        asked, place = np.unique(self.rows.of[rows], return_inverse=True)  # specimens, and which of them each row is of
        # (parameters, causes) of a run to its number: points that differ only in how a prediction is read share one
        models: dict[tuple[tuple, tuple], int] = {}
        of_point = []  # number of the run of each point
        for sizes, z in points:
            parameters = list(self.fixed) + [(k, m.at(v)) for (k, m), v in zip(self.free.items(), z, strict=True)]
            steps = []
            for cause, size in zip(causes, sizes, strict=True):
                if cause.transforms or size == cause.baseline:
                    continue
                if cause.apply is None:
                    parameters.append((cause.parameter, float(size)))
                else:
                    steps.append((cause, float(size)))
            of_point.append(models.setdefault((tuple(parameters), tuple(steps)), len(models)))
        jobs = [Job(i, *model) for model in models for i in asked.tolist()]
        values = self.simulator.predict(jobs).reshape(len(models), len(asked), -1)  # the last axis: quantities
        values = values[:, place, self.rows.column[rows]][of_point]  # shape (points, rows)
        reads = [self._read_by(c, rows) if c.transforms else [] for c in causes]
        for index, (sizes, _) in enumerate(points):
            for cause, size, readings in zip(causes, sizes, reads, strict=True):
                if cause.transforms and size != cause.baseline:
                    values[index] = self._transformed(cause, size, values[index], readings)
        return self.rows.linked(values, rows)

    def _read_by(self, cause: Cause, rows: np.ndarray) -> list[tuple[int, int]]:
        """Of the rows that a measurement cause reads: place among those given, and number."""
        return [
            (k, int(row))
            for k, row in enumerate(rows)
            if cause.reads_row(self.rows.quantities[row], self.rows.kinds[row])
        ]

    def _transformed(
        self, cause: Cause, size: float, values: np.ndarray, readings: Sequence[tuple[int, int]]
    ) -> np.ndarray:
        """Predictions of some rows as a measurement cause of a size lets them be read.

        ``readings`` holds place in ``values`` and row of every value that the cause reads.
        """
        out = values.copy()
        for k, row in readings:
            specimen, log = int(self.rows.of[row]), bool(self.rows.log[row])
            quantity = self.rows.quantities[row]
            out[k] = transformed(cause, size, values[k], self.simulator.specimens[specimen], specimen, quantity, log)
        return out

    def baseline(self) -> Tabulation:
        """The model without any cause."""
        values = self.evaluate((), [((), z) for z in product(*self.z_levels)]).reshape(*map(len, self.z_levels), self.n)
        for axis, (name, measured) in enumerate(self.free.items()):
            ends = [measured.at(z) for z in self.z_levels[axis][[0, -1]]]
            warn_without_effect(np.ptp(values, axis=axis), f"the measured input {name!r}", name, ends)
        values = self._to_nodes(values, first=0)
        return Tabulation((), (), self.z_nodes, values)

    def single(self, cause: Cause, like: Tabulation | None = None) -> Tabulation:
        """The model with one cause.

        ``like`` gives the levels and nodes of another design to be shared.

        With ``crossed="corners"`` log f(s, z) = log f(s, 0) + log f(0, z) - log f(0, 0) + what is missing at the
        largest sizes with the outermost inputs, in proportion to size and input. Specimens for which much is missing
        there or at a point half-way, as where one mechanism takes over from another, are tabulated in full.

        Raises
        ------
        InputError
            When the cause at its baseline size does not recover the baseline model, or for an unknown parameter.
        """
        self._refuse_not_nested(cause)
        levels, error = (like.levels[0], like.error) if like is not None else self._levels(cause)
        if self.crossed == "corners" and self.free:
            values, missed = self._from_corners(cause, levels)
            error = max(error, missed)
        else:
            values = self.evaluate((cause,), [((s,), z) for s in levels for z in product(*self.z_levels)])
        if not cause.transforms:
            # a cause that changes the model reaches simulate by its keyword extend, any other by its own
            keyword = cause.parameter if cause.apply is None else "extend"
            warn_without_effect(np.ptp(values, axis=0), f"the cause {cause.name!r}", keyword, cause.bounds)
        values = self._to_nodes(values.reshape(len(levels), *map(len, self.z_levels), self.n), first=1)
        curve = between_sizes(cause, levels, values)
        nodes = like.sizes[0] if like is not None else self._nodes(cause, curve)
        return Tabulation(
            causes=(cause,), sizes=(nodes,), z=self.z_nodes, values=curve(nodes), levels=(levels,), error=error,
        )

    def pair(self, first: Tabulation, second: Tabulation, base: Tabulation, *, exact: bool) -> Tabulation:
        """The model with two causes.

        Parameters
        ----------
        first, second, base : tables of each alone and of the baseline
        exact : call the simulator for every pair of sizes; otherwise log f12 = log f1 + log f2 - log f0, to be verified
        """
        pick = [thinned(t.sizes[0], t.causes[0].baseline) for t in (first, second)]
        sizes = tuple(t.sizes[0][p] for t, p in zip((first, second), pick, strict=True))
        few = 2 * _INPUT_NODES + 1  # an input with no more nodes keeps them all
        thin = tuple(thinned(a, 0.0, each=_INPUT_NODES) if len(a) > few else np.arange(len(a)) for a in base.z)
        z = tuple(a[t] for a, t in zip(base.z, thin, strict=True))
        causes = (first.causes[0], second.causes[0])
        if exact:
            values = self.evaluate(causes, [((a, b), p) for a in sizes[0] for b in sizes[1] for p in product(*z)])
            return Tabulation(causes, sizes, z, values.reshape(len(sizes[0]), len(sizes[1]), *map(len, z), self.n))
        one, two = (t.values[np.ix_(p, *thin)] for t, p in zip((first, second), pick, strict=True))
        zero = base.values[np.ix_(*thin)] if thin else base.values
        values = one[:, None] + two[None]
        values -= zero
        return Tabulation(causes, sizes, z, values)

    def pair_error(self, table: Tabulation, at: tuple[float, ...], z: Sequence[float]) -> float:
        """Largest error of an additive pair table, in units of the noise.

        It is the true value minus that of the table, at sizes ``at`` and inputs ``z`` [sd].
        """
        true = self.evaluate(table.causes, [(tuple(at), tuple(z))])[0]
        shown = RegularGridInterpolator((*table.sizes, *table.z), table.values)(np.array([[*at, *z]]))[0]
        return float(np.max(np.abs(true - shown) / self.noise))

    def _refuse_not_nested(self, cause: Cause) -> None:
        """Refuse a cause whose baseline size moves predictions of the first specimen.

        A change up to ``NESTED`` of the noise is let pass. A keyword that ``simulate`` does not take is refused too.
        """
        if cause.apply is None:
            self.simulator.check_parameters([cause.parameter], f"cause {cause.name!r}")
        elif not cause.transforms:
            self.simulator.check_parameters(["extend"], f"cause {cause.name!r} (it has apply= and acts on the model)")
        self.simulator.check_parameters([k for k, _ in self.fixed] + list(self.free), "the nuisance")
        parameters = self.fixed + tuple((k, m.value) for k, m in self.free.items())
        first = int(self.rows.of[0])
        rows = np.flatnonzero(self.rows.of == first)
        plain = self.simulator.predict([Job(first, parameters)])[0, self.rows.column[rows]]
        if cause.transforms:
            values = self._transformed(cause, cause.baseline, plain, self._read_by(cause, rows))
        else:
            with_it = Job(first, parameters, ((cause, cause.baseline),))
            if cause.apply is None:
                with_it = Job(first, (*parameters, (cause.parameter, cause.baseline)))
            values = self.simulator.predict([with_it])[0, self.rows.column[rows]]
        change = np.abs(self.rows.linked(values, rows) - self.rows.linked(plain, rows)) / self.noise[rows]
        worst = int(np.argmax(change))
        if change[worst] > NESTED:
            raise InputError(
                f"cause {cause.name!r} at its baseline {cause.baseline:g} predicts {values[worst]:.6g} for specimen "
                f"{first}, the baseline model {plain[worst]:.6g}: a cause must be nested in the baseline"
            )

    def _levels(self, cause: Cause) -> tuple[np.ndarray, float]:
        """Sizes to call the simulator at, and the curve's largest error [noise].

        Every interval whose midpoint the curve misses by more than ``TOLERANCE`` is halved, the worst first, up to the
        number of levels. Sizes that are factors are halved by the geometric mean.
        """
        measured = tuple(0.0 for _ in self.free)  # nuisance inputs at their measured values
        most = max(self.levels, _BEGUN)
        ends = sorted({cause.baseline, *cause.sides})
        middle_of = (lambda a, b: float(np.sqrt(a * b))) if is_factor(cause) else (lambda a, b: 0.5 * (a + b))

        def called(sizes: np.ndarray) -> np.ndarray:
            return self.evaluate((cause,), [((size,), measured) for size in sizes])

        x = np.array(sorted({v for a, b in pairwise(ends) for v in (a, middle_of(a, b), b)}))
        y = called(x)
        # to be halved: both ends, and the error expected within [noise], half of what the curve missed there before; at
        # first by the curve through baseline and bounds alone, which is all that five sizes tell of two sides
        inner = np.setdiff1d(np.arange(len(x)), known := np.searchsorted(x, ends))
        missed = np.abs(between_sizes(cause, x[known], y[known])(x[inner]) - y[inner]) / self.noise
        expected = np.repeat(0.5 * missed.max(axis=1), 2).tolist()
        intervals = [(a, b, m) for (a, b), m in zip(pairwise(x), expected, strict=True)]
        worst = max(expected)
        while intervals and len(x) < most:
            room = most - len(x)
            halved, waiting = intervals[:room], intervals[room:]
            middle = np.array([middle_of(a, b) for a, b, _ in halved])
            true = called(middle)
            miss = np.max(np.abs(between_sizes(cause, x, y)(middle) - true) / self.noise, axis=1)
            order = np.argsort(np.concatenate([x, middle]))
            x, y = np.concatenate([x, middle])[order], np.concatenate([y, true])[order]
            # the curve through twice as many levels misses about a quarter as much, half beside a kink
            worst = max(0.5 * float(miss.max()), *(m for _, _, m in waiting), 0.0)
            intervals = []
            for k in np.argsort(-miss):  # where not all can be halved, the worst are
                if miss[k] > TOLERANCE:
                    (a, b, _), m, left = halved[k], middle[k], 0.5 * float(miss[k])
                    intervals += [(a, m, left), (m, b, left)]
        return x, worst

    def _from_corners(self, cause: Cause, levels: np.ndarray) -> tuple[np.ndarray, float]:
        """Values on all levels from axes and corners, and the error half-way [noise].

        Specimens that are tabulated in full do not count in the error.

        Parameters
        ----------
        cause, levels : cause, and its sizes, shape (levels,)
        """
        zero = tuple(0.0 for _ in self.free)
        points = list(product(*self.z_levels))
        # along the axes: every size at the measured inputs, (levels, n), and the baseline at all inputs, (points, n)
        line = self.evaluate((cause,), [((s,), zero) for s in levels])
        base = self.evaluate((), [((), z) for z in points])
        origin = line[int(np.argmin(np.abs(levels - cause.baseline)))]
        ends = []  # one input at an end, the others at their measured values
        for axis, level in enumerate(self.z_levels):
            ends += [tuple(float(v) if k == axis else 0.0 for k in range(len(zero))) for v in level[[0, -1]] if v]
        sides = cause.sides
        # at the corners: what size and input do together beyond the sum of what each does, shape (sides, ends, n)
        alone = self.evaluate((), [((), z) for z in ends])
        both = self.evaluate((cause,), [((s,), z) for s in sides for z in ends]).reshape(len(sides), len(ends), self.n)
        at_side = line[[int(np.argmin(np.abs(levels - s))) for s in sides]]
        missing = both - at_side[:, None] - alone[None] + origin
        reach = np.array(ends)

        def cross(size: float, z: Sequence[float]) -> np.ndarray:
            """What acting together adds: linear in size and inputs, from the corners.

            Parameters
            ----------
            size, z : of the cause, and every input in standard deviations
            """
            out = np.zeros(self.n)
            for s, rows in zip(sides, missing, strict=True):
                part = (size - cause.baseline) / (s - cause.baseline)
                for end, row in zip(reach, rows, strict=True):
                    axis = int(np.argmax(np.abs(end)))
                    out += max(part, 0.0) * max(z[axis] / end[axis], 0.0) * row
            return out

        values = np.array([[line[i] + base[j] - origin + cross(s, z) for j, z in enumerate(points)]
                           for i, s in enumerate(levels)])
        # the level nearest half-way to the bound at an outermost input: where a bend shows most
        i = int(np.argmin(np.abs(levels - 0.5 * (cause.baseline + sides[-1]))))
        true = self.evaluate((cause,), [((levels[i],), ends[0])])[0]
        missed = np.abs(true - (line[i] + alone[0] - origin + cross(levels[i], ends[0]))) / self.noise
        # where size and inputs act on each other, one mechanism takes over from another: call for every pair there
        apart = np.abs(missing).max(axis=(0, 1)) > INTERACTION * self.noise
        rows = np.flatnonzero(apart | (missed > INTERACTION))
        if len(rows):
            exact = self.evaluate((cause,), [((s,), z) for s in levels for z in points], rows)
            values[:, :, rows] = exact.reshape(len(levels), len(points), len(rows))
        return values, float(max(np.delete(missed, rows), default=0.0))

    def _nodes(self, cause: Cause, curve: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Size nodes evenly spaced along the curve in units of the noise."""
        out = [cause.baseline]
        for side in cause.sides:
            fine = (np.geomspace if is_factor(cause) else np.linspace)(cause.baseline, side, _FINE)
            steps = np.diff(curve(fine), axis=0) / self.noise
            length = np.sqrt((steps**2).sum(axis=-1)).reshape(len(fine) - 1, -1).max(axis=1)
            length += _EVEN * length.sum() / len(length) + 1e-12  # the last for a curve without any length
            along = np.concatenate([[0.0], np.cumsum(length)])
            count = int(np.clip(np.ceil(along[-1] / CELL), FEWEST, MOST))
            out += list(np.interp(np.linspace(0.0, along[-1], count + 1)[1:], along, fine))
        return np.array(sorted(out))

    def _to_nodes(self, values: np.ndarray, first: int) -> np.ndarray:
        """Values at the levels of inputs, axes from ``first`` on, carried to the nodes."""
        for axis, (level, node) in enumerate(zip(self.z_levels, self.z_nodes, strict=True), start=first):
            if len(level) != len(node):
                values = PchipInterpolator(level, values, axis=axis)(node)
        return values
