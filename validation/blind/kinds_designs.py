"""Designs of the trials with several kinds of evidence: what is planted, and how it is judged; see ``kinds.py``.

Specimens of ``campaigns.py`` with peak (limit analysis), stiffness (rigid blocks on elastic joints) and first
frequency. Effects off the list are those of ``outsiders.py``, built unit by unit without the catalogue, and two more:
friction that is lower in one direction, and an instrument that reads low in one set-up. Truth and candidates are of one
code but for the peaks by the DEM; effects are interpolated between their sizes.
"""

from dataclasses import replace
from functools import cache

import numpy as np

import limitmason as lm
from limitmason import causes as catalogue
from limitmason.causes import declare, elastic_displacements
from limitmason.diagnosis import Observation, Study
from limitmason.diagnosis.inference.next_tests import distances
from limitmason.diagnosis.simulate import SLOW, several
from limitmason.vibration import ModalTest

from . import campaign_store, campaigns, outsiders

KN, RATIO = 2e9, 0.4  # joints' stiffness [Pa/m], assumed
SCATTER = {"peak": 0.05, "stiffness": 0.05, "frequency 1": 0.01}
TWELVE = campaigns.specimens("12")
FOUR = tuple(TWELVE[i] for i in (1, 5, 8, 11))  # one of each set-up
VISIBLE = 36.0  # d2 from the baseline
DRAWS = 699  # most bootstrap draws of a verdict


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
)
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


def with_effect(effect, size, specimens=TWELVE):
    """Quantities of every specimen with an effect off the list."""
    out = []
    for s in specimens:
        if effect.change is not None:
            model = on_springs(*effect.change(s, campaigns.FRICTION, size))
            found = several(lambda _, model=model: model, ANSWERS)(s)
        else:
            found = dict(simulate(s).quantities)
            found |= {q: effect.read(size, found[q], s) for q in FORCES}
        out.append(found)
    return out


def rows(found, quantities, scatter=SCATTER):
    """Observations of what was found; a specimen may lack a quantity."""
    known = [getattr(f, "quantities", f) for f in found]
    return [Observation(i, q, f[q], scatter[q]) for i, f in enumerate(known) for q in quantities if q in f]


class Trials:
    """Planted data sets of specimens with several quantities.

    Parameters
    ----------
    covariates : that are recorded
    cache : of predictions
    specimens, quantities : that are measured
    together : column within which tests share half the variance of each quantity's noise, stated as independent
    """

    causes, scatter, simulate, levels = CAUSES, SCATTER, staticmethod(simulate), SLOW["levels"]

    def __init__(self, covariates, cache, specimens=TWELVE, quantities=tuple(SCATTER), together=None):
        self.specimens, self.quantities, self.together = specimens, quantities, together
        found = rows([self.simulate(s) for s in specimens], quantities, self.scatter)
        self.study = Study(
            specimens, self.simulate, found, nuisance=campaigns.NUISANCE, covariates=covariates,
            causes=self.causes, cache=cache, version="1", shared=None if together else (),
            **{**SLOW, "levels": self.levels},
        )
        self.design, self.drawn = self.study.design(), self.study.scale
        self._curves = {}
        self.felt = np.array([[q == want for q in self.study.rows.quantities] for want in quantities])
        kinds = self.study.rows.kinds
        self.of_kind = np.array([[k == want for k in kinds] for want in dict.fromkeys(kinds)])

    def nothing(self, k, rng):
        """Values of the baseline."""
        return self.study.baseline(), None

    def curve(self, effect):
        """Quantities without an effect off the list, and with it at each of its sizes."""
        if effect not in self._curves:
            self._curves[effect] = [[simulate(s) for s in self.specimens],
                                    *(with_effect(effect, size, self.specimens) for size in effect.sizes)]
        return self._curves[effect]

    def off_the_list(self, k, rng):
        """Values with an effect off the list, of a size between the smallest that is visible and its largest."""
        effect = EFFECTS[k % len(EFFECTS)]
        nodes = np.log([[f[q] for f in found for q in self.quantities] for found in self.curve(effect)])
        place = rng.uniform(1.0, len(nodes) - 1.0)
        low = min(int(place), len(nodes) - 2)
        return np.exp(nodes[low] + (place - low) * (nodes[low + 1] - nodes[low])), effect.name

    def at_size(self, cause, size):
        """Whitened values with a cause, by the tables."""
        grid = self.design.singles[cause.name]
        return grid.at_size(float(np.interp(size, grid.sizes[0], np.arange(len(grid.sizes[0]))))).between(grid.zero)

    def is_clear(self, y, cause):
        """Whether d2 is 36 and more from the baseline and the nearest rival, and two kinds of data feel it."""
        rivals = [float(distances(y, self.design.singles[c.name])[0]) for c in self.causes if c.name != cause.name]
        felt = sum(float((y[rows] ** 2).sum()) >= 16.0 for rows in self.of_kind)
        return distances(y, self.design.null)[0] >= VISIBLE and min(rivals) >= VISIBLE and felt >= 2

    def listed(self, k, rng):
        """Values with a listed cause that is clear; None if it is not."""
        cause = self.causes[k % len(self.causes)]
        sizes = self.design.singles[cause.name].sizes[0]
        y = self.at_size(cause, rng.uniform(sizes[0], sizes[-1]))
        return (self.values(y), cause.name) if self.is_clear(y, cause) else None

    def two(self, k, rng):
        """Values with a cause in the model that peaks feel, and softer joints, neither of which does for both."""
        inside = [c for c in self.causes if c.lever not in ("reading", "stiffness")]
        both = (inside[k % len(inside)], softer_joints())
        null = self.design.null.between(self.design.null.zero)
        ends = [self.design.singles[c.name].sizes[0][[0, -1]] for c in both]
        y = null + sum(self.at_size(c, rng.uniform(*end)) - null for c, end in zip(both, ends, strict=True))
        alone = [float(distances(y, self.design.singles[c.name])[0]) for c in self.causes]
        return None if min(alone) < VISIBLE else (self.values(y), tuple(c.name for c in both))

    def values(self, y):
        """Values of whitened differences from the baseline."""
        return np.exp(self.design.origin + self.design.scale * y)

    def seen(self, values):
        """Squared distance of values from the baseline, inputs refitted."""
        return float(distances(self.design.whiten(values), self.design.null)[0])

    def judged(self, values, rng, causes=None):
        """Verdict on values after noise and an error of the measured friction; causes of the list, None for all."""
        noise = rng.standard_normal(self.study.n)
        if self.together:
            where = zip(self.study.rows.of, self.study.rows.quantities, strict=True)
            labels = [f"{self.specimens[i][self.together]} {q}" for i, q in where]
            each = np.unique(labels, return_inverse=True)[1]
            noise = np.sqrt(0.5) * (noise + rng.standard_normal(each.max() + 1)[each])
        moved = self.design.null.slopes @ rng.standard_normal(self.design.inputs)
        shaken = values * np.exp(self.drawn * noise + self.study.scale * moved)
        return self.study.replace(measured=shaken).diagnose(causes, seed=int(rng.integers(1 << 31)), draws=DRAWS)


class PeaksAlone(Trials):
    """The data sets of all kinds, of which the peaks are shown only."""

    def __init__(self, covariates, cache):
        super().__init__(covariates, cache, quantities=("peak",))
        self.whole = Trials(covariates, cache)

    def listed(self, k, rng):
        """Peaks with a cause that is clear by all kinds."""
        made = self.whole.listed(k, rng)
        return made and (made[0][self.whole.felt[0]], made[1])


class OtherCode(Trials):
    """Peaks of the truth by the DEM, at the sizes of its store; stiffness and frequency as before."""

    def __init__(self, covariates, cache):
        super().__init__(covariates, cache)
        self.dem = campaign_store.Simulator(campaign_store.DEM, campaign_store.read())

    def with_peaks(self, values, peaks):
        """Values with other peaks."""
        out = values.copy()
        out[self.felt[0]] = peaks
        return out

    def nothing(self, k, rng):
        """Values of the baseline."""
        return self.with_peaks(self.study.baseline(), [self.dem(s) for s in self.specimens]), None

    def off_the_list(self, k, rng):
        """Values with an effect of the outsider's that changes the model, at its middle size."""
        effects = [e for e in outsiders.EFFECTS if e.change is not None]
        effect = effects[k % len(effects)]
        found = self.curve(effect)[2]
        peaks = [self.dem.effect(effect.name, effect.sizes[1], int(s["name"]) - 1, campaigns.FRICTION)
                 for s in self.specimens]
        return self.with_peaks(np.array([f[q] for f in found for q in self.quantities]), peaks), effect.name

    def listed(self, k, rng):
        """Values with a cause of the model that is clear, at a stored size."""
        cause = campaigns.SIMULATED[k % len(campaigns.SIMULATED)]
        size = float(rng.choice(campaign_store.planted_sizes(cause)))
        there = catalogue.Extension(((cause, size),))
        values = self.with_peaks(
            self.study.predicted([cause], [size]), [self.dem(s, extend=there) for s in self.specimens]
        )
        return (values, cause.name) if self.is_clear(self.design.whiten(values), cause) else None


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


class Monument:
    """Which joint is loose? By 3 to 6 modes at 6 to 12 sensors."""

    def nothing(self, k, rng):
        """Modes of the healthy tower."""
        return self._drawn(rng, HEALTHY), None

    def listed(self, k, rng):
        """Modes with a loose joint; None where its d2 from the healthy tower is below 36."""
        joint, factor = int(rng.integers(COUNT)), float(np.exp(rng.uniform(-3.0, -0.2)))
        drawn = self._drawn(rng, tower(joint=joint, factor=factor)[0])
        true = measured_modes(*drawn)
        seen, sound = true.quantities, true.predicted(modes_of(()))
        apart = [np.log(seen[q] / sound[q]) / ROUGH["frequency"] if q.startswith("frequency")
                 else (seen[q] - sound[q]) / ROUGH["component"] for q in seen]
        return (drawn, f"loose joint {HEALTHY.joint_names[joint]}") if np.square(apart).sum() >= VISIBLE else None

    def _drawn(self, rng, model):
        chosen = np.sort(rng.choice(len(PLACES), rng.integers(6, 13), replace=False))
        return model, chosen, int(rng.integers(3, 7))

    def judged(self, drawn, rng):
        """Verdict on measured modes."""
        test = measured_modes(*drawn, rng=rng)
        made = Study(
            [{"modal test": test}], monument, Observation.of_modes(0, test, **ROUGH), causes=JOINTS, shared=(), levels=9
        )
        return made.diagnose(seed=int(rng.integers(1 << 31)), draws=DRAWS, pairs=False)


# ---- crack pattern alone ---------------------------------------------------------------------------------------------

MISREAD = 0.1
DRAWN = tuple(s for s in campaigns.SPECIMENS if s["setup"] in ("in plane", "slides"))
MOVING = tuple(c for c in CAUSES if c.lever not in ("reading", "stiffness"))


def pattern(specimen, *, extend=None, **inputs):
    """What each joint does in the mechanism of limit analysis."""
    model = campaigns.build(specimen, **inputs)
    found = lm.predict(*(model if extend is None else extend(*model)), method="limit").quantities
    return {q: v for q, v in found.items() if "|" in q}


class Patterns:
    """Planted patterns of opened and slid joints."""

    def __init__(self, cache):
        plain = [pattern(s) for s in DRAWN]
        self.study = Study(
            DRAWN, pattern, [Observation(i, q, v, MISREAD) for i, f in enumerate(plain) for q, v in f.items()],
            nuisance=campaigns.NUISANCE, causes=MOVING, cache=cache, version="1", shared=(),
            **{**SLOW, "levels": 17},  # a pattern jumps where one mechanism takes over
        )
        self.design = self.study.design()

    def nothing(self, k, rng):
        """Pattern of the baseline."""
        return self.study.baseline(), None

    def listed(self, k, rng):
        """What joints do with a listed cause of a random size; None where it is not visible."""
        cause = self.study.causes[k % len(self.study.causes)]
        size = cause.baseline + rng.uniform(0.2, 1.0) * (cause.sides[k % len(cause.sides)] - cause.baseline)
        values = self.study.predicted([cause], [size])
        y = self.design.whiten(values) - self.design.null.between(self.design.null.zero)
        return None if float(y @ y) < VISIBLE else (values, cause.name)

    def judged(self, values, rng):
        """Verdict on a pattern of which some joints are misread."""
        seen = np.where(rng.random(len(values)) < MISREAD, 1.0 - values, values)
        return self.study.replace(measured=(seen - MISREAD) / (1.0 - 2.0 * MISREAD)).diagnose(
            seed=int(rng.integers(1 << 31)), draws=DRAWS, pairs=False
        )
