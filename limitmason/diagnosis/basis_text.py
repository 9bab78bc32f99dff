"""Words on what a diagnosis rests on: noise shared or unstated, basis, trends."""

from collections.abc import Sequence

from limitmason.diagnosis.outliers import carried_by_outliers, outlier_words
from limitmason.diagnosis.result import Findings


def enumerated(words: Sequence[str]) -> str:
    """Words as a sentence lists them: "a, b and c"."""
    return " and ".join(w for w in (", ".join(words[:-1]), *words[-1:]) if w)


def what_is_shared(diagnosis: Findings) -> list[str]:
    """Sentences on the noise that tests share: which share within which column."""
    shares = diagnosis.shares
    if not shares.estimated:
        return []
    carried = [f"{100 * v:.0f} % of its variance within {k}" for k, v in shares.shares.items()]
    rest = [k for k in shares.estimated if k not in shares.shares]
    text = f"Noise that tests share, estimated and carried: {', '.join(carried)}" if carried else ""
    if rest:
        text += ("; no share worth carrying within " if carried else "No noise shared within ") + ", ".join(rest)
        text += "" if carried else " is found that is worth carrying"
    return [text + "."]


def what_is_unstated(diagnosis: Findings) -> list[str]:
    """An alarm held against noise shared unstated: it stands, or is withheld.

    It is empty where there is none.
    """
    doubt = diagnosis.verdict.doubt
    if doubt is None:
        return []
    missing, cause = enumerated(doubt.unstated), " and ".join(doubt.names)
    shared = f"half of the noise's variance shared by the tests that {cause} acts on"
    then = ", ".join(f"{k} p = {v:.3f}" for k, v in doubt.p.items())
    if doubt.holds:
        return [f"Not recorded: {missing}. The alarm stands with {shared} as well ({then})."]
    return [
        f"Were the noise of all tests independent, this would be an alarm, and {cause} the likeliest of the list. But "
        f"{missing} of the tests are not recorded, and {shared} would do the same ({then}).",
        "Record them, or state shared=() where tests have nothing in common.",
    ]


def basis(diagnosis: Findings) -> list[str]:
    """What the verdict rests on: noise, measured inputs, groups, and twins."""
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
    if diagnosis.counted:
        most, worth = (max(v) for v in zip(*diagnosis.counted.values(), strict=True))
        told = f"{len(diagnosis.counted)} curves of up to {most} points each"
        out.append(f"{told} count as {worth:.1f} independent points a curve (estimated); so many are compared.")
    out += what_is_shared(diagnosis)
    if diagnosis.kind != "none":
        out += what_is_unstated(diagnosis)
    if diagnosis.groups is not None:
        out.append(f"{len(set(diagnosis.groups))} groups of specimens, each left out as a whole for the gain.")
    out += [] if carried_by_outliers(diagnosis) else outlier_words(diagnosis)
    distances = diagnosis.distances
    twins = "; ".join(f"{a} and {b}" for a, b in distances.twins)
    out.append(f"Twins on this design, which no data of it can tell apart: {twins or 'none'}.")
    if distances.invisible:
        out.append(f"Not visible on this design within their bounds: {', '.join(distances.invisible)}.")
    return out


def trend_words(diagnosis: Findings) -> list[str]:
    """The covariate that the baseline's residuals vary with, or empty without one."""
    if not diagnosis.covariate:
        return []
    trend = diagnosis.verdict.trend
    return [f"The residuals of the baseline vary with {diagnosis.covariate} ({trend}); a pointer, not a cause."]
