"""One structure by several methods, beside a measurement: values, error bars, what each is, and whether they agree."""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from limitmason.limit.proven_range import proven_range
from limitmason.methods import NON_ASSOCIATIVE, THEORIES, get_method
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.results import ALMOST_SOLVED, SOLVED, Bound, BoundKind, Prediction
from limitmason.study.store import fingerprint
from limitmason.study.table import aligned

_STORED = ("method", "multiplier", "low", "high", "range_is", "bound", "status", "seconds", "details", "warnings")
_SCHEMA = "limitmason-answer"
_NAN = float("nan")


@dataclass(frozen=True, eq=False)
class Answer:
    """What one method says about one structure.

    Parameters
    ----------
    method : its name
    multiplier : lambda [-]; NaN without an answer
    low, high : range about it [-], NaN where the method has none
    range_is : what the range is
    bound, status : as in ``Prediction``; "does not apply: ..." where the method refuses the structure
    seconds : time it took
    measured : measured multiplier [-], or NaN
    details : plain further values
    warnings : what a user should know before trusting the number
    prediction : the whole answer; None where it was taken from a store
    """

    method: str
    multiplier: float
    low: float
    high: float
    range_is: str
    bound: Bound
    status: str
    seconds: float
    measured: float = _NAN
    details: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    prediction: Prediction | None = None

    @property
    def ratio(self) -> float:
        """Multiplier over the measured one [-]."""
        return self.multiplier / self.measured if self.measured else _NAN

    @property
    def beside(self) -> str:
        """What stands beside the multiplier and must not be taken for it: the smallest estimate below a bound."""
        return get_method(self.method).beside(self.details)

    @property
    def solved(self) -> bool:
        """Whether there is a finite multiplier to compare."""
        return self.status in (SOLVED, ALMOST_SOLVED) and math.isfinite(self.multiplier)


@dataclass(frozen=True, eq=False)
class SideBySide:
    """Answers of several methods to one question.

    Parameters
    ----------
    rows : one per method, in the order asked for
    measured : (low, value, high) [-], or None
    title : of the structure
    """

    rows: tuple[Answer, ...]
    measured: tuple[float, float, float] | None = None
    title: str = ""

    def __getitem__(self, method: str) -> Answer:
        """The answer of a method by its name."""
        for row in self.rows:
            if row.method == method:
                return row
        raise KeyError(f"no answer by {method!r}; there are {', '.join(r.method for r in self.rows)}")

    def __contains__(self, method: str) -> bool:
        return any(row.method == method for row in self.rows)

    def _lines(self) -> list[list[str]]:
        head = ["method", "lambda", "range", "ratio to test", "status", "s", "what it is"]
        lines = [head]
        for r in self.rows:
            ends = f"{r.low:.4f} to {r.high:.4f}" if math.isfinite(r.low) and math.isfinite(r.high) else ""
            kind = "; ".join(t for t in (r.bound, f"range: {r.range_is}" if ends else "", r.beside) if t)
            value = f"{r.multiplier:.5f}" if not math.isnan(r.multiplier) else "-"
            ratio = f"{r.ratio:.3f}" if math.isfinite(r.ratio) else "-"
            lines.append([r.method, value, ends, ratio, r.status, f"{r.seconds:.1f}", kind])
        if self.measured is not None:
            low, value, high = self.measured
            ends = f"{low:.4f} to {high:.4f}" if high > low else ""
            lines.append(["test", f"{value:.5f}", ends, "1.000", "measured", "", ""])
        else:
            lines = [line[:3] + line[4:] for line in lines]
        return lines

    def table(self) -> str:
        """All answers as a table in plain text, and below it what agrees and what does not."""
        lines = self._lines()
        align = "<>" + "<" + (">" if self.measured is not None else "") + "<><"
        return "\n".join([aligned(lines, align), "", *self.findings()])

    def __str__(self) -> str:
        """The table."""
        return self.table()

    def as_markdown(self) -> str:
        """All answers as a Markdown table."""
        lines = self._lines()
        return "\n".join("| " + " | ".join(line) + " |" for line in [lines[0], ["---"] * len(lines[0]), *lines[1:]])

    def findings(self) -> tuple[str, ...]:
        """What theory demands of the answers, checked; each line begins with "holds", "open" or "BROKEN".

        Notes
        -----
        Non-associative <= associative, and associative <= a mechanism that is admissible on the same interfaces, are
        theorems. The DEM must lie inside the range of the non-associative law within its own error budget; its finite
        stiffness and its pressure in the faces may take it out, so that is "open" and needs an explanation.
        """
        solved = {get_method(r.method).theorem: r for r in reversed(self.rows) if r.solved}
        upper, lower, mechanism = (solved.get(t) for t in ("upper", "admissible", "mechanism"))
        out = []
        if upper and lower:
            good = lower.multiplier <= upper.multiplier * (1.0 + 1e-6) + 1e-9
            out.append(f"{'holds' if good else 'BROKEN'}: non-associative <= associative ({_pair(lower, upper)})")
        for row in self.rows if upper else ():
            if row.solved and get_method(row.method).theorem == "simulation":
                out.append(self._simulation(row, lower, upper))
        if upper and mechanism:
            bound = mechanism.details.get("smallest_upper_bound", _NAN)
            name = mechanism.details.get("smallest_upper_bound_of")
            if math.isfinite(bound):
                good = upper.multiplier <= bound * (1.0 + 1e-6) + 1e-9
                out.append(
                    f"{'holds' if good else 'BROKEN'}: associative <= admissible mechanism "
                    f"({upper.multiplier:.5f}, {name} {bound:.5f})"
                )
        return tuple(out)

    @staticmethod
    def _simulation(row: Answer, lower: Answer | None, upper: Answer) -> str:
        name = get_method(row.method).look.name
        known = math.isfinite(row.low) and math.isfinite(row.high)
        low, high = (row.low, row.high) if known else (row.multiplier, row.multiplier)
        floor = lower.multiplier if lower else 0.0
        text = f"{name} {low:.5f} to {high:.5f}, admissible {floor:.5f} to {upper.multiplier:.5f}"
        if low > upper.multiplier:
            return f"open: the {name} lies above the associative value beyond its error budget ({text})"
        if high < floor:
            return f"open: the {name} lies below the smallest admissible multiplier found ({text})"
        return f"holds: the {name} lies inside the admissible range within its error budget ({text})"


def _pair(a: Answer, b: Answer) -> str:
    return f"{a.multiplier:.5f}, {b.multiplier:.5f}"


def compare(
    assembly: Assembly,
    loads: Loads,
    methods: Sequence[str] = THEORIES,
    measured: float | Sequence[float] | None = None,
    *,
    store: str | Path | None = None,
    progress: Callable[[str], object] | None = None,
    proven: float | None = None,
    title: str = "",
    **options: Mapping[str, Any],
) -> SideBySide:
    """Collapse multiplier of one structure by several methods, with what is known of the error of each.

    Parameters
    ----------
    assembly, loads : the problem
    methods : "associative", "non-associative" (both limit analysis), "dem", "mechanisms", or any other name of
        ``limitmason.methods.available_methods``
    measured : multiplier of the test [-]: a number, (low, high) or (low, value, high)
    store : folder that keeps the answer of every method when it is done; the same call finds it again, also after a
        kill, and repeats only what is missing
    progress : called with one line before and after every method
    proven : seconds for each end of the non-associative range by ``limitmason.proven_range`` (small plane walls only);
        without it the range is that of the states the search found
    title : of the structure
    options : settings by method, with underscores for its name: ``dem={"contact_points": (2, 8)}``,
        ``non_associative={"search": "quick"}``

    Returns
    -------
    SideBySide
        One row per method. The range is, for the non-associative rule, that of certified states; for the DEM its error
        budget (bracket, and changes with ten times the stiffness, twice the points and half the rate, summed on each
        side). Mechanisms: the smallest bound with the smallest estimate named beside it; where there is no bound, the
        smallest estimate with the bracket of its friction factor omega = 0 and 1.

    Raises
    ------
    ValueError
        For unknown methods, options of a method that is not asked for, and measured values that are not positive.

    Notes
    -----
    A method that refuses the structure has a row that says why. The store knows model, loads, method and options, not
    the version of the code: start a new folder after an update.
    """
    methods = (methods,) if isinstance(methods, str) else tuple(methods)
    settings = _settings(methods, options)
    if proven is not None and not any(get_method(m).theorem == "admissible" for m in methods):
        raise ValueError(f"proven is for {NON_ASSOCIATIVE!r}, which is not among the methods {', '.join(methods)}")
    test = measured_range(measured)
    say = progress or (lambda _: None)
    rows = []
    for k, method in enumerate(methods, 1):
        # without a store there is nothing to identify, and options may be any objects
        path = None
        if store is not None:
            limit = proven if get_method(method).theorem == "admissible" else None
            path = Path(store) / f"{method}-{fingerprint(assembly, loads, method, settings[method], limit)[:24]}.json"
        row = None if path is None else _read(path)
        where = f"[{k}/{len(methods)}] {method}"
        if row is None:
            say(f"{where} ...")
            row = _solve(assembly, loads, method, settings[method], proven)
            if path is not None:
                _write(path, row)
            say(f"{where}: {row.multiplier:.5g} ({row.status}; {row.seconds:.1f} s)")
        else:
            say(f"{where}: {row.multiplier:.5g} (from the store)")
        rows.append(replace(row, measured=test[1] if test else _NAN))
    return SideBySide(tuple(rows), test, title)


def _settings(methods: Sequence[str], options: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    out: dict[str, dict[str, Any]] = {}
    for method in methods:
        given = options.get(method.replace("-", "_"), options.get(method, {}))
        if not isinstance(given, Mapping):
            raise ValueError(f"options of {method!r} must be a mapping, got {given!r}")
        chosen = get_method(method)
        chosen.check_options(given)
        out[method] = {**chosen.stated, **given}
    names = {m.replace("-", "_") for m in methods} | set(methods)
    unused = sorted(set(options) - names)
    if unused:
        raise ValueError(f"options are given for {unused[0]!r}, which is not among the methods {', '.join(methods)}")
    return out


def measured_range(measured: float | Sequence[float] | None) -> tuple[float, float, float] | None:
    """Low, value and high of a measured multiplier given as a number, (low, high) or (low, value, high)."""
    if measured is None:
        return None
    numbers = [float(v) for v in measured] if isinstance(measured, Sequence) else [float(measured)]
    if len(numbers) == 2:
        numbers.insert(1, 0.5 * (numbers[0] + numbers[1]))
    low, value, high = numbers * 3 if len(numbers) == 1 else numbers if len(numbers) == 3 else (0.0, 0.0, 0.0)
    if not 0.0 < low <= value <= high < math.inf:
        raise ValueError(f"measured must be positive: a number, (low, high) or (low, value, high); got {measured!r}")
    return low, value, high


def _solve(assembly: Assembly, loads: Loads, method: str, settings: Mapping[str, Any], proven: float | None) -> Answer:
    chosen, begun = get_method(method), time.perf_counter()
    try:
        found = chosen.predict(assembly, loads, **settings)
    except ValueError as error:
        words = f"does not apply: {error}"
        return Answer(method, _NAN, _NAN, _NAN, "", Bound(BoundKind.NONE, ""), words, time.perf_counter() - begun)
    low, high, range_is = found.range
    warnings = list(found.warnings)
    if chosen.theorem == "admissible" and proven is not None:
        try:
            ends = proven_range(assembly, loads, time_limit=proven)
            low, high = (ends.ends[e].bound for e in ("smallest", "largest"))
            low, high = min(low, found.collapse_multiplier), max(high, found.collapse_multiplier)
            range_is = "no admissible multiplier lies outside" if ends.proven else "bounds, not met by states"
        except ValueError as error:
            warnings.append(f"no proven range: {error}")
    details = {k: found.details[k] for k in chosen.kept if k in found.details}
    bound = Bound(found.bound.kind, f"{found.governing}: {found.bound}") if found.governing else found.bound
    return Answer(
        method, float(found.collapse_multiplier), float(low), float(high), range_is, bound, found.status,
        time.perf_counter() - begun, details=details, warnings=tuple(warnings), prediction=found,
    )  # fmt: skip


def _read(path: Path) -> Answer | None:
    """A stored answer; None where there is none yet."""
    if not path.exists():
        return None
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        if document["schema"] != _SCHEMA:
            raise ValueError
        values = {name: document[name] for name in _STORED}
    except (ValueError, KeyError, TypeError):
        raise ValueError(f"{path} is damaged or not an answer of limitmason; delete it to compute it again") from None
    governing, kind = values["details"].get("governing"), document.get("bound_kind")
    words = values["bound"]
    # stores of 0.1 hold the words alone, behind the name of the mechanism that governs
    known = Bound.from_text(words.removeprefix(f"{governing}: ")).kind if kind is None else BoundKind(kind)
    return Answer(**{**values, "bound": Bound(known, words), "warnings": tuple(values["warnings"])})


def _write(path: Path, row: Answer) -> None:
    """Write an answer whole or not at all, so that a kill leaves no half file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    values = {name: getattr(row, name) for name in _STORED}
    document = {"schema": _SCHEMA, **values, "bound_kind": str(row.bound.kind)}
    text = json.dumps(document, default=str, indent=1)
    part = path.with_suffix(".part")
    part.write_text(text + "\n", encoding="utf-8")
    os.replace(part, path)
