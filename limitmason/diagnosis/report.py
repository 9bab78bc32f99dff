"""A diagnosis as text and as rows of a table."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from limitmason.causes.cause import Cause
from limitmason.diagnosis.inference.checks import LIKE, Checks
from limitmason.diagnosis.inference.design import is_numeric
from limitmason.diagnosis.inference.discrepancy import CONSTANT
from limitmason.diagnosis.inference.shared import PLAUSIBLE
from limitmason.diagnosis.result import Diagnosis
from limitmason.diagnosis.words import (
    as_one_kind,
    behind_the_name,
    could_do_the_same,
    enumerated,
    if_it_were_missing,
    one_word,
    physics_of,
    shown,
    what_is_shared,
    what_is_unrecorded,
)

FEW = 5  # causes named in one sentence
COLLINEAR = 0.9  # correlation at which two covariates cannot be held apart


def headline(diagnosis: Diagnosis) -> str:
    """The verdict in one sentence."""
    kind, names = diagnosis.kind, diagnosis.causes
    if kind == "none":
        doubt = diagnosis.verdict.doubt
        also = "" if doubt is None else " beside noise that tests may share unrecorded"
        return f"none: the baseline explains the data{also}"
    if kind == "cause":
        earned = ", and the name is earned" if diagnosis.named else ""
        return f"cause: {names[0]} is the only one of the list that the data do not reject{earned}"
    if kind == "behaves like":
        together = " together" if diagnosis.pairs else ""
        along = diagnosis.earned.along if diagnosis.earned is not None else CONSTANT
        also = could_do_the_same(along, short=True)
        return f"behaves like {shown(diagnosis)}{together}: it fits, but the name is not earned; {also}"
    if kind == "either":
        few = len(names) <= FEW
        first, last = (names[:-1], names[-1]) if few else (names[: FEW - 1], f"one of {len(names) - FEW + 1} others")
        return f"either: {', '.join(first)} or {last}; these data cannot tell them apart"
    if kind == "two":
        best = " and ".join(names)
        if len(diagnosis.pairs) == 1:
            return f"two: {best} together; no single cause of the list and no other pair is left"
        return f"two: no single cause is left, {len(diagnosis.pairs)} pairs are; best {best}"
    if kind == "scatter":
        return "scatter: the data scatter more than stated and no cause of the list takes part of it away"
    where = f", varies with {diagnosis.covariate}" if diagnosis.covariate else ""
    if diagnosis.verdict.structured and not diagnosis.causes:
        fits = " and ".join(diagnosis.verdict.structured[0])
        return f"unexplained{where}: {fits} fits, but leaves structure that noise does not make"
    if diagnosis.verdict.withdrawn:
        return f"unexplained{where}: what fits predicts groups left out worse than the baseline does"
    none = (
        "no cause and no pair of the list fits" if diagnosis.verdict.tried_pairs else "no single cause of the list fits"
    )
    return f"unexplained{where}: {none}{'' if diagnosis.verdict.tried_pairs else ' (pairs not tried)'}"


def meaning(diagnosis: Diagnosis) -> list[str]:
    """The verdict in plain sentences: what follows from it and what to do."""
    kind, by_name = diagnosis.kind, diagnosis.by_name
    before = 100.0 * float(np.sqrt(np.mean(diagnosis.residuals["baseline"] ** 2)))
    if kind == "none":
        return [
            f"The simulation misses the measured values by {before:.1f} % (root mean square); noise and the measured "
            "inputs account for that.",
            *what_is_unrecorded(diagnosis),
            "No extension of the model is called for. How large each listed cause could be and stay unseen is given "
            "below; smaller effects may be there.",
        ]
    if kind == "scatter":
        sd = 100.0 * float(np.sqrt(diagnosis.verdict.null.loss[0] / diagnosis.n) * np.mean(diagnosis.design.scale))
        return [
            f"The values scatter by {sd:.1f} % about the simulation where a noise of {diagnosis.noise} was stated, and "
            "no listed cause takes part of it away.",
            "Repeat a few tests to measure the noise before any cause is sought.",
        ]
    if kind == "unexplained":
        where = (
            f" It goes with {diagnosis.covariate}: what differs between specimens of different {diagnosis.covariate} "
            "is the place to look, which need not be that quantity itself."
            if diagnosis.covariate
            else ""
        )
        alone = "alone or in pairs" if diagnosis.verdict.tried_pairs else "alone (pairs were not tried)"
        told = [" and ".join(n) for n in diagnosis.verdict.withdrawn]
        return [
            f"The simulation misses the measured values by {before:.1f} %, more than noise allows, and nothing on the "
            f"list, {alone}, removes the misfit.{where}"
            if not told
            else f"The simulation misses the measured values by {before:.1f} %, more than noise allows. "
            f"{'; '.join(told)} is not rejected on all data together, but predicts groups left out worse than the "
            f"baseline does, and is not named.{where}",
            "The list lacks the cause: extend it and judge again.",
        ]
    gain = diagnosis.gain
    sizes = [f"{n} = {by_name[n].show(e.size)}" for n, e in diagnosis.estimates.items() if n in gain.names]
    out = [
        f"With {' and '.join(sizes)} the model misses the measured values by {100 * gain.error_after:.1f} % instead of "
        f"{before:.1f} %, and specimens left out of the fit by {100 * gain.error_left_out:.1f} %."
    ]
    if kind == "either":
        out.append(
            "The other causes named do as well within the noise: their sizes are alternatives, not a sum. More tests, "
            "chosen to tell them apart, decide; more of the same do not."
        )
    elif diagnosis.pairs:
        out.append(
            "No single cause of the list is enough; the two act together."
            if len(diagnosis.pairs) == 1
            else "No single cause of the list is enough, and several pairs do as well as the best: which, is open."
        )
    if diagnosis.verdict.structured:
        fits = " and ".join(diagnosis.verdict.structured[0])
        out.append(f"{fits} alone is not rejected by the size of the misfit, but leaves structure, and is withdrawn.")
    out += behind_the_name(diagnosis)
    switched = [by_name[n] for n in gain.names]
    how = " and ".join(
        f"{c.name}.apply(size, ...)" if c.apply is not None else f"simulate(..., {c.parameter}=size)" for c in switched
    )
    out.append(f"The better model: switch on {how}.")
    return out


def basis(diagnosis: Diagnosis) -> list[str]:
    """What the verdict rests on: noise, measured inputs with their refit, groups, and twins on this design."""
    verdict = diagnosis.verdict
    noise = f"Noise of the measured values: {diagnosis.noise}"
    if diagnosis.noise_sd is not None:
        noise += (
            f" (estimated from the {'best fit' if diagnosis.kept else 'baseline'}: {100 * diagnosis.noise_sd:.2g} %)"
        )
    out = [noise + "."]
    fitted = verdict.tested[diagnosis.kept[0]].z if diagnosis.kept else None
    for name, z in zip(diagnosis.redrawn, fitted or [None] * len(diagnosis.redrawn), strict=True):
        given = diagnosis.nuisance[name]
        text = f"Measured input {name}: {given.value:.4g} +- {given.sd:.2g}"
        out.append(text + (f", refitted to {given.at(z):.4g} ({z:+.1f} sd)." if z is not None else "."))
    out += [
        f"Measured input {n}: {v.value:.4g}, taken as exact."
        for n, v in diagnosis.nuisance.items()
        if n not in diagnosis.redrawn
    ]
    out += what_is_shared(diagnosis)
    if diagnosis.kind != "none":
        out += what_is_unrecorded(diagnosis)
    if diagnosis.groups is not None:
        out.append(f"{len(set(diagnosis.groups))} groups of specimens, each left out as a whole for the gain.")
    distances = diagnosis.distances
    twins = "; ".join(f"{a} and {b}" for a, b in distances.twins)
    out.append(f"Twins on this design, which no data of it can tell apart: {twins or 'none'}.")
    if distances.invisible:
        out.append(f"Not visible on this design within their bounds: {', '.join(distances.invisible)}.")
    return out


def table(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """One row per cause of the list and per pair that is kept."""
    verdict = diagnosis.verdict
    rows, by_name = [], diagnosis.by_name
    shown = [(c.name,) for c in diagnosis.listed] + [n for n in diagnosis.pairs if len(n) == 2]
    for names in shown:
        tested = verdict.tested[names]
        intervals = [diagnosis.estimates[n] for n in names if tested.kept and n in diagnosis.estimates]
        single = by_name[names[0]] if len(names) == 1 else None
        rows.append(
            {
                "cause": " + ".join(names),
                "acts_on": single.acts_on if single else "",
                "unit": " + ".join(by_name[n].unit for n in names),
                "kept": tested.kept,
                "earned": diagnosis.earned.holds if diagnosis.earned and diagnosis.earned.names == names else None,
                "size": tested.sizes,
                "interval": tuple((e.low, e.high) for e in intervals),
                "gain": tested.gain,
                "deficit": tested.deficit,
                **{f"p_{k}": tested.p.get(k) for k in ("deficit", "shape", "scatter")},
                "draws": tested.draws,
                "detectable": diagnosis.detectable[names[0]] if single else (),
                "left_out": diagnosis.gains[names].leave_one_out.total if names in diagnosis.gains else None,
            }
        )
    return rows


def report(diagnosis: Diagnosis, checks: Checks | None = None) -> str:
    """Headline, evidence, estimates, gain, sizes that would have been seen, list, warnings.

    Parameters
    ----------
    checks : from :func:`~limitmason.diagnosis.result.Diagnosis.judged_again`; None leaves out what the verdict hangs on
    """
    verdict = diagnosis.verdict
    first = headline(diagnosis)
    lines = [first[0].upper() + first[1:] + ".", "", *meaning(diagnosis), ""]
    lines.append(
        f"{diagnosis.n} specimens, seed {diagnosis.seed}, at most {diagnosis.rule.draws} draws. Gate: "
        f"{gate_words(verdict.p)}."
    )
    lines += [*basis(diagnosis), *trend_words(diagnosis)]
    if diagnosis.kept:
        lines += [
            "",
            "Not rejected (each p is the chance of a worse misfit under that cause, not the chance that it is true):",
        ]
        lines += _kept_lines(diagnosis)
    if diagnosis.kind in ("none", "scatter"):
        told = f" ({enumerated(diagnosis.unrecorded)} are not recorded, which makes them larger)"
        seen = f"Smallest size that would have been seen nine times in ten{told if diagnosis.unrecorded else ''}:"
        lines += ["", seen]
        lines += [f"  {c.name}: {seen_from(c, diagnosis.detectable[c.name])}" for c in diagnosis.listed]
    lines += ["", "The verdict is conditional on this list:"]
    width = max(len(c.name) for c in diagnosis.listed)
    for cause in diagnosis.listed:
        tested = verdict.tested[(cause.name,)]
        state = state_of(diagnosis, (cause.name,))
        size = f"size {cause.show(tested.sizes[0])} within {cause.bounds[0]:g} to {cause.bounds[1]:g}"
        lines.append(f"  {cause.name:<{width}}  {size}, log-likelihood {tested.gain:+.2f}, {state}")
    lines += filter(None, [if_it_were_missing(diagnosis)])
    notes = [*warnings(diagnosis), *(check_lines(diagnosis, checks) if checks is not None else [])]
    if notes:
        lines += ["", "To keep in mind:"] + [f"  - {note}" for note in notes]
    return "\n".join(lines)


def warnings(diagnosis: Diagnosis) -> tuple[str, ...]:
    """What limits the verdict, from the list, the noise, the tables and the estimates."""
    out = [f"Set aside, for it cannot be computed: {name} ({reason})." for name, reason in diagnosis.aside.items()]
    if diagnosis.covariate:
        out += _collinear(diagnosis.covariates, diagnosis.covariate)
    if diagnosis.groups is None and _repeats(diagnosis.covariates):
        out.append(
            "Some specimens repeat a configuration (same covariates) and no groups are given: leaving out one repeat "
            "says nothing about geometry. Give groups."
        )
    if all(c.acts_on != "measurement" for c in diagnosis.listed):
        out.append("No measurement cause (offset, gain, batch) is in the list: a sensor's fault can pass as physics.")
    if diagnosis.noise.kind == "known":
        out.append(
            "The noise is taken as exactly known; replicates would test it (Noise(sd, dof), or Noise.from_replicates). "
            "Stated as 4 % where it is 5 %, about a third of clean data sets raise an alarm."
        )
    if diagnosis.noise.kind == "unknown":
        out.append("The noise is unknown: more scatter than expected cannot be seen.")
    if not diagnosis.covariates:
        out.append("No covariates are recorded: an effect outside the list can only show as scatter.")
    for cause in diagnosis.listed:
        error = diagnosis.table_errors[cause.name]
        if error > 0.25:
            out.append(f"The table of {cause.name} may be off by {error:.2f} of the noise between its levels.")
        name = cause.name
        if name in diagnosis.estimates and diagnosis.estimates[name].at_bound:
            out.append(f"The size of {name} sits at its bound: the bound, not the data, decides it.")
    if diagnosis.kind in ("cause", "behaves like", "either", "two"):
        out.append("This is the smallest explanation: two effects can pass as a third, three as two.")
    if diagnosis.kind == "unexplained" and not diagnosis.covariate:
        out.append("No recorded covariate goes with the misfit.")
    return tuple(out)


def _kept_lines(diagnosis: Diagnosis) -> list[str]:
    lines = []
    for names in diagnosis.kept[:8]:
        evidence = gate_words(diagnosis.verdict.tested[names].p)
        lines.append(f"  {' and '.join(diagnosis.sized(names))}; {evidence}")
        physics = physics_of([diagnosis.by_name[n] for n in names])
        if physics:
            lines.append(f"    {physics}")
        lines.append(f"    {diagnosis.gains[names]}")
    if len(diagnosis.kept) > 8:
        lines.append(f"  and {len(diagnosis.kept) - 8} more")
    return lines


def check_lines(diagnosis: Diagnosis, checks: Checks) -> list[str]:
    """What the verdict hangs on: the same data under other statements of the noise and without single specimens."""
    out: list[str] = []

    def says(answer: tuple[str, tuple[str, ...]]) -> str:
        return one_word(*answer)

    same = (as_one_kind(diagnosis), set(diagnosis.causes))
    if diagnosis.noise.kind != "unknown":
        if (checks.unknown_noise[0], set(checks.unknown_noise[1])) != same:
            out.append(
                f"Stated and unknown noise disagree: with the noise taken as unknown the verdict is "
                f"{says(checks.unknown_noise)}."
            )
        else:
            out.append("With the noise taken as unknown the verdict is the same.")
    if checks.student is not None and (checks.student[0], set(checks.student[1])) != same:
        out.append(
            f"With Student errors, which forgive blunders (Noise(sd, tails=4)), the verdict is {says(checks.student)}."
        )
    for column, answer in checks.shared.items():
        where = "groups of like specimens" if column == LIKE else column
        what = f"With {100 * PLAUSIBLE:.0f} % of the noise's variance shared within {where} (assumed: not estimated)"
        told = "is the same" if (answer[0], set(answer[1])) == same else f"is {says(answer)}"
        out.append(f"{what} the verdict, before a name is earned, {told}.")
    for i in checks.hangs_on[:6]:
        out.append(f"The verdict hangs on {diagnosis.specimens[i]}: without it, it is {says(checks.dropped[i])}.")
    if len(checks.hangs_on) > 6:
        out.append(f"And without {len(checks.hangs_on) - 6} other single specimens it changes too.")
    if not checks.hangs_on:
        out.append(
            "No single specimen decides: left out one at a time, none turns the verdict into another kind or into "
            "other causes (a set may grow or shrink)."
        )
    return out


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


def state_of(diagnosis: Diagnosis, names: tuple[str, ...]) -> str:
    """Whether an explanation was kept, why it was rejected, or that there was no need to test it."""
    tested = diagnosis.verdict.tested[names]
    if tested.kept:
        return "kept"
    return "rejected: " + _why(tested.p, diagnosis.rule) if tested.p else "not tested"


def _why(p: Mapping[str, float], rule) -> str:
    limits = {"deficit": rule.deficit, "shape": rule.kept_shape, "scatter": rule.kept_scatter}
    return gate_words({k: v for k, v in p.items() if v < limits[k]}) or "far behind the best"


def seen_from(cause: Cause, sizes: Sequence[float | None]) -> str:
    """Smallest sizes that would have been seen, per side of the baseline."""
    shown = [
        cause.show(s) if s is not None else f"not within the bound {cause.show(side)}"
        for s, side in zip(sizes, cause.sides, strict=True)
    ]
    return " or ".join(shown)


def trend_words(diagnosis: Diagnosis) -> list[str]:
    """The covariate that the residuals of the baseline vary with; empty where there is none."""
    if not diagnosis.covariate:
        return []
    trend = diagnosis.verdict.trend
    return [f"The residuals of the baseline vary with {diagnosis.covariate} ({trend}); a pointer, not a cause."]


def gate_words(p: Mapping[str, float]) -> str:
    """Tail probabilities by their names."""
    return ", ".join(f"{k} p {shown_p(v)}" for k, v in p.items())


def shown_p(value: float) -> str:
    """A p with its sign of comparison."""
    return f"= {value:.3f}" if value >= 0.001 else "< 0.001"
