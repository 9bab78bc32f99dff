"""What a diagnosis says, in plain sentences: verdict, meaning, basis, limits.

Thresholds of the verdict are in ``inference.verdict``, those of words in this file.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from limitmason.causes.cause import Cause
from limitmason.diagnosis.basis_text import enumerated, what_is_unstated
from limitmason.diagnosis.inference.discrepancy import CONSTANT, TOGETHER
from limitmason.diagnosis.inference.gain import told_error
from limitmason.diagnosis.inference.rivals import DRIFT
from limitmason.diagnosis.inference.verdict import Identification
from limitmason.diagnosis.outliers import carried_by_outliers, outlier_words
from limitmason.diagnosis.result import Findings

FEW = 5  # causes named in one sentence
OPEN = 0.10  # largest share of sets without the truth, upper end, for a set to be said as closed
FEWEST_ALIKE = 3  # numbers of which a common factor is told
MUCH = 5.0  # of their scatter about a common factor, by which values are off
AGAINST = 2.0  # log-likelihood by which a kind that grows worse speaks against an explanation


def shown_p(value: float) -> str:
    """A p with its sign of comparison."""
    return f"= {value:.3f}" if value >= 0.001 else "< 0.001"


def gate_words(p: Mapping[str, float]) -> str:
    """Tail probabilities by their names."""
    return ", ".join(f"{k} p {shown_p(v)}" for k, v in p.items())


def could_do_the_same(along: str, *, short: bool = False) -> str:
    """What else could do it, by the covariate ``along`` which the nearest bias goes."""
    if along == CONSTANT:
        return "an equal error of all values could do the same" + ("" if short else ", whatever its origin")
    where = "several covariates together" if along == TOGETHER else along
    return f"something else that goes with {where} could do the same"


def shown(diagnosis: Findings) -> str:
    """Names of the one explanation, joined by "and"."""
    record = diagnosis.identification
    return " and ".join(diagnosis.causes or (record.names if record is not None else ()))


def headline(diagnosis: Findings) -> str:
    """The verdict in one sentence."""
    kind, names = diagnosis.kind, diagnosis.causes
    if kind == "none":
        doubt = diagnosis.verdict.doubt
        also = "" if doubt is None else " beside noise that tests may share unstated"
        return f"none: the baseline explains the data{also}"
    if kind == "cause":
        held = diagnosis.identification
        by = enumerated([k.kind for k in held.kinds if k.shows]) if held is not None else ""
        identified = f", and it is identified by {by}" if diagnosis.identified else ""
        return f"cause: {names[0]} is the only one of the list that the data do not reject{identified}"
    if kind == "behaves like":
        together = " together" if diagnosis.pairs else ""
        held = diagnosis.identification
        also = could_do_the_same(held.along if held is not None else CONSTANT, short=True)
        if held is not None and held.missing == ("kinds",):
            also = not_two_kinds(held)
        if held is not None and held.rival == DRIFT and "rival levers" in held.missing:
            also = "a drift from test to test could do the same, and the order of tests is not recorded"
        return f"behaves like {shown(diagnosis)}{together}: it fits, but it is not identified; {also}"
    if kind == "either":
        few = len(names) <= FEW
        first, last = (names[:-1], names[-1]) if few else (names[: FEW - 1], f"one of {len(names) - FEW + 1} others")
        return f"either: {', '.join(first)} or {last}{off_the_list(diagnosis)}; these data cannot tell them apart"
    if kind == "two":
        best = " and ".join(names)
        if len(diagnosis.pairs) == 1:
            return f"two: {best} together; no single cause of the list and no other pair is left"
        return f"two: no single cause is left, {len(diagnosis.pairs)} pairs are; best {best}{off_the_list(diagnosis)}"
    if kind == "scatter":
        return "scatter: the data scatter more than stated, and no cause takes more of that away than chance would"
    where = f", varies with {diagnosis.covariate}" if diagnosis.covariate else ""
    if lever := by_specimen(diagnosis):
        where = f", differs from specimen to specimen as {lever} would"
    if diagnosis.verdict.structured and not diagnosis.causes:
        fits, held = " and ".join(diagnosis.verdict.structured[0]), diagnosis.identification
        why = "leaves structure that noise does not make" if held is None else not_two_kinds(held)
        return f"unexplained{where}: {fits} fits, but {why}"
    if diagnosis.verdict.rivalled:
        return f"unexplained{where}: {rivalled_words(diagnosis)}"
    if diagnosis.verdict.withdrawn:
        return f"unexplained{where}: what fits predicts groups left out worse than the baseline does"
    none = (
        "no cause and no pair of the list fits" if diagnosis.verdict.tried_pairs else "no single cause of the list fits"
    )
    return f"unexplained{where}: {none}{'' if diagnosis.verdict.tried_pairs else ' (pairs not tried)'}"


def by_specimen(diagnosis: Findings) -> str:
    """The lever that differs by specimen where more scatter does not do, or nothing."""
    verdict = diagnosis.verdict
    return "" if verdict.rivalled else verdict.rival.removesuffix(" by specimen")


def rivalled_words(diagnosis: Findings) -> str:
    """The pair that fits, and the one lever with another dependence that does as well."""
    verdict = diagnosis.verdict
    return f"{' and '.join(verdict.rivalled[0])} fit together, but one lever, {verdict.rival}, does nearly as well"


def withdrawn_words(diagnosis: Findings) -> str:
    """The explanations that fit, but fail on groups left out, without a full stop."""
    names = "; ".join(" and ".join(n) for n in diagnosis.verdict.withdrawn)
    return (
        f"{names} is not rejected on all data together, but predicts groups left out worse than the baseline does, and "
        "is not named"
    )


def not_two_kinds(held: Identification) -> str:
    """Which kinds of evidence do not agree, or that there is one only."""
    shown = [k.kind for k in held.kinds if k.shows]
    if absent := [k.kind for k in held.kinds if k.absent]:
        return f"it should show in {enumerated(absent)} and does not"
    if held.alone:
        return "one specimen alone was tested, and what is peculiar to it could change all its values alike"
    if len(shown) > 1:
        return f"the sizes that {enumerated(shown)} ask for do not agree"
    only = f"only {shown[0]} shows it" if shown else "no kind of data shows it by itself"
    return f"{only}, and a name needs two kinds of evidence, or a dose along a measured column of its own"


def off_the_list(diagnosis: Findings) -> str:
    """Clause to append to a set of names: that none of them need be true.

    It is empty where data sets with the true cause taken off the list were tried and the share that ended in a set is
    at most ``OPEN``, by the upper end of its interval.
    """
    found = diagnosis.rehearsal
    if found is not None and found.missing and found.rate("set without it").high <= OPEN:
        return ""
    return ", or something that is not on the list"


def by_kind_words(diagnosis: Findings) -> list[str]:
    """What every kind of data says of the best explanation, or the baseline's miss.

    It is empty for one kind.
    """
    kinds = diagnosis.by_kind
    if len(kinds) < 2:
        return []
    if not diagnosis.kept and diagnosis.identification is None:
        each = [f"{k.kind} {k.misfit:.1f}" for k in kinds]
        worst = max(kinds, key=lambda k: k.misfit).kind
        told = f"{enumerated(each)}; most in {worst}"
        return [f"Misfit of the baseline in units of the noise (1 is noise alone): {told}."]
    parts = [f"{k.share:.2f} +- {k.error:.2f} of the fitted effect" if np.isfinite(k.error) else "none of it is felt"
             for k in kinds]
    each = [f"{k.kind} {k.gain:+.1f}, {t}" for k, t in zip(kinds, parts, strict=True)]
    out = [f"By kind, in log-likelihood and in the share of the effect that it shows: {'; '.join(each)}."]
    best = max(kinds, key=lambda k: k.gain).kind
    against = [k.kind for k in kinds if k.gain < -AGAINST or k.absent]
    return [*out, f"Carried by {best}" + (f"; {enumerated(against)} speaks against it." if against else ".")]


def meaning(diagnosis: Findings) -> list[str]:
    """The verdict in plain sentences: what follows from it and what to do."""
    before = told_error(float(np.sqrt(np.mean(diagnosis.residuals["baseline"] ** 2))))
    if diagnosis.kind == "none":
        return [
            f"The simulation misses the measured values by {before} (root mean square); noise and the measured "
            "inputs account for that.",
            *what_is_unstated(diagnosis),
            "No extension of the model is called for. How large each listed cause could be and stay unseen is given "
            "below; smaller effects may be there.",
        ]
    if diagnosis.kind in ("scatter", "unexplained"):
        return _alarm_without_cause(diagnosis, before)
    return _explanation(diagnosis, before)


def _alarm_without_cause(diagnosis: Findings, before: str) -> list[str]:
    """More scatter than stated, or a misfit that stays and is ``before`` in words."""
    carried = outlier_words(diagnosis) if carried_by_outliers(diagnosis) else []
    if diagnosis.kind == "scatter":
        sd = 100.0 * float(np.sqrt(diagnosis.verdict.null.loss[0] / diagnosis.n) * np.mean(diagnosis.design.scale))
        out = [
            f"The values scatter by {sd:.1f} % about the simulation, more than the noise ({diagnosis.noise}), and "
            f"no listed cause takes more of that away than chance would (p = {diagnosis.verdict.p['guard']:.3f}).",
            *carried,
            *by_kind_words(diagnosis),
        ]
        if diagnosis.verdict.p["gain"] < diagnosis.rule.gain:
            best = max(diagnosis.verdict.tested.values(), key=lambda tested: tested.gain)
            out += [
                f"If the noise is as stated, the simulation is wrong and {best.names[0]} comes nearest; "
                f"{diagnosis.n} numbers cannot tell the two apart."
            ]
        return [*out, "Repeat a few tests to measure the noise before any cause is sought."]
    where, lever = "", by_specimen(diagnosis)
    if diagnosis.covariate:
        where = (f" It goes with {diagnosis.covariate}: what differs between specimens of different "
                 f"{diagnosis.covariate} is the place to look, which need not be that quantity itself.")
    elif lever:
        where = (f" It is no scatter of single values: it differs from specimen to specimen as {lever} would (p "
                 f"{shown_p(diagnosis.verdict.p['lever'])}). Look for what is not recorded.")
    alone = "alone or in pairs" if diagnosis.verdict.tried_pairs else "alone (pairs were not tried)"
    found = f", and nothing on the list, {alone}, removes the misfit"
    if diagnosis.verdict.rivalled:
        found = f", and no cause of the list alone removes the misfit; {rivalled_words(diagnosis)}"
    if diagnosis.verdict.withdrawn:
        found = f". {withdrawn_words(diagnosis)}"
    where += _common_factors(diagnosis)
    misses = f"The simulation misses the measured values by {before}, more than noise allows{found}.{where}"
    return [misses, *carried, *by_kind_words(diagnosis), "The list lacks the cause: extend it and judge again."]


def _common_factors(diagnosis: Findings) -> str:
    """A sentence for each quantity that is off by one factor, about which it scatters little."""
    out, of, log = "", np.array(diagnosis.quantities), diagnosis.design.log
    known = dict.fromkeys(diagnosis.quantities)
    for quantity in known:
        apart = diagnosis.residuals["baseline"][(of == quantity) & (True if log is None else log)]
        if len(apart) < FEWEST_ALIKE or not abs(apart.mean()) > MUCH * apart.std(ddof=1):
            continue
        which = f" of {quantity}" if len(known) > 1 else ""
        out += (f" All values{which} are near {np.exp(apart.mean()):.3g} times the predicted, and scatter by "
                f"{told_error(float(apart.std(ddof=1)))} about that: is a unit, a load or a definition another?")
    return out


def _explanation(diagnosis: Findings, before: str) -> list[str]:
    """What the kept explanations make of the misfit ``before``, and what they rest on."""
    kind, by_name, gain = diagnosis.kind, diagnosis.by_name, diagnosis.gain
    assert gain is not None, "an explanation is kept"
    sizes = [f"{n} = {by_name[n].show(e.size)}" for n, e in diagnosis.estimates.items() if n in gain.names]
    out = [
        f"With {' and '.join(sizes)} the model misses the measured values by {told_error(gain.error_after)} instead of "
        f"{before}, and specimens left out of the fit by {told_error(gain.error_left_out)}."
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
    if diagnosis.verdict.withdrawn:
        out.append(f"{withdrawn_words(diagnosis)}.")
    out += [*by_kind_words(diagnosis), *identification_words(diagnosis)]
    if diagnosis.identified:
        how = " and ".join(
            f"{c.name}.apply(size, ...)" if c.apply is not None else f"simulate(..., {c.parameter}=size)"
            for c in (by_name[n] for n in gain.names)
        )
        out.append(f"The better model: switch on {how}.")
    return out


def identification_words(diagnosis: Findings) -> list[str]:
    """Why a cause is identified, or what is missing and which test would identify it.

    It is empty where none is alone.
    """
    record = diagnosis.identification
    if record is None:
        return []
    name = shown(diagnosis)
    nearest = (
        "an equal error of all values" if record.along == CONSTANT
        else "a smooth dependence on several covariates" if record.along == TOGETHER
        else f"a smooth dependence on {record.along}"
    )
    beats = (
        f"{name} beats the nearest model discrepancy, {nearest}, by {record.excess:.1f} in log-likelihood; "
        f"{record.margin:.1f} is asked on this design"
    )
    dose = (
        f"along the contrast that only it makes the data show {record.slope:.2f} +- {record.slope_error:.2f} of the "
        "fitted effect (1 is all of it, 0 none)"
    )
    ahead = f"values left out are predicted by {record.ahead:+.1f} +- {record.ahead_error:.1f} better in log score"
    if record.holds:
        return [f"Identified: {beats}; {dose}; {ahead}."]
    said = {
        "lever": f"this design hardly varies what only {name} acts through: were it true, it would be identified in "
        f"{100 * record.chance:.0f} of 100 data sets",
        "excess": beats,
        "dose": dose,
        "usual": f"it beats the nearest model discrepancy by {record.excess:.1f}, were it true one would "
        f"expect {record.expected:.1f} (chance of so little: {record.p:.3f})",
        "left out": ahead,
        "rival levers": f"{record.rival} does as well (log-likelihood {record.rival_excess:+.1f} over it)",
        "kinds": not_two_kinds(record),
    }
    missing = "; ".join(said[m] for m in record.missing)
    also = f"but {could_do_the_same(record.along)}"
    if record.missing == ("kinds",):
        also = "and no smooth trend does as well"
    out = [
        f"Not identified. It fits, {also}; no cause on the list need be the true one. What is missing: {missing}."
        if diagnosis.kept
        else f"{name} fits, but {not_two_kinds(record)}: it is rejected."
    ]
    return [*out, identifying_test(diagnosis, record)] if diagnosis.kept else out


def identifying_test(diagnosis: Findings, record: Identification) -> str:
    """Sentence on the tests that would identify the one explanation, from its ``record``."""
    by_name = diagnosis.by_name
    alone = [f"{n}: {by_name[n].isolate}" for n in diagnosis.causes if by_name[n].isolate]
    if record.along == CONSTANT:
        vary = "tests in which the effect would differ from one specimen to the other"
    elif record.along == TOGETHER:
        vary = "tests in which the effect would differ between specimens that are alike in all that is recorded"
    else:
        vary = f"tests in which the effect would differ between specimens of one {record.along}"
    other = ["a second kind of data on the same specimens"] * (len(record.kinds) < 2)
    tests = [*alone, *other, f"{vary} (next_tests chooses from a pool)"]
    return f"What would identify it: {'; or '.join(tests)}."


def if_it_were_missing(diagnosis: Findings) -> str:
    """How often a name would be given to an effect off the list, or empty."""
    found = diagnosis.rehearsal
    if found is not None and found.missing:
        rate, low, high = found.rate("wrong name")
        sets, _, most = found.rate("set without it")
        return (
            f"If the true cause were missing from this list, one of these names would be given in {100 * rate:.0f} of "
            f"100 data sets on this design (rehearsed {found.n} times by the whole rule; 95 % interval "
            f"{100 * low:.0f} to {100 * high:.0f}), and a set of them, none of them true, in {100 * sets:.0f} (at most "
            f"{100 * most:.0f}): a set is therefore said {'as closed' if most <= OPEN else 'to be open'}."
        )
    quick = diagnosis.verdict.rehearsed
    if quick is None:
        return ""
    if not quick.trials:
        return (
            "How often this name would be given to another effect is not known: with one cause on the list none can be "
            "left out. Extend it."
        )
    before = 100 * quick.fitted / quick.trials
    return (
        f"If the true cause were missing from this list, one of these names would be given in {100 * quick.rate:.0f} "
        f"of 100 data sets on this design ({before:.0f} if it were enough to fit alone; rehearsed quickly on "
        f"{quick.trials} data sets with a listed cause taken off, which sets the margin)."
    )


def seen_from(cause: Cause, sizes: Sequence[float | None]) -> str:
    """Smallest sizes that would have been seen, per side of the baseline."""
    shown = [
        cause.show(s) if s is not None else f"not within the bound {cause.show(side)}"
        for s, side in zip(sizes, cause.sides, strict=True)
    ]
    return " or ".join(shown)
