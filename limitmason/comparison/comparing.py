"""One structure by several methods, beside a measurement: values, error bars, what each is, and whether they agree."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import wrap
from typing import Any

from limitmason.answers.method import hyphened
from limitmason.answers.references import LIMITMASON, Citation
from limitmason.answers.results import Bound, Prediction
from limitmason.checks import finite, listener, several
from limitmason.comparison.findings import HOLDS, Answers
from limitmason.comparison.rows import Row
from limitmason.display.notebook import Displayed
from limitmason.display.progress import reached, watched
from limitmason.display.text_table import aligned, markdown
from limitmason.errors import InputError, NotApplicable, NotConverged
from limitmason.experiments.experiment import Quantity
from limitmason.limit.range.proven_range import proven_range
from limitmason.methods import COMPARED_METHODS, NON_ASSOCIATIVE, get_method, method_name, options_by_method
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from limitmason.storage.csv_table import Tabular
from limitmason.storage.files import named_path
from limitmason.study.memo import Memo
from limitmason.study.run_fingerprint import fingerprint

ANSWERS = "answers.jsonl"
"""File of a store's folder."""

_WIDE = 100  # characters of a line below the table, chosen: the table itself is about as wide


@dataclass(frozen=True, eq=False)
class SideBySide(Displayed, Tabular):
    """Rows of several methods to one question.

    Parameters
    ----------
    rows : one per method, in the order asked for
    measured : (low, value, high) [-], or None
    title : of the structure
    """

    rows: tuple[Row, ...]
    measured: tuple[float, float, float] | None = None
    title: str = ""

    def __getitem__(self, method: str) -> Row:
        """The answer of a method by its name."""
        name = hyphened(method, [row.method for row in self.rows])
        for row in self.rows:
            if row.method == name:
                return row
        raise KeyError(f"no answer by {method!r}; there are {', '.join(r.method for r in self.rows)}")

    def __contains__(self, method: str) -> bool:
        known = [row.method for row in self.rows]
        return hyphened(method, known) in known

    def _lines(self) -> list[list[str]]:
        """Cells of the table as text, the head first.

        Where a measurement is given it has a row, and ratios to it a column.
        """
        head = ["method", "lambda", "range", "ratio to test", "status", "s", "what it is"]
        lines = [head]
        for r in self.rows:
            ends = f"{r.low:.4f} to {r.high:.4f}" if r.has_range else ""
            kind = "; ".join(t for t in (r.bound, f"range: {r.range_is}" if ends else "", r.beside) if t)
            value = f"{r.multiplier:.5f}" if not math.isnan(r.multiplier) else "-"
            ratio = f"{r.ratio:.3f}" if math.isfinite(r.ratio) else "-"
            lines.append([r.method, value, ends, ratio, r.status, f"{r.seconds:.1f}", kind])
        if self.measured is not None:
            low, middle, high = self.measured
            ends = f"{low:.4f} to {high:.4f}" if high > low else ""
            lines.append(["test", f"{middle:.5f}", ends, "1.000", "measured", "", ""])
        else:
            ratio_column = head.index("ratio to test")
            lines = [line[:ratio_column] + line[ratio_column + 1:] for line in lines]
        return lines

    def table(self) -> str:
        """All answers as a table in plain text that fits a terminal.

        Below it what each answer is, why a theory gave none, and what agrees and what does not.
        """
        lines = self._lines()
        notes = []
        status, meaning = lines[0].index("status"), lines[0].index("what it is")
        for line in lines[1:]:
            # the column keeps "does not apply", the reason behind the colon is too long for it
            line[status], _, reason = line[status].partition(": ")
            text = "; ".join(t for t in (reason, line[meaning]) if t)
            if text:
                notes += wrap(f"{line[0]}: {text}", _WIDE, subsequent_indent="  ", break_long_words=False)
        # method, lambda, range, the ratio where there is a test, status, seconds
        align = "<><" + (">" if self.measured is not None else "") + "<>"
        parts = [part for part in (notes, list(self.findings()), self._told()) if part]
        below = [line for part in parts for line in ("", *part)]
        return "\n".join([aligned([line[:meaning] for line in lines], align), *below])

    def __str__(self) -> str:
        """The table."""
        return self.table()

    __repr__ = __str__

    def tabulated(self) -> tuple[Mapping[str, str], list[Sequence[Any]]]:
        """Columns with their units, and a row for each method."""
        names = ("method", "multiplier", "low", "high", "ratio", "status", "seconds", "bound")
        units = {name: "s" if name == "seconds" else "-" for name in names}
        return units, [[getattr(row, n) for n in names] for row in self.rows]

    def cite(self) -> Citation:
        """The papers behind all its answers, as text and as BibTeX (``cite().bibtex``).

        An answer from a store names the papers of its method; solvers and data are known to a fresh one only.
        """
        return Citation((*(c for row in self.rows for c in row.references), LIMITMASON))

    def as_markdown(self) -> str:
        """All answers as a Markdown table."""
        return "\n".join(markdown(self._lines()))

    def findings(self) -> tuple[str, ...]:
        """What theory demands of the answers, where an answer could have failed it.

        Each line begins with "holds", "open", "BROKEN" or "not checked".

        Notes
        -----
        Non-associative <= associative, and associative <= a mechanism that is admissible on the same interfaces, are
        theorems: that they hold says nothing of the structure and is left out, that one is broken is shown. A
        simulation must lie inside the range of the non-associative law within its own error budget. Finite stiffness
        and the pressure in the faces may take it out: that is "open" and needs an explanation. A demand on an answer
        that was not computed is "not checked", or says which end of the range is missing.
        """
        found = Answers(self.rows).findings()
        return tuple(str(f) for f in found if not (f.theorem and f.state == HOLDS))

    def _told(self) -> list[str]:
        """What the loads mean, as lines of a terminal."""
        texts = self.loads_of_self_stress()
        return [line for text in texts for line in wrap(text, _WIDE, subsequent_indent="  ", break_long_words=False)]

    def loads_of_self_stress(self) -> tuple[str, ...]:
        """What the smallest admissible, the sustained and the associative load mean.

        There is a line for each. Without a sustained load there is none. The first limit point of a capacity curve
        stands with them where there is one.
        """
        if "sustained" not in self or not self["sustained"].solved:
            return ()
        row = self["sustained"]
        least, most = row.details["first loss"], row.details["largest on the way"]
        out = [
            f"first loss of equilibrium: {least:.5f}, for the worst self-stress of the joints that was found; gaps of "
            "1e-4 of a block reach it",
            f"sustained: {row.multiplier:.5f}, what that mechanism still carries "
            f"{1e3 * row.details['displacement']:.3g} mm on (at most {most:.5f} on the way); far less dependent on the "
            "self-stress",
        ]
        if "pushover" in self and self["pushover"].solved:
            out.append(
                f"first limit point: {self['pushover'].multiplier:.5f}, of the path from the unstressed structure; an "
                "estimate, no bound"
            )
        if "associative" in self and self["associative"].solved:
            out.append(f"associative: {self['associative'].multiplier:.5f}, which no admissible state exceeds")
        return tuple(out)


@of_model
@watched("compare")
def compare(
    assembly: Assembly,
    loads: Loads,
    methods: Sequence[str] = COMPARED_METHODS,
    measured: float | Sequence[float] | None = None,
    *,
    store: str | Path | None = None,
    progress: Callable[[str], object] | None = None,
    proven: float | None = None,
    title: str = "",
    **options: Mapping[str, Any],
) -> SideBySide:
    """Collapse multiplier by several methods, with what is known of their errors.

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
    InputError
        For unknown methods, options of a method that is not asked for or is given twice, and measured values that are
        not positive.

    Notes
    -----
    A method that refuses the structure (``NotApplicable``) or finds no answer (``NotConverged``) has a row that says
    why; wrong input and every other error come through. The store knows model, loads, method, options and the version
    of this package: that of another version is refused.
    """
    methods = tuple(map(method_name, (methods,) if isinstance(methods, str) else several("methods", methods, str)))
    settings = {m: {**get_method(m).stated, **own} for m, own in options_by_method(methods, options).items()}
    if proven is not None and not any(get_method(m).theorem == "admissible" for m in methods):
        raise InputError(f"proven is for {NON_ASSOCIATIVE!r}, which is not among the methods {', '.join(methods)}")
    test = measured_range(measured)
    memo = None if store is None else Memo(named_path(store) / ANSWERS, kind=dict)
    say = listener("progress", progress, "a line of text") or (lambda _: None)
    keys: list[list[str]] = []
    for method in methods:
        # without a store there is nothing to identify, and options may be any objects
        limit = proven if get_method(method).theorem == "admissible" else None
        known = [] if memo is None else [fingerprint(assembly, loads, method, settings[method], limit)]
        keys.append([method, *known])
    missing = len(keys) if memo is None else sum(key not in memo for key in keys)
    rows: list[Row] = []
    done = 0
    for k, (method, key) in enumerate(zip(methods, keys, strict=True), 1):
        row = None if memo is None or key not in memo else Row.restored(memo[key], memo.path)
        where = f"[{k}/{len(methods)}] {method}"
        if row is None:
            say(f"{where} ...")
            reached(done / missing, method, share=1.0 / missing)
            done += 1
            if memo is not None:
                memo.check_writable()
            given = {**settings[method], **_taken_over(method, settings, rows)}
            row = _solve(assembly, loads, method, given, proven)
            if memo is not None:
                memo.keep(key, row.stored())
            say(f"{where}: {row.multiplier:.5g} ({row.status}; {row.seconds:.1f} s)")
        else:
            say(f"{where}: {row.multiplier:.5g} (from the store)")
        rows.append(replace(row, reference=Quantity(test[1]), kind="measured") if test else row)
    return SideBySide(tuple(rows), test, title)


def _taken_over(method: str, settings: Mapping[str, Mapping[str, Any]], rows: Sequence[Row]) -> dict[str, Prediction]:
    """Answers of other methods that a method starts from, by the setting that takes them.

    Only where both have the same contact points, and where the user gave none. An answer from a store has no
    prediction, and is not taken over.

    Parameters
    ----------
    method : that starts, by its name
    settings : options of every method
    rows : answers so far
    """
    own, out = settings[method], {}
    for name, other in get_method(method).takes_over.items():
        same_points = all(own.get(k) == settings.get(other, {}).get(k) for k in ("contact_model", "grid"))
        for row in rows:
            if row.method == other and row.prediction is not None and same_points and name not in own:
                out[name] = row.prediction
    return out


def measured_range(measured: float | Sequence[float] | None) -> tuple[float, float, float] | None:
    """Low, value and high of a measured multiplier [-], or None where none was measured.

    Parameters
    ----------
    measured : a number, (low, high), whose middle is then the value, or (low, value, high) [-]

    Raises
    ------
    InputError
        For values that are not positive or not in this order.
    """
    if measured is None:
        return None
    given = [finite("measured", v) for v in (measured if isinstance(measured, list | tuple) else [measured])]
    if len(given) == 1:
        given *= 3
    elif len(given) == 2:
        given.insert(1, 0.5 * (given[0] + given[1]))
    if len(given) != 3 or not 0.0 < given[0] <= given[1] <= given[2] < math.inf:
        raise InputError(f"measured must be positive: a number, (low, high) or (low, value, high); got {measured!r}")
    low, value, high = given
    return low, value, high


def _solve(assembly: Assembly, loads: Loads, method: str, settings: Mapping[str, Any], proven: float | None) -> Row:
    """Row of one method: its prediction and range, which is proven where asked for.

    Parameters
    ----------
    assembly, loads : the problem
    method : its name
    settings : options of the method
    proven : time to prove each end of the range of a non-associative method [s], None for no proof
    """
    chosen, begun = get_method(method), time.perf_counter()
    row = Row.attempted(method, lambda: chosen.predict(assembly, loads, **settings))
    found = row.prediction
    if found is None:
        return row
    low, high, range_is = found.range
    warnings = list(found.warnings)
    if chosen.theorem == "admissible" and proven is not None:
        try:
            ends = proven_range(assembly, loads, time_limit=proven)
            low, high = (ends.ends[e].bound for e in ("smallest", "largest"))
            # the prediction may be on other contact points than the proof: the range is widened to hold it
            low, high = min(low, found.collapse_multiplier), max(high, found.collapse_multiplier)
            range_is = "no admissible multiplier lies outside" if ends.proven else "bounds, not met by states"
        except (NotApplicable, NotConverged) as error:
            warnings.append(f"no proven range: {error}")
    details = {k: found.details[k] for k in chosen.kept if k in found.details}
    bound = Bound(found.bound.kind, f"{found.governing}: {found.bound}") if found.governing else found.bound
    return replace(
        row, low=float(low), high=float(high), range_is=range_is, bound=bound, seconds=time.perf_counter() - begun,
        details=details, warnings=tuple(warnings),
    )
