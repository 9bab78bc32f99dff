"""A diagnosis as text and as rows of a table."""

from typing import TYPE_CHECKING, Any

from limitmason.diagnosis.cause import Cause

if TYPE_CHECKING:
    from limitmason.diagnosis.verdict import Diagnosis


def headline(diagnosis: "Diagnosis") -> str:
    """The verdict in one sentence."""
    kind, names = diagnosis.kind, diagnosis.causes
    if kind == "none":
        return "none: the baseline explains the data"
    if kind == "cause":
        return f"cause: {names[0]} is the only one of the list that the data do not reject"
    if kind == "either":
        return f"either: {', '.join(names[:-1])} or {names[-1]}; these data cannot tell them apart"
    if kind == "two":
        best = " and ".join(names)
        if len(diagnosis.pairs) == 1:
            return f"two: {best} together; no single cause of the list and no other pair is left"
        return f"two: no single cause is left, {len(diagnosis.pairs)} pairs are; best {best}"
    if kind == "scatter":
        return "scatter: the data scatter more than stated and no cause of the list takes part of it away"
    where = f", varies with {diagnosis.covariate}" if diagnosis.covariate else ""
    return f"unexplained{where}: no cause and no pair of the list fits"


def table(diagnosis: "Diagnosis") -> list[dict[str, Any]]:
    """One row per cause of the list and per pair that is kept."""
    verdict = diagnosis.verdict
    rows = []
    by_name = {c.name: c for c in diagnosis.listed}
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


def report(diagnosis: "Diagnosis", checks: bool) -> str:
    """Headline, evidence, estimates, gain, sizes that would have been seen, list, warnings."""
    study, verdict = diagnosis.study, diagnosis.verdict
    first = headline(diagnosis)
    lines = [first[0].upper() + first[1:] + ".", ""]
    lines.append(
        f"{study.n} specimens, noise {study.noise}, seed {diagnosis.seed}. Gate: "
        + ", ".join(f"{k} p = {_p(v)}" for k, v in verdict.p.items())
        + "."
    )
    if diagnosis.covariate:
        lines.append(
            f"The residuals of the baseline vary with {diagnosis.covariate} ({verdict.trend}); a pointer, not a cause."
        )
    if diagnosis.kept:
        lines += ["", "Not rejected (p is that of not being rejected, not of being true):"]
        lines += _kept_lines(diagnosis)
    if diagnosis.kind in ("none", "scatter"):
        lines += ["", "Smallest size that would have been seen nine times in ten:"]
        lines += [f"  {c.name}: {_sizes(c, diagnosis.detectable[c.name])}" for c in diagnosis.listed]
    lines += ["", "The verdict is conditional on this list:"]
    width = max(len(c.name) for c in diagnosis.listed)
    for cause in diagnosis.listed:
        tested = verdict.tested[(cause.name,)]
        state = "kept" if tested.kept else "rejected: " + _why(tested.p, diagnosis.rule) if tested.p else "not tested"
        lines.append(
            f"  {cause.name:<{width}}  size {cause.show(tested.sizes[0])}, log-likelihood {tested.gain:+.2f}, {state}"
        )
    notes = [*diagnosis.warnings, *(_check_lines(diagnosis) if checks else [])]
    if notes:
        lines += ["", "To keep in mind:"] + [f"  - {note}" for note in notes]
    return "\n".join(lines)


def warnings(diagnosis: "Diagnosis") -> tuple[str, ...]:
    """What limits the verdict, from the list, the noise, the tables and the estimates."""
    study, out = diagnosis.study, []
    if all(c.acts_on != "measurement" for c in diagnosis.listed):
        out.append("No measurement cause (offset, gain, batch) is in the list: a sensor's fault can pass as physics.")
    if study.noise.kind == "known":
        out.append("The noise is taken as exactly known; replicates would test it.")
    if study.noise.kind == "unknown":
        out.append("The noise is unknown: more scatter than expected cannot be seen.")
    if not study.covariates:
        out.append("No covariates are recorded: an effect outside the list can only show as scatter.")
    for cause in diagnosis.listed:
        error = study.table(cause).error
        if error > 0.25:
            out.append(f"The table of {cause.name} may be off by {error:.2f} of the noise between its levels.")
        name = cause.name
        if name in diagnosis.estimates and diagnosis.estimates[name].at_bound:
            out.append(f"The size of {name} sits at its bound: the bound, not the data, decides it.")
    if diagnosis.kind in ("cause", "either"):
        out.append("This is the smallest explanation: two effects can pass as a third.")
    if diagnosis.kind == "unexplained" and not diagnosis.covariate:
        out.append("No recorded covariate goes with the misfit.")
    return tuple(out)


def _kept_lines(diagnosis: "Diagnosis") -> list[str]:
    by_name = {c.name: c for c in diagnosis.listed}
    lines = []
    for names in diagnosis.kept[:8]:
        tested = diagnosis.verdict.tested[names]
        parts = []
        for name, size in zip(names, tested.sizes, strict=True):
            cause: Cause = by_name[name]
            interval = diagnosis.estimates.get(name) if names == diagnosis.kept[0] or len(names) == 1 else None
            shown = f"{name} = {cause.show(size)}"
            parts.append(shown + (f" [{cause.show(interval.low)}, {cause.show(interval.high)}]" if interval else ""))
        evidence = ", ".join(f"{k} p = {_p(v)}" for k, v in tested.p.items())
        lines.append(f"  {' and '.join(parts)}; {evidence}")
        physics = "; ".join(f"{by_name[n].physics} ({by_name[n].acts_on})" for n in names if by_name[n].physics)
        if physics:
            lines.append(f"    {physics}")
        lines.append(f"    {diagnosis.gains[names]}")
    if len(diagnosis.kept) > 8:
        lines.append(f"  and {len(diagnosis.kept) - 8} more")
    return lines


def _check_lines(diagnosis: "Diagnosis") -> list[str]:
    checks, out = diagnosis.checks, []
    kind, causes = checks.unknown_noise
    if diagnosis.study.noise.kind != "unknown" and (kind != diagnosis.kind or causes != diagnosis.causes):
        out.append(f"With the noise taken as unknown the verdict is {kind} {', '.join(causes)}".rstrip() + ".")
    for i in checks.hangs_on[:6]:
        kind, causes = checks.dropped[i]
        out.append(f"Without specimen {i} the verdict is {kind} {', '.join(causes)}".rstrip() + ".")
    if len(checks.hangs_on) > 6:
        out.append(f"And without {len(checks.hangs_on) - 6} other single specimens it changes too.")
    return out


def _why(p: dict[str, float], rule) -> str:
    limits = {"deficit": rule.deficit, "shape": rule.kept_shape, "scatter": rule.kept_scatter}
    bad = [f"{k} p = {_p(v)}" for k, v in p.items() if v < limits[k]]
    return ", ".join(bad) or "far behind the best"


def _sizes(cause: Cause, sizes) -> str:
    shown = [
        cause.show(s) if s is not None else f"not within the bound {cause.show(side)}"
        for s, side in zip(sizes, cause.sides, strict=True)
    ]
    return " or ".join(shown)


def _p(value: float) -> str:
    return f"{value:.3f}" if value >= 0.001 else "< 0.001"
