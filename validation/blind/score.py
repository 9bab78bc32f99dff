"""Scores verdicts against what was hidden, after the fact, and holds the counts against the acceptance table."""

from collections import Counter, defaultdict
from dataclasses import dataclass, field

from limitmason.diagnosis import binomial_interval

OUTCOMES = (
    "none", "named", "set with it", "wrong name", "set without it", "pair", "pair set with it", "wrong pair",
    "unexplained", "unexplained, right covariate", "scatter",
)
NAMES = ("named", "wrong name")


def outcome(kind, causes, pairs, covariate, truth):
    """Which of ``OUTCOMES`` a verdict is.

    A planted pair counts as a pair when it is the only one kept, as a set when it is one of several; one of the two
    named alone is wrong.
    """
    hidden = set(truth.names)
    if kind in ("none", "scatter"):
        return kind
    if kind == "unexplained":
        return "unexplained, right covariate" if truth.covariate and covariate == truth.covariate else "unexplained"
    if kind == "two":
        if len(hidden) != 2 or hidden not in [set(p) for p in pairs]:
            return "wrong pair"
        return "pair" if len(pairs) == 1 else "pair set with it"
    if kind == "cause":
        return "named" if hidden == set(causes) else "wrong name"
    return "set with it" if hidden and hidden <= set(causes) else "set without it"


@dataclass
class Sheet:
    """Counts of outcomes by class."""

    counts: dict = field(default_factory=lambda: defaultdict(Counter))

    def add(self, label, result):
        """Count one trial."""
        self.counts[label][result] += 1

    def trials(self, label):
        """Number of trials of a class."""
        return sum(self.counts[label].values())

    def rate(self, label, *outcomes):
        """Share of outcomes in a class and its 95 % interval."""
        k, n = sum(self.counts[label][o] for o in outcomes), self.trials(label)
        return (k / n if n else float("nan"), *binomial_interval(k, n))

    def text(self):
        """All counts, one class a line."""
        width = max(map(len, self.counts), default=5)
        head = f"| {'class':<{width}} | trials | " + " | ".join(OUTCOMES) + " |"
        lines = [head, "|" + "---|" * (len(OUTCOMES) + 2)]
        for label, row in self.counts.items():
            if not row:
                continue
            cells = " | ".join(str(row[o] or ".") for o in OUTCOMES)
            lines.append(f"| {label:<{width}} | {self.trials(label)} | {cells} |")
        return "\n".join(lines)


def requirements(sheet):
    """The acceptance table: what is required, what was counted, whether it holds; only classes with trials."""
    table = [
        ("null", "alarms <= 7 %", tuple(o for o in OUTCOMES if o != "none"), "<=", 0.07),
        ("null", "single names <= 1 %", NAMES, "<=", 0.01),
        ("clear", "named >= 95 %", ("named",), ">=", 0.95),
        ("clear", "wrong <= 1 %", ("wrong name", "wrong pair", "set without it"), "<=", 0.01),
        ("middle", "named >= 80 %", ("named",), ">=", 0.80),
        ("middle", "named or set with it >= 95 %", ("named", "set with it"), ">=", 0.95),
        ("middle", "wrong <= 3 %", ("wrong name", "wrong pair", "set without it"), "<=", 0.03),
        ("twins", "set >= 90 %", ("set with it",), ">=", 0.90),
        ("twins", "named <= 5 %", NAMES, "<=", 0.05),
        ("unlisted", "right covariate >= 90 %", ("unexplained, right covariate",), ">=", 0.90),
        ("unlisted", "named <= 3 %", (*NAMES, "pair", "wrong pair"), "<=", 0.03),
        ("scatter", "named <= 5 %", (*NAMES, "pair", "wrong pair"), "<=", 0.05),
        ("pair", "pair >= 45 %", ("pair", "pair set with it"), ">=", 0.45),
        ("pair", "pair alone >= 45 %", ("pair",), ">=", 0.45),
        ("pair", "wrong <= 15 %", ("wrong name", "wrong pair", "set without it", "set with it"), "<=", 0.15),
    ]
    out = []
    for label, text, outcomes, sense, bound in table:
        if sheet.trials(label):
            rate, low, high = sheet.rate(label, *outcomes)
            out.append((label, text, rate, low, high, rate <= bound if sense == "<=" else rate >= bound))
    return out


def best_fit(diagnosis):
    """A broken rule: always names the cause that fits best."""
    tested = diagnosis.verdict.tested
    names = min((n for n in tested if len(n) == 1), key=lambda n: tested[n].deficit)
    return "cause", names, (), None


def abstain(diagnosis):
    """A broken rule: never names anything."""
    del diagnosis
    return "none", (), (), None


def ours(diagnosis):
    """The rule itself."""
    return diagnosis.kind, diagnosis.causes, diagnosis.pairs, diagnosis.covariate
