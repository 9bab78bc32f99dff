"""What stands behind a name, or is missing for it, in plain sentences."""

from collections.abc import Sequence

from limitmason.causes.cause import Cause
from limitmason.diagnosis.inference.discrepancy import CONSTANT, TOGETHER
from limitmason.diagnosis.inference.verdict import VerdictKind
from limitmason.diagnosis.result import Diagnosis


def enumerated(words: Sequence[str]) -> str:
    """Words as a sentence lists them: "a, b and c"."""
    return " and ".join(w for w in (", ".join(words[:-1]), *words[-1:]) if w)


def could_do_the_same(along: str, *, short: bool = False) -> str:
    """What else could do it, by the covariate of the nearest nameless bias."""
    if along == CONSTANT:
        return "an equal error of all values could do the same" + ("" if short else ", whatever its origin")
    where = "several covariates together" if along == TOGETHER else along
    return f"something else that goes with {where} could do the same"


def shown(diagnosis: Diagnosis) -> str:
    """The one explanation in words."""
    return " and ".join(diagnosis.causes)


def behind_the_name(diagnosis: Diagnosis) -> list[str]:
    """Why a name is earned, or what is missing for it and which test would earn it; empty where no name is at stake."""
    record = diagnosis.earned
    if record is None:
        return []
    name = shown(diagnosis)
    nearest = (
        "an equal error of all values" if record.along == CONSTANT
        else "a smooth dependence on several covariates" if record.along == TOGETHER
        else f"a smooth dependence on {record.along}"
    )  # fmt: skip
    beats = (
        f"{name} beats the nearest explanation without a name, {nearest}, by {record.excess:.1f} in log-likelihood; "
        f"{record.margin:.1f} is asked on this design"
    )
    dose = (
        f"along the contrast that only it makes the data show {record.slope:.2f} +- {record.slope_error:.2f} of the "
        "fitted effect (1 is all of it, 0 none)"
    )
    ahead = f"values left out are predicted by {record.ahead:+.1f} +- {record.ahead_error:.1f} better in log score"
    if record.holds:
        return [f"The name is earned: {beats}; {dose}; {ahead}."]
    said = {
        "lever": f"this design hardly varies what only {name} acts through: were it true, the name would be earned in "
        f"{100 * record.chance:.0f} of 100 data sets",
        "excess": beats,
        "dose": dose,
        "usual": f"it beats the nearest explanation without a name by {record.excess:.1f}, were it true one would "
        f"expect {record.expected:.1f} (chance of so little: {record.p:.3f})",
        "left out": ahead,
    }
    missing = "; ".join(said[m] for m in record.missing)
    out = [
        f"The name is not earned. It fits, but {could_do_the_same(record.along)}; no cause on the list need be the "
        f"true one. What is missing: {missing}."
    ]
    return [*out, earning_test(diagnosis)]


def earning_test(diagnosis: Diagnosis) -> str:
    """The test that would earn the name."""
    record, by_name = diagnosis.earned, diagnosis.by_name
    alone = [f"{n}: {by_name[n].isolate}" for n in diagnosis.causes if by_name[n].isolate]
    if record is None or record.along == CONSTANT:
        vary = "tests in which the effect would differ from one specimen to the other"
    elif record.along == TOGETHER:
        vary = "tests in which the effect would differ between specimens that are alike in all that is recorded"
    else:
        vary = f"tests in which the effect would differ between specimens of one {record.along}"
    return "What would earn it: " + "; or ".join([*alone, f"{vary} (next_tests chooses from a pool)"]) + "."


def if_it_were_missing(diagnosis: Diagnosis) -> str:
    """How often a name of the list would be given to an effect that is not on it; empty where that is not known."""
    found = diagnosis.rehearsal
    if found is not None and found.missing:
        rate, low, high = found.rate("wrong name")
        return (
            f"If the true cause were missing from this list, one of these names would be given in {100 * rate:.0f} of "
            f"100 data sets on this design (rehearsed {found.n} times by the whole rule; 95 % interval "
            f"{100 * low:.0f} to {100 * high:.0f})."
        )
    quick = diagnosis.verdict.rehearsed
    if quick is None:
        return ""
    if not quick.trials:
        return (
            "How often this name would be given to another effect is not known: with one cause on the list none can be "
            "left out. Extend it."
        )
    before = 100 * quick.unearned / quick.trials
    return (
        f"If the true cause were missing from this list, one of these names would be given in {100 * quick.rate:.0f} "
        f"of 100 data sets on this design ({before:.0f} if names need not be earned; rehearsed quickly on "
        f"{quick.trials} data sets with a listed cause taken off, which sets the margin)."
    )


def what_is_shared(diagnosis: Diagnosis) -> list[str]:
    """Shares of the noise that are carried."""
    shares = diagnosis.shares
    if not shares.looked_at:
        return []
    carried = [f"{100 * v:.0f} % of its variance within {k}" for k, v in shares.shares.items()]
    rest = [k for k in shares.looked_at if k not in shares.shares]
    text = f"Noise that tests share, estimated and carried: {', '.join(carried)}" if carried else ""
    if rest:
        text += ("; no share worth carrying within " if carried else "No noise shared within ") + ", ".join(rest)
        text += "" if carried else " is found that is worth carrying"
    return [text + "."]


def what_is_unrecorded(diagnosis: Diagnosis) -> list[str]:
    """An alarm held against noise that tests share unrecorded: it stands, or is withheld; empty where there is none."""
    doubt = diagnosis.verdict.doubt
    if doubt is None:
        return []
    missing, cause = enumerated(doubt.unrecorded), " and ".join(doubt.names)
    shared = f"half of the noise's variance shared by the tests that {cause} acts on"
    then = ", ".join(f"{k} p = {v:.3f}" for k, v in doubt.p.items())
    if doubt.holds:
        return [f"Not recorded: {missing}. The alarm stands with {shared} as well ({then})."]
    return [
        f"Were the noise of all tests independent, this would be an alarm, and {cause} the likeliest of the list. But "
        f"{missing} of the tests are not recorded, and {shared} would do the same ({then}).",
        "Record them, or state shared=() where tests have nothing in common.",
    ]


def one_word(kind: str, causes: tuple[str, ...]) -> str:
    """An answer in few words."""
    return f"{kind} {', '.join(causes)}".rstrip()


def as_one_kind(diagnosis: Diagnosis) -> str:
    """The kind, with "behaves like" as what would be said if names need not be earned."""
    if diagnosis.kind != VerdictKind.BEHAVES_LIKE:
        return str(diagnosis.kind)
    return str(VerdictKind.TWO if diagnosis.pairs else VerdictKind.CAUSE)


def physics_of(causes: list[Cause]) -> str:
    """The physics of causes in one line."""
    return "; ".join(f"{c.physics} ({c.acts_on})" for c in causes if c.physics)
