"""A diagnosis as it is handed out: report as text, table of causes, record."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from limitmason.causes.cause import Cause
from limitmason.diagnosis import basis_text as rests_on
from limitmason.diagnosis import verdict_text as words
from limitmason.diagnosis.inference.next_tests import NextTests
from limitmason.diagnosis.inference.shared_noise import PLAUSIBLE
from limitmason.diagnosis.inference.trends import is_numeric
from limitmason.diagnosis.inference.verdict import Rule, VerdictKind
from limitmason.diagnosis.inference.verdict_sensitivity import LIKE, CheckedVerdict, Checks
from limitmason.diagnosis.observations import FLAGS
from limitmason.diagnosis.result import Findings
from limitmason.diagnosis.study_from_table import About
from limitmason.storage.files import write_text
from limitmason.study.memo import plain

OFF = 0.25  # of the noise: error of a table from which on a warning names it (chosen, not derived)
HANGS = 6  # specimens that a verdict hangs on, that are told one by one (chosen)
COLLINEAR = 0.9  # correlation at which two covariates cannot be held apart


class Asked(Protocol):
    """A study, as far as its answers ask it: what it is about, and tests to come."""

    @property
    def about(self) -> About:
        """What its data are."""

    def suggested(
        self, causes: tuple[Cause, ...], pool: Sequence[Any], k: int, costs: Mapping[str, float] | None,
        diagnosis: Findings | None,
    ) -> NextTests:
        """Specimens of a pool that would tell the kept causes of a diagnosis apart."""


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Findings):
    """Verdict of a study, conditional on its list of causes.

    The study that gave it stands beside it.

    Parameters
    ----------
    study : what was asked; all others are those of :class:`~limitmason.diagnosis.result.Findings`
    """

    study: Asked

    @property
    def warnings(self) -> tuple[str, ...]:
        """What limits the verdict, from the list, the noise, the tables and the estimates."""
        out = [f"Set aside, for it cannot be computed: {name} ({reason})." for name, reason in self.aside.items()]
        if self.covariate:
            out += _collinear(self.covariates, self.covariate)
        if self.groups is None and _repeats(self.covariates):
            out.append(
                "Some specimens repeat a configuration (same covariates) and no groups are given: leaving out one "
                "repeat says nothing about geometry. Give groups."
            )
        out += _copies(self)
        if all(c.acts_on != "measurement" for c in self.listed):
            out.append(
                "No measurement cause (offset, gain, batch) is in the list: a sensor's fault can pass as physics."
            )
        if self.noise.kind == "known":
            out.append(
                "The noise is taken as exactly known; replicates would test it (Noise(sd, dof), Noise.from_replicates)."
                " Stated as 4 % where it is 5 %, about a third of clean data sets raise an alarm."
            )
        if self.noise.kind == "unknown":
            out.append("The noise is unknown: more scatter than expected cannot be seen.")
        if not self.covariates:
            out.append("No covariates are recorded: an effect outside the list can only show as scatter.")
        for cause in self.listed:
            error = self.table_errors[cause.name]
            if error > OFF:
                out.append(f"The table of {cause.name} may be off by {error:.2f} of the noise between its levels.")
            name = cause.name
            if name in self.estimates and self.estimates[name].at_bound:
                out.append(f"The size of {name} sits at its bound: the bound, not the data, decides it.")
        if self.kind in ("cause", "behaves like", "either", "two"):
            out.append("This is the smallest explanation: two effects can pass as a third, three as two.")
        if self.kind == "unexplained" and not self.covariate:
            out.append("No recorded covariate goes with the misfit.")
        return tuple(out)

    def report(self, *, checks: bool = True, progress: Callable[[str], None] | None = None) -> str:
        """The verdict as text.

        Parameters
        ----------
        checks : also judge the data again under other statements of the noise and without each specimen (some seconds
            for 16 causes and 24 specimens)
        progress : told in a line what is judged again
        """
        verdict = self.verdict
        first = words.headline(self)
        lines = [first[0].upper() + first[1:] + ".", "", *words.meaning(self), ""]
        # of several quantities each row is called "specimen, quantity"
        walls = len({name.removesuffix(f", {q}") for name, q in zip(self.specimens, self.quantities, strict=True)})
        counted = f"{walls} specimen{'s' if walls > 1 else ''}" + (f", {self.n} numbers" if self.n > walls else "")
        gate = words.gate_words(verdict.p)
        lines.append(f"{counted}, seed {self.seed}, at most {self.rule.draws} draws. Gate: {gate}.")
        lines += [*rests_on.basis(self), *rests_on.trend_words(self)]
        if self.kept:
            lines += [
                "",
                "Not rejected (each p is the chance of a worse misfit under that cause, not of its being true):",
            ]
            lines += self._kept_lines()
        if self.kind in ("none", "scatter"):
            told = f" ({rests_on.enumerated(self.unstated)} are not recorded, which makes them larger)"
            seen = f"Smallest size that would have been seen nine times in ten{told if self.unstated else ''}:"
            lines += ["", seen]
            lines += [f"  {c.name}: {words.seen_from(c, self.detectable[c.name])}" for c in self.listed]
        lines += ["", "The verdict is conditional on this list:"]
        width = max(len(c.name) for c in self.listed)
        for cause in self.listed:
            tested = verdict.tested[(cause.name,)]
            state = self.state_of((cause.name,))
            size = f"size {cause.show(tested.sizes[0])} within {cause.bounds[0]:g} to {cause.bounds[1]:g}"
            lines.append(f"  {cause.name:<{width}}  {size}, log-likelihood {tested.gain:+.2f}, {state}")
        if missing := words.if_it_were_missing(self):
            lines.append(missing)
        notes = [*self.warnings, *(check_lines(self, self.judged_again(progress)) if checks else [])]
        if notes:
            lines += ["", "To keep in mind:"] + [f"  - {note}" for note in notes]
        return "\n".join(lines)

    def _kept_lines(self) -> list[str]:
        """Lines on kept explanations: sizes and p values, physics, gain of each.

        Of more than the gain is measured of the rest is counted.
        """
        lines = []
        for names, gain in self.gains.items():
            evidence = words.gate_words(self.verdict.tested[names].p)
            lines.append(f"  {' and '.join(self.sized(names))}; {evidence}")
            causes = [self.by_name[n] for n in names]
            if physics := "; ".join(f"{c.physics} ({c.acts_on})" for c in causes if c.physics):
                lines.append(f"    {physics}")
            lines.append(f"    {gain}")
        if more := len(self.kept) - len(self.gains):
            lines.append(f"  and {more} more")
        return lines

    def state_of(self, names: tuple[str, ...]) -> str:
        """What became of an explanation, in words.

        It is "kept", "withdrawn, though it fits", "rejected: " with the reason, or "not tested". An explanation is
        rejected when one of its p values falls below the threshold of the rule. One that fits may still be withdrawn,
        for reasons that the text above the list gives. One without p values was not tested.

        Parameters
        ----------
        names : of one cause, or of two that act together
        """
        tested = self.verdict.tested[names]
        if tested.kept:
            return "kept"
        if names in (*self.verdict.withdrawn, *self.verdict.structured, *self.verdict.rivalled):
            return "withdrawn, though it fits"
        return "rejected: " + _why(tested.p, self.rule) if tested.p else "not tested"

    def table(self) -> list[dict[str, Any]]:
        """Rows of listed causes and kept pairs: size, interval, gain, p, and if kept.

        "gain" and "deficit" are log-likelihoods above the baseline and below the best explanation; sizes are in "unit".
        """
        verdict = self.verdict
        rows, by_name, held = [], self.by_name, self.identification
        shown = [(c.name,) for c in self.listed] + list(self.pairs)
        for names in shown:
            tested = verdict.tested[names]
            intervals = [self.estimates[n] for n in names if tested.kept and n in self.estimates]
            single = by_name[names[0]] if len(names) == 1 else None
            rows.append(
                {
                    "cause": " + ".join(names),
                    "acts_on": single.acts_on if single else "",
                    "unit": " + ".join(by_name[n].unit for n in names),
                    "kept": tested.kept,
                    "identified": held.holds if held is not None and held.names == names else None,
                    "size": tested.sizes,
                    "interval": tuple((e.low, e.high) for e in intervals),
                    "gain": tested.gain,
                    "deficit": tested.deficit,
                    **{f"p_{k}": tested.p.get(k) for k in ("deficit", "shape", "scatter")},
                    "draws": tested.draws,
                    "detectable": self.detectable[names[0]] if single else (),
                    "left_out": self.gains[names].leave_one_out.total if names in self.gains else None,
                }
            )
        return rows

    def record(self) -> dict[str, Any]:
        """Verdict, sizes, reasons, gain, rehearsal, noise and list as JSON can hold them.

        Sizes are in the unit of each cause; log-likelihoods are natural; shares lie between 0 and 1.
        """
        verdict, held, doubt = self.verdict, self.identification, self.verdict.doubt
        rehearsed, gain = verdict.rehearsed, self.gain
        units = {c.name: c.unit for c in self.listed}
        return {
            "kind": str(self.kind),
            "headline": words.headline(self),
            "in words": words.meaning(self),
            "causes": list(self.causes),
            "pairs": [list(p) for p in self.pairs],
            "identified": self.identified,
            "covariate": self.covariate,
            "sizes": {
                n: {"size": e.size, "low": e.low, "high": e.high, "unit": units[n]} for n, e in self.estimates.items()
            },
            "identification": None if held is None else {
                "missing": list(held.missing), "nearest discrepancy": held.along, "excess": held.excess,
                "margin": held.margin, "expected excess": held.expected, "chance to identify it": held.chance,
                "nearest lever": held.rival, "over it": held.rival_excess,
                "slope": held.slope, "slope error": held.slope_error, "left out, ahead by": held.ahead,
            },
            "by kind": [
                {"kind": k.kind, "gain": k.gain, "share": k.share, "error": k.error, "misfit": k.misfit}
                for k in self.by_kind
            ],
            "if the true cause were missing": None if rehearsed is None else {
                "in words": words.if_it_were_missing(self), "share named": rehearsed.rate,
                "data sets": rehearsed.trials,
            },
            "shared noise": dict(self.shares.shares),
            "shared unstated": None if doubt is None else {
                "by the tests of": list(doubt.names), "not recorded": list(doubt.unstated),
                "p": dict(doubt.p), "the alarm stands": doubt.holds,
            },
            "gain": None if gain is None else {
                "error before": gain.error_before, "error after": gain.error_after,
                "error left out": gain.error_left_out, "log score left out": gain.leave_one_out.total,
                "log score of kinds left out": {k: s.total for k, s in gain.leave_kind_out.items()},
            },
            "list": [c.name for c in self.listed],
            "set aside": dict(self.aside),
            "specimens": self.n,
            "noise": str(self.noise),
            "seed": self.seed,
            "warnings": list(self.warnings),
        }

    def next_tests(self, pool: Sequence[Any], k: int = 4, costs: Mapping[str, float] | None = None) -> NextTests:
        """Specimens of a pool that would tell the kept causes apart, or identify one.

        Parameters
        ----------
        pool : specimens that could be tested, as ``simulate`` takes them
        k : how many, at most the size of the pool
        costs : of a test by what is measured in it, 1 where it is not told; None are those of ``about``. What an
            observation without a value names may be measured too
        """
        return self.study.suggested(self.listed, pool, k, costs, self)

    def __str__(self) -> str:
        return words.headline(self)

    def __repr__(self) -> str:
        return f"<Diagnosis of {self.n} specimens, {words.headline(self)}>"


def check_lines(diagnosis: Findings, checks: Checks) -> list[str]:
    """What the verdict hangs on, by other statements and single specimens."""
    out: list[str] = []

    def is_same(answer: CheckedVerdict) -> bool:
        """Whether a verdict has the kind and the causes of the diagnosis."""
        return answer.kind == _as_one_kind(diagnosis) and set(answer.causes) == set(diagnosis.causes)

    if diagnosis.noise.kind != "unknown":
        other = "With the noise taken as unknown the verdict is the same."
        if not is_same(checks.unknown_noise):
            other = (
                f"Stated and unknown noise disagree: with the noise taken as unknown the verdict is "
                f"{checks.unknown_noise}."
            )
        out.append(other)
    for column, answer in checks.shared.items():
        where = "groups of like specimens" if column == LIKE else column
        what = f"With {100 * PLAUSIBLE:.0f} % of the noise's variance shared within {where} (assumed: not estimated)"
        told = "is the same" if is_same(answer) else f"is {answer}"
        out.append(f"{what} the verdict, before it is identified, {told}.")
    for i in checks.hangs_on[:HANGS]:
        out.append(f"The verdict hangs on {diagnosis.specimens[i]}: without it, it is {checks.dropped[i]}.")
    if len(checks.hangs_on) > HANGS:
        out.append(f"And without {len(checks.hangs_on) - HANGS} other single specimens it changes too.")
    if not checks.hangs_on:
        out.append(
            "No single specimen decides: left out one at a time, none turns the verdict into another kind or into "
            "other causes (a set may grow or shrink)."
        )
    return out


def _as_one_kind(diagnosis: Findings) -> str:
    """The kind, "behaves like" being what is said where names are not identified."""
    if diagnosis.kind != VerdictKind.BEHAVES_LIKE:
        return str(diagnosis.kind)
    return str(VerdictKind.TWO if diagnosis.pairs else VerdictKind.CAUSE)


def _collinear(covariates: Mapping[str, Sequence[Any]], name: str) -> list[str]:
    """Numeric covariates that go with the one the residuals vary with."""
    chosen = covariates.get(name)
    if chosen is None or not is_numeric(chosen):
        return []
    x, found = np.asarray(chosen, dtype=float), []
    for other, column in covariates.items():
        if other != name and is_numeric(column) and np.ptp(np.asarray(column, dtype=float)) > 0:
            r = float(np.corrcoef(x, np.asarray(column, dtype=float))[0, 1])
            if abs(r) >= COLLINEAR:
                found.append(f"{other} (r = {r:+.2f})")
    if not found:
        return []
    return [f"{name} goes with {', '.join(found)} in these specimens: the trend may belong to either."]


def _repeats(covariates: Mapping[str, Sequence[Any]]) -> bool:
    """Whether two specimens share all covariates."""
    rows = list(zip(*(map(str, c) for c in covariates.values()), strict=True))
    return len(set(rows)) < len(rows)


def _copies(diagnosis: Findings) -> list[str]:
    """Specimens whose values, two and more, are those of another to the last digit."""
    found: dict[str, dict[str, float]] = {}
    rows = zip(diagnosis.covariates.get("specimen", ()), diagnosis.quantities, diagnosis.measured, strict=False)
    for name, quantity, value in rows:
        found.setdefault(str(name), {})[quantity] = float(value)
    first: dict[frozenset[tuple[str, float]], str] = {}  # the first specimen with these numbers
    out = []
    for name, values in found.items():
        # what was seen or not is often the same
        numbers = frozenset((q, v) for q, v in values.items() if not q.startswith(FLAGS))
        if len(numbers) > 1 and (other := first.setdefault(numbers, name)) != name:
            out.append(f"{name} has the values of {other} to the last digit: a row that is there twice counts twice.")
    return out


def _why(p: Mapping[str, float], rule: Rule) -> str:
    """The p values that reject an explanation, in words."""
    limits = {"deficit": rule.deficit, "shape": rule.kept_shape, "scatter": rule.kept_scatter}
    return words.gate_words({k: v for k, v in p.items() if v < limits[k]})


def write_record(path: str | Path, diagnosis: Diagnosis) -> Path:
    """Write a diagnosis's record as JSON."""
    return write_text(path, json.dumps(plain(diagnosis.record()), indent=2, ensure_ascii=False) + "\n")
