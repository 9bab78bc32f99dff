"""The part of `report.md` on earned names: counts beside what is asked, broken rules, and the two nameless rivals."""

from collections import Counter, defaultdict
from datetime import UTC, datetime

import numpy as np

from limitmason.diagnosis import binomial_interval
from limitmason.diagnosis.inference.verdict import BEYOND_FIT

from . import campaign_store, campaigns, earned_trials
from .earned_trials import OUTCOMES
from .outsiders import EFFECTS

BEGIN, END = "<!-- earned names: begin -->", "<!-- earned names: end -->"
WRONG = ("wrong name", "wrong pair named")
RIGHT = ("named", "behaves like it", "set with it")
ALARMS = tuple(o for o in OUTCOMES if o != "none")
ASKED = (
    ("missing, of the list", "wrong named <= 10 %", WRONG, "<=", 0.10),
    ("missing, never listed", "wrong named <= 10 %", WRONG, "<=", 0.10),
    ("outsiders", "wrong named <= 10 %", WRONG, "<=", 0.10),
    ("clear", "named >= 90 %", ("named",), ">=", 0.90),
    ("clear", "named or behaves like >= 98 %", ("named", "behaves like it"), ">=", 0.98),
    ("clear", "wrong <= 1 %", WRONG, "<=", 0.01),
    ("near a rival", "named, behaves like or in the set >= 95 %", RIGHT, ">=", 0.95),
    ("near a rival", "wrong <= 2 %", WRONG, "<=", 0.02),
    ("near the baseline", "wrong <= 2 %", WRONG, "<=", 0.02),
    ("two listed", "wrong single name <= 10 %", ("wrong name",), "<=", 0.10),
    ("listed and outside", "wrong single name <= 10 %", ("wrong name",), "<=", 0.10),
    ("nothing", "alarms <= 5 %", ALARMS, "<=", 0.05),
    *((f"nothing, noise shared within {c}, recorded", "alarms <= 5 %", ALARMS, "<=", 0.05)
      for c in ("batch", "day", "setup")),
    *((f"nothing, noise shared within {c}, not recorded", "alarms <= 8 %", ALARMS, "<=", 0.08)
      for c in ("batch", "day", "setup")),
    *((f"nothing, noise shared within {c}, not recorded", "names <= 8 %", WRONG, "<=", 0.08)
      for c in ("batch", "day", "setup")),
    ("nothing, truth by the DEM", "alarms <= 7 %", ALARMS, "<=", 0.07),
    ("outsiders, truth by the DEM", "wrong named <= 10 %", WRONG, "<=", 0.10),
)


def sheet(records, judge=None):
    """Counts of outcomes by class; ``judge`` turns a record into another outcome."""
    out = defaultdict(Counter)
    for r in records:
        out[r["class"]][judge(r) if judge else r["outcome"]] += 1
    return out


def requirements(counts):
    """Class, what is asked, share, interval, trials and whether it holds, for classes with trials."""
    rows = []
    for label, asked, outcomes, sense, bound in ASKED:
        n = sum(counts[label].values())
        if n:
            k = sum(counts[label][o] for o in outcomes)
            rate = k / n
            holds = rate <= bound if sense == "<=" else rate >= bound
            rows.append((label, asked, rate, *binomial_interval(k, n), n, holds))
    return rows


def always_named(record):
    """A broken rule: whatever fits alone is named."""
    turned = {"behaves like it": "named", "behaves like another": "wrong pair named" if record.get("pair")
              else "wrong name"}
    return turned.get(record["outcome"], record["outcome"])


def never_named(record):
    """A broken rule: everything only behaves like something."""
    turned = {"named": "behaves like it", "wrong name": "behaves like another",
              "wrong pair named": "behaves like another"}
    return turned.get(record["outcome"], record["outcome"])


def without_margin(record):
    """A broken rule: a name need only beat the model discrepancy, by nothing."""
    if "excess" not in record:
        return record["outcome"]
    left = set(record["missing"]) - {"lever", "excess", *BEYOND_FIT}
    return always_named(record) if not left and record["excess"] >= 0.0 else never_named(record)


BROKEN = {"always named": always_named, "always behaves like": never_named, "no rehearsed margin": without_margin}


def rivals(records, key):
    """Share of wrong names where a threshold on an excess keeps 95 of 100 clear listed causes that fit alone.

    Without the batch shift, which is held against all but its own column by the rule, and by the surfaces is not.
    """
    clear = [r[key] for r in records if r["class"] == "clear" and key in r and r["right"]
             and r["truth"] != "shift of batch B"]
    wrong = [r for r in records if r["class"] in ("missing, of the list", "missing, never listed", "outsiders")]
    if not clear or not wrong:
        return float("nan"), float("nan"), 0
    limit = float(np.quantile(clear, 0.05))
    named = sum(key in r and not r["pair"] and r[key] >= limit and r["said"] != "shift of batch B" for r in wrong)
    return limit, named / len(wrong), len(wrong)


def text(records, seed, seconds):
    """The part of the report as markdown."""
    counts = sheet(records)
    lines = [
        BEGIN,
        "## Names that are earned",
        "",
        f"{datetime.now(UTC).date()}, seed {seed} (fixed before the run), {len(records)} data sets, "
        f"{seconds:.0f} processor seconds. Written by `python -m validation.blind.earned`. Truth: collapse multipliers "
        "of assemblies built box by box (`campaigns.py`), by limit analysis and, on the campaign of 12, by the DEM. "
        "Campaigns of "
        f"{', '.join(earned_trials.DESIGNS)} specimens, {len(campaigns.CAUSES)} causes, noise "
        f"{100 * campaigns.NOISE:.0f} %, friction {campaigns.FRICTION} +- {campaigns.FRICTION_ERROR}.",
        "",
        "| class | asked | measured | 95 % interval | data sets | |",
        "|---|---|---|---|---|---|",
    ]
    for label, asked, rate, low, high, n, holds in requirements(counts):
        state = "holds" if holds else "**falls short**"
        interval = f"{100 * low:.1f} to {100 * high:.1f} %"
        lines.append(f"| {label} | {asked} | {100 * rate:.1f} % | {interval} | {n} | {state} |")
    lines += [*_detection(counts, records, seed), "", "By campaign:", "", *_by_design(records), "", "All outcomes:", "",
              "| class | data sets | " + " | ".join(OUTCOMES) + " |",
              "|---|---|" + "---|" * len(OUTCOMES)]
    for label in sorted(counts):
        cells = " | ".join(str(counts[label][o] or ".") for o in OUTCOMES)
        lines.append(f"| {label} | {sum(counts[label].values())} | {cells} |")
    lines += ["", "Effects outside the list: how often each was given a name, of the data sets with it.", "",
              "| effect | data sets | wrong name | behaves like | set | unexplained, scatter | none |",
              "|---|---|---|---|---|---|---|"]
    per = defaultdict(Counter)
    for r in records:
        if r["class"] == "outsiders" or r["class"].startswith("missing, never"):
            per[r["truth"]][r["outcome"]] += 1
    for name, row in sorted(per.items()):
        shares = (sum(row[o] for o in WRONG), row["behaves like another"], row["set without it"],
                  row["unexplained"] + row["scatter"], row["none"])
        lines.append(f"| {name} | {sum(row.values())} | {' | '.join(str(v or '.') for v in shares)} |")
    lines += ["", "Broken rules on the same data sets:", ""]
    for name, judge in BROKEN.items():
        failed = [f"{a}: {b}" for a, b, *_, holds in requirements(sheet(records, judge)) if not holds]
        lines.append(f"- {name}: fails {len(failed)} ({'; '.join(failed)})")
    ignored = {c: v for c, v in counts.items() if c.endswith("not carried")}
    rates = [f"{c}: {100 * (1 - v['none'] / sum(v.values())):.0f} %" for c, v in sorted(ignored.items())]
    lines.append(f"- groups ignored: alarms {'; '.join(rates)}")
    lines += ["", *_untold(counts)]
    process, surface = rivals(records, "excess"), rivals(records, "surface")
    lines += [
        "",
        "Nameless rival: a threshold that keeps 95 of 100 clear listed causes leaves wrong names to "
        f"{100 * process[1]:.1f} % of {process[2]} data sets with effects outside the list by Gaussian processes "
        f"(the rule), to {100 * surface[1]:.1f} % by low-order surfaces with BIC (`surface.py`); "
        "the batch shift left out.",
        "",
        "How the classes are drawn: d2 after refitting rival and friction, at the mean friction. Clear: 36 and more "
        "from the baseline, from every listed rival, and from every line, parabola or step along one recorded "
        "covariate (lever varied; that along its own batch does not count against a batch shift). Near a rival: 9 to "
        "36 from the "
        "nearest, 36 and more from the baseline. Missing: the hidden cause is taken off the list of 13; never listed: "
        f"{', '.join(c.name for c in campaigns.NEVER_LISTED)}. Outsiders: {'; '.join(e.name for e in EFFECTS)}. "
        f"Effects outside the list have d2 {earned_trials.VISIBLE:.0f} to {earned_trials.MOST:.0f} from the baseline. "
        f"Shared noise: {100 * earned_trials.SHARED:.0f} % of its variance within the labels. Recorded: the study is "
        "told to estimate that share; not recorded: it knows no such column and is told nothing (`shared=None`), but "
        "the list keeps the shift of batch B; not carried: it is told that noise is independent (`shared=()`). "
        "Friction of the truth: one "
        f"standard deviation below or above the measured one, between the levels of the tables "
        f"({campaign_store.TABLES['nuisance_levels']} of them).",
        END,
    ]
    return "\n".join(lines) + "\n"


def _detection(counts, records, seed):
    """Detection near the baseline beside the exact test's power at the same alarm rate, per campaign and together."""
    label = "near the baseline"
    found = total = exact = tried = 0
    nulls = [r["outcome"] for r in records if r["class"] == "nothing"]
    alarms = max(sum(o != "none" for o in nulls), 1) / max(len(nulls), 1)
    for design in earned_trials.DESIGNS:
        own = [r["outcome"] for r in records if r["class"] == label and r["design"] == design]
        if not own or not nulls:
            continue
        k, n = earned_trials.exact_power(design, alarms, [seed, 99], 600)
        found, total = found + sum(o != "none" for o in own), total + len(own)
        exact, tried = exact + k * len(own) / n, tried + len(own)
    if not total:
        return []
    rate, power = found / total, exact / tried
    low, high = binomial_interval(found, total)
    state = "holds" if rate >= power - 0.05 else "**falls short**"
    return [
        f"| {label} | detection within 5 points of the exact test's {100 * power:.1f} % at {100 * alarms:.1f} % alarms "
        f"| {100 * rate:.1f} % | {100 * low:.1f} to {100 * high:.1f} % | {total} | {state} |"
    ]


def _untold(counts):
    """What it costs that the batches are not recorded, where nothing is shared within them."""
    out = []
    asked = (("near the baseline", "detected", ALARMS), ("clear", "named or behaves like it", RIGHT[:2]))
    for kind, found, ok in asked:
        rates = [_share(sum(counts[c][o] for o in ok), sum(counts[c].values()))
                 for c in (kind, f"{kind}, batch not recorded")]
        out.append(f"{kind}, {found}: {rates[1]} where the batch is not recorded, {rates[0]} where it is")
    return [f"Cost of a circumstance that is not recorded, independent noise: {'; '.join(out)}."]


def _by_design(records):
    """The main shares per campaign."""
    lines = ["| campaign | missing or outside: wrong named | clear: named | clear: data sets | nothing: alarms |",
             "|---|---|---|---|---|"]
    for design in earned_trials.DESIGNS:
        mine = [r for r in records if r["design"] == design and not r["class"].endswith("DEM")]
        out = [r for r in mine if r["class"] == "outsiders" or r["class"].startswith("missing")]
        clear = [r for r in mine if r["class"] == "clear"]
        null = [r for r in mine if r["class"] == "nothing"]
        cells = [
            _share(sum(r["outcome"] in WRONG for r in out), len(out)),
            _share(sum(r["outcome"] == "named" for r in clear), len(clear)), str(len(clear)),
            _share(sum(r["outcome"] != "none" for r in null), len(null)),
        ]
        lines.append(f"| {design} | {' | '.join(cells)} |")
    return lines


def _share(k, n):
    return f"{100 * k / n:.1f} % of {n}" if n else "no such truth"
