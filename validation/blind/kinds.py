"""Trials with several kinds of evidence: ``python -m validation.blind.kinds --sets 100 --out kinds.md``.

Twelve specimens of ``campaigns.py`` with peak (limit analysis), stiffness (rigid blocks on elastic joints) and first
frequency. Effects off the list are those of ``outsiders.py``, built unit by unit without the catalogue, and two more:
friction that is lower in one direction, and an instrument that reads low in one set-up. Truth and candidates are of one
code; effects are interpolated between their sizes. Seeds are fixed here, before any run.
"""

import argparse
import time
from collections import Counter
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np

import limitmason as lm
from limitmason import causes as catalogue
from limitmason.causes import declare, elastic_displacements
from limitmason.diagnosis import Observation, Study
from limitmason.diagnosis.inference.plan import distances
from limitmason.diagnosis.rehearse import binomial_interval
from limitmason.diagnosis.simulate import SLOW, several
from limitmason.vibration import ModalTest

from . import campaigns, outsiders

SEED = 20261124
KN, RATIO = 2e9, 0.4  # joints' stiffness [Pa/m], assumed
SCATTER = {"peak": 0.05, "stiffness": 0.05, "frequency 1": 0.01}
SPECIMENS = campaigns.specimens("12")
VISIBLE = 36.0  # d2 from the baseline


def on_springs(model, loads):
    """The model whose joints have a stiffness."""
    return model.with_joints(lambda j: replace(j, normal_stiffness=KN, shear_stiffness=RATIO * KN)), loads


def build(s, friction_coefficient=campaigns.FRICTION):
    """A specimen on elastic joints."""
    return on_springs(*campaigns.build(s, friction_coefficient))


def stiffness(assembly, loads):
    """Sum of the live forces over the displacement that they do work on [N/m]."""
    live = np.asarray(loads.live)
    kn = assembly.interfaces[0].joint.normal_stiffness
    moved, _ = elastic_displacements(assembly, live, normal_stiffness=kn, shear_ratio=RATIO, head_joints=True)
    return float(np.linalg.norm(live[:, :3].sum(axis=0)) ** 2 / (live * moved).sum())


@declare(
    "softer joints", parameter="softer", lever="stiffness", baseline=1.0, bounds=(0.3, 2.5),
    physics="all joints have size times their stiffness",
)  # fmt: skip
def softer_joints(size, assembly, loads):
    """Stiffness of all joints times the size [-]."""
    def soft(joint):
        return replace(joint, normal_stiffness=size * KN, shear_stiffness=size * RATIO * KN)

    return assembly.with_joints(soft), loads


ANSWERS = {"peak": "limit", "stiffness": stiffness, "frequency 1": "modes"}
CAUSES = (*campaigns.CAUSES, softer_joints())
simulate = several(build, ANSWERS)


def batch_friction(s, friction, size):
    """Friction times the size in the specimens that are pushed in plane."""
    return campaigns.build(s, friction * (size if s["setup"] == "in plane" else 1.0))


def reads_low(size, value, s):
    """The load cell of one set-up reads low."""
    return value * (size if s["setup"] == "strip" else 1.0)


MORE = (
    outsiders.Effect("friction in one direction", "in plane only", (0.8, 0.65, 0.5), batch_friction),
    outsiders.Effect("instrument of one set-up", "reads low", (0.94, 0.88, 0.8), read=reads_low),
)
EFFECTS = (*outsiders.EFFECTS, *MORE)
FORCES = ("peak", "stiffness")


def with_effect(effect, size):
    """Quantities of every specimen with an effect off the list."""
    out = []
    for s in SPECIMENS:
        if effect.change is not None:
            model = on_springs(*effect.change(s, campaigns.FRICTION, size))
            found = several(lambda _, model=model: model, ANSWERS)(s)
        else:
            found = dict(simulate(s).quantities)
            found |= {q: effect.read(size, found[q], s) for q in FORCES}
        out.append(found)
    return out


def rows(found, quantities, rng=None):
    """Observations of what was found, shaken where a generator is given."""
    return [
        Observation(i, q, f[q] * (np.exp(SCATTER[q] * rng.standard_normal()) if rng is not None else 1.0), SCATTER[q])
        for i, f in enumerate(found) for q in quantities
    ]  # fmt: skip


def study_of(quantities, covariates, cache):
    """The study, with tables to come."""
    found = [simulate(s) for s in SPECIMENS]
    return Study(
        SPECIMENS, simulate, rows(found, quantities), nuisance=campaigns.NUISANCE, covariates=covariates, causes=CAUSES,
        cache=cache, version="1", shared=(), **SLOW,
    )  # fmt: skip


class Trials:
    """Planted data sets of one design.

    Parameters
    ----------
    quantities : that are measured
    covariates : that are recorded
    """

    def __init__(self, quantities, covariates, cache):
        self.study, self.quantities = study_of(quantities, covariates, cache), quantities
        self.design, self.curves = self.study.design(), {}
        for effect in EFFECTS:
            zero = [simulate(s) for s in SPECIMENS]
            self.curves[effect.name] = [zero, *(with_effect(effect, size) for size in effect.sizes)]

    def off_the_list(self, k, rng, kinds=1):
        """Values with an effect off the list, as large as it takes to be visible, or its largest."""
        effect = EFFECTS[k % len(EFFECTS)]
        nodes = np.log([[f[q] for f in found for q in self.quantities] for found in self.curves[effect.name]])
        place = rng.uniform(1.0, len(nodes) - 1.0)
        low = min(int(place), len(nodes) - 2)
        return np.exp(nodes[low] + (place - low) * (nodes[low + 1] - nodes[low])), effect.name

    def listed(self, k, rng, kinds=1):
        """Values with a listed cause, 36 and more in d2 from the baseline and its nearest rival; None if not."""
        names = [c.name for c in CAUSES]
        cause = CAUSES[k % len(CAUSES)]
        grid = self.design.singles[cause.name]
        sizes = grid.sizes[0]
        size = rng.uniform(sizes[0], sizes[-1])
        y = grid.at_size(float(np.interp(size, sizes, np.arange(len(sizes))))).between(grid.zero)
        rivals = [float(distances(y, self.design.singles[n])[0]) for n in names if n != cause.name]
        felt = sum(
            float((y[[q == want for q in self.study.rows.quantities]] ** 2).sum()) >= 16.0 for want in self.quantities
        )
        if distances(y, self.design.null)[0] < VISIBLE or min(rivals) < VISIBLE or felt < kinds:
            return None
        return np.exp(self.design.origin + self.design.scale * y), cause.name

    def two(self, k, rng, kinds=1):
        """Values with a cause in the model that peaks feel, and softer joints, neither of which does for both."""
        inside = [c for c in CAUSES if c.lever not in ("reading", "stiffness")]
        names = (inside[k % len(inside)].name, softer_joints().name)
        null, effects = self.design.null.between(self.design.null.zero), []
        for name in names:
            grid = self.design.singles[name]
            size = rng.uniform(grid.sizes[0][0], grid.sizes[0][-1])
            effects.append(grid.at_size(float(np.interp(size, grid.sizes[0], np.arange(len(grid.sizes[0]))))).between(
                grid.zero) - null)  # fmt: skip
        y = null + sum(effects)
        alone = [float(distances(y, self.design.singles[c.name])[0]) for c in CAUSES]
        return None if min(alone) < VISIBLE else (np.exp(self.design.origin + self.design.scale * y), names)

    def nothing(self, k, rng, kinds=1):
        """Values of the baseline."""
        return self.study.baseline(), None

    def judged(self, values, rng, rule=None):
        """Verdict on values after noise and an error of the measured friction."""
        shaken = values * np.exp(self.study.scale * rng.standard_normal(len(values)))
        return self.study.with_measured(shaken).diagnose(seed=int(rng.integers(1 << 31)), draws=699, rule=rule)


# ---- one monument: which joint is loose? -----------------------------------------------------------------------------

TOWER, COUNT = (1.2, 1.0, 0.75), 8  # width, depth, height of a course [m], and courses; assumed
PLACES = [((x, y, z), d) for z in (2.0, 4.0, 5.9) for x, y in ((0.1, 0.1), (1.1, 0.9)) for d in "xy"]
ROUGH = {"frequency": 0.01, "component": 0.03}


def tower(specimen=None, joint=None, factor=1.0):
    """A tower of blocks, one joint of which has another stiffness; built without the catalogue."""
    law = lm.Joint(35.0, normal_stiffness=KN, shear_stiffness=RATIO * KN)
    width, depth, height = TOWER
    made = lm.build.column(width=width, depth=depth, unit_height=height, courses=COUNT, joint=law)
    weak = replace(law, normal_stiffness=factor * KN, shear_stiffness=factor * RATIO * KN)
    laid = [replace(i, joint=weak) if k == joint else i for k, i in enumerate(made.interfaces)]
    return made.with_interfaces(laid), lm.Loads.weight(made)


HEALTHY, WEIGHT = tower()
JOINTS = (*catalogue.each_joint(HEALTHY), catalogue.joint_stiffness(), catalogue.block_density())


@cache
def modes_of(steps):
    """Modes of the tower with causes switched on."""
    model = HEALTHY, WEIGHT
    for cause, size in steps:
        model = cause.apply(size, *model)
    return lm.modes(model[0], 9)


def monument(specimen, *, extend=None):
    """What the tower's modes predict of those measured."""
    return specimen["modal test"].predicted(modes_of(() if extend is None else extend.steps))


def measured_modes(model, chosen, count, rng=None):
    """Frequencies and shapes at some sensors, shaken where a generator is given."""
    sensors = [PLACES[k] for k in chosen]
    found = lm.modes(model, count + 1)
    shape = found.at([p for p, _ in sensors])[:, np.arange(len(sensors)), ["xyz".index(d) for _, d in sensors]]
    largest = np.abs(shape).max(axis=1)
    seen = np.flatnonzero(largest > 0.1 * largest.max())[:count]  # level sensors see nothing of the vertical mode
    shape, frequency, count = shape[seen] / largest[seen, None], found.frequency[seen], len(seen)
    if rng is not None:
        frequency = frequency * np.exp(ROUGH["frequency"] * rng.standard_normal(count))
        shape = shape + ROUGH["component"] * rng.standard_normal(shape.shape)
    return ModalTest(sensors, frequency, shape)


def monument_trial(label, sets, seed, judged=False):
    """Outcomes of "which joint is loose?", by 3 to 6 modes at 6 to 12 sensors; or the verdicts themselves."""
    counts, k, done, verdicts = Counter(), 0, 0, []
    while done < sets and k < 40 * sets:
        rng = np.random.default_rng([SEED, seed, k])
        k += 1
        chosen = np.sort(rng.choice(len(PLACES), rng.integers(6, 13), replace=False))
        count, joint, factor = int(rng.integers(3, 7)), int(rng.integers(COUNT)), float(np.exp(rng.uniform(-3.0, -0.2)))
        model, name = HEALTHY, None
        if label != "healthy":
            model, _ = tower(joint=joint, factor=factor)
            name = f"loose joint {HEALTHY.joint_names[joint]}"
            true = measured_modes(model, chosen, count)
            seen, sound = true.quantities, true.predicted(modes_of(()))
            apart = [np.log(seen[q] / sound[q]) / ROUGH["frequency"] if q.startswith("frequency")
                     else (seen[q] - sound[q]) / ROUGH["component"] for q in seen]  # fmt: skip
            if float(np.square(apart).sum()) < VISIBLE:
                continue
        test = measured_modes(model, chosen, count, rng)
        made = Study(
            [{"modal test": test}], monument, Observation.of_modes(0, test, **ROUGH), causes=JOINTS, shared=(), levels=9
        )
        verdicts.append(made.diagnose(seed=k, draws=699, pairs=False))
        counts[outcome(verdicts[-1], name)] += 1
        done += 1
    return verdicts if judged else counts


# ---- crack pattern alone ---------------------------------------------------------------------------------------------

MISREAD = 0.1
DRAWN = tuple(s for s in campaigns.SPECIMENS if s["setup"] in ("in plane", "slides"))
MOVING = tuple(c for c in CAUSES if c.lever not in ("reading", "stiffness"))


def pattern(specimen, *, extend=None, **inputs):
    """What each joint does in the mechanism of limit analysis."""
    model = campaigns.build(specimen, **inputs)
    found = lm.predict(*(model if extend is None else extend(*model)), method="limit").quantities
    return {q: v for q, v in found.items() if "|" in q}


class Patterns(Trials):
    """Planted patterns of opened and slid joints."""

    def __init__(self, covariates, cache):
        plain = [pattern(s) for s in DRAWN]
        self.quantities = ("pattern",)
        self.study = Study(
            DRAWN, pattern, [Observation(i, q, v, MISREAD) for i, f in enumerate(plain) for q, v in f.items()],
            nuisance=campaigns.NUISANCE, covariates=covariates, causes=MOVING, cache=cache, version="1", shared=(),
            **SLOW,
        )  # fmt: skip
        self.design = self.study.design()

    def listed(self, k, rng, kinds=1):
        """What joints do with a listed cause of a random size; None where it is not visible."""
        cause = self.study.causes[k % len(self.study.causes)]
        size = cause.baseline + rng.uniform(0.2, 1.0) * (cause.sides[k % len(cause.sides)] - cause.baseline)
        values = self.study.predicted([cause], [size])
        y = self.design.whiten(values) - self.design.null.between(self.design.null.zero)
        return None if float(y @ y) < VISIBLE else (values, cause.name)

    def judged(self, values, rng, rule=None):
        """Verdict on a pattern of which some joints are misread."""
        seen = np.where(rng.random(len(values)) < MISREAD, 1.0 - values, values)
        return self.study.with_measured((seen - MISREAD) / (1.0 - 2.0 * MISREAD)).diagnose(
            seed=int(rng.integers(1 << 31)), draws=699, pairs=False, rule=rule
        )


def outcome(found, name):
    """What is said when a cause (None for one that no list holds) was planted."""
    right = name in found.causes or (isinstance(name, tuple) and any(set(name) == set(p) for p in found.pairs))
    if found.kind in ("none", "scatter", "unexplained"):
        return str(found.kind)
    if found.identified:
        return "identified" if right else "identified wrongly"
    if found.pairs:
        return "pair with it" if right else "pair without it"
    if found.kind == "behaves like":
        return "behaves like it" if right else "behaves like another"
    return "set with it" if right else "set without it"


CLASSES = {"nothing": "nothing", "clear": "listed", "two causes": "two", "off the list": "off_the_list"}


def trial(trials, label, sets, seed):
    """Outcomes of one class on one design."""
    counts, by_effect = Counter(), {}
    plant = getattr(trials, CLASSES[label])
    k = done = 0
    while done < sets and k < 40 * sets:
        rng = np.random.default_rng([SEED, seed, k])
        made = plant(k, rng, kinds=min(2, len(trials.quantities)))
        k += 1
        if made is None:
            continue
        said = outcome(trials.judged(made[0], rng), made[1])
        counts[said] += 1
        planted = " and ".join(made[1]) if isinstance(made[1], tuple) else made[1] or "nothing"
        by_effect.setdefault(planted, Counter())[said] += 1
        done += 1
    return counts, by_effect


ASKED = {
    "nothing": "alarms 5 % at most", "clear": "identified 90 %, wrong 1 % at most", "healthy": "alarms 5 % at most",
    "two causes": "both in the answer 80 %", "off the list": "identified wrongly 5 % at most",
    "one joint": "in the set 90 %, alone 70 %, wrong 3 % at most",
}  # fmt: skip


def rows_of_trials(cache):
    """What is tried, by name: the maker of the trials, or a function of the number of sets."""
    every, three = campaigns.COVARIATES, tuple(SCATTER)
    plain, more = ("nothing", "clear", "off the list"), ("nothing", "clear", "two causes", "off the list")
    return {
        "three kinds, all recorded": (more, lambda: Trials(three, every, cache)),
        "three kinds, nothing recorded": (more, lambda: Trials(three, (), cache)),
        "peaks alone, all recorded": (plain, lambda: Trials(("peak",), every, cache)),
        "peaks alone, nothing recorded": (plain, lambda: Trials(("peak",), (), cache)),
        "crack pattern alone": (("nothing", "clear"), lambda: Patterns((), cache)),
        "one monument": (("healthy", "one joint"), lambda: monument_trial),
    }


def main():
    """Run the trials and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=300)
    parser.add_argument("--cache", type=Path, default=None)
    parser.add_argument("--row", action="append", help="only these of the rows, by a part of their name")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    begin, lines = time.process_time(), []  # intervals are 90 %, so that one end is a one-sided 95 % bound
    for i, (name, (labels, make)) in enumerate(rows_of_trials(given.cache).items()):
        if given.row and not any(part in name for part in given.row):
            continue
        trials = make()
        for j, label in enumerate(labels):
            seed = 10 * i + j
            made = trials(label, given.sets, seed) if callable(trials) else trial(trials, label, given.sets, seed)
            counts, each = made if isinstance(made, tuple) else (made, {})
            total = sum(counts.values())
            share = partial(binomial_interval, n=total, level=0.9)
            told = "; ".join(
                f"{k} {v} ({100 * v / total:.0f} %, {100 * share(v)[0]:.0f} to {100 * share(v)[1]:.0f})"
                for k, v in counts.most_common()
            )
            lines.append(f"- **{name}, {label}** ({total}; asked: {ASKED[label]}): {told}")
            print(lines[-1], flush=True)
            wrong = {e: c["identified wrongly"] for e, c in each.items() if c["identified wrongly"]}
            if wrong:
                lines.append(f"  identified wrongly: {', '.join(f'{e} {n} of {sum(each[e].values())}' for e, n in wrong.items())}")  # noqa: E501
            spent = time.process_time() - begin
            given.out.write_text(f"seed {SEED}, {spent:.0f} processor seconds\n\n" + "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
