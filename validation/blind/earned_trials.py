"""Trials of earned names: a truth on assemblies is hidden, the diagnosis sees values only, outcomes are counted."""

import functools
from dataclasses import dataclass

import numpy as np

from limitmason.diagnosis import Extension, Rule
from limitmason.diagnosis.inference.next_tests import distances
from limitmason.diagnosis.inference.shared_noise import assumed

from . import campaign_store as store
from . import campaigns, surface
from .campaigns import CAUSES, NEVER_LISTED, NOISE, READ, SIMULATED
from .outsiders import EFFECTS

DESIGNS = ("7", "12", "24")
CLEAR, NEAR = 36.0, 9.0  # d2 of the classes
VISIBLE, MOST = 16.0, 400.0  # d2 from the baseline of what is planted outside the list
TWO = 25.0  # d2 of two causes from the best single one
SHARED = 0.5  # of the variance of the noise
DRAWS = 499  # most bootstrap draws of a verdict; 1,999 by default
RULE = Rule(screen=True)  # hopeless causes are not bootstrapped: verdicts are counted, not p
OUTCOMES = ("none", "scatter", "unexplained", "named", "behaves like it", "set with it", "wrong name",
            "wrong pair named", "behaves like another", "set without it")


@dataclass(frozen=True)
class Plant:
    """What is hidden: an effect by its logarithms of the values at each friction.

    Parameters
    ----------
    names : causes of the list that it is, none for an effect outside
    label : what it is, for the report
    logs : expected log values, shape (frictions, n)
    seen, rival : d2 to the refitted baseline and to the nearest cause of the list
    lever : what no trend along one covariate takes of it
    """

    names: tuple[str, ...]
    label: str
    logs: np.ndarray
    seen: float
    rival: float
    lever: float


class Place:
    """One campaign with limit analysis as the candidates, and the truths of one code.

    Parameters
    ----------
    name : of the campaign
    code : of the truths
    """

    def __init__(self, name, code=store.LIMIT):
        values = store.read()
        self.name, self.code, self.truth = name, code, store.Simulator(code, values)
        self.study = store.blank(name, store.Simulator(store.LIMIT, values))
        self.design = self.study.design(CAUSES)
        self.specimens, self.numbers = self.study.specimens, campaigns.CHOSEN[name]
        self.frictions = store.FRICTIONS if code == store.LIMIT else (0.0,)
        self._lists = {}

    def logs(self, value):
        """Logarithms of ``value(number, specimen, friction)`` at every friction, shape (frictions, n)."""
        return np.log([
            [value(i, s, store.friction(z)) for i, s in zip(self.numbers, self.specimens, strict=True)]
            for z in self.frictions
        ])

    def simulated(self, *steps):
        """Logarithms with causes of the catalogue switched on, pairs of cause and size; readings last."""
        inside = Extension(tuple(s for s in steps if not s[0].transforms))

        def value(number, s, mu):
            out = self.truth(s, friction_coefficient=mu, extend=inside)
            for cause, size in steps:
                out = cause.apply(size, out, s) if cause.transforms else out
            return out

        return self.logs(value)

    def outside(self, effect, size, *steps):
        """Logarithms with an effect of the outsider's, and readings of the catalogue upon it."""
        inside = Extension(tuple(s for s in steps if not s[0].transforms))

        def value(number, s, mu):
            if effect.change is None:
                out = effect.read(size, self.truth(s, friction_coefficient=mu, extend=inside), s)
            else:
                out = self.truth.effect(effect.name, size, number, mu)
            for cause, step in steps:
                out = cause.apply(step, out, s) if cause.transforms else out
            return out

        return self.logs(value)

    def plant(self, names, label, logs):
        """A plant with its distances on this design."""
        y = (logs.mean(axis=0) - self.design.origin) / self.design.scale
        own = names if len(names) == 1 else ()  # of two neither is enough
        rivals = [float(distances(y, g)[0]) for n, g in self.design.singles.items() if n not in own]
        about = ("batch",) if names == ("shift of batch B",) else ()
        lever = surface.remainder(y, self.study.covariates, about)
        return Plant(names, label, logs, float(distances(y, self.design.null)[0]), min(rivals), lever)

    @functools.cached_property
    def nothing(self):
        """The baseline."""
        return Plant((), "nothing", self.simulated(), 0.0, 0.0, 0.0)

    @functools.cached_property
    def listed(self):
        """Every cause of the list at all planted sizes."""
        out = []
        for cause in CAUSES:
            sizes = store.planted_sizes(cause)
            if cause.transforms:  # nothing to be stored: many sizes
                sizes = [cause.baseline + f * (e - cause.baseline) for e in cause.sides for f in np.arange(1, 10) / 10]
            out += [self.plant((cause.name,), cause.name, self.simulated((cause, x))) for x in sizes]
        return out

    @functools.cached_property
    def never_listed(self):
        """Causes of the catalogue that are not on the list."""
        out = []
        for cause in NEVER_LISTED if self.code == store.LIMIT else ():
            sizes = store.planted_sizes(cause)
            out += [self.plant((), cause.name, self.simulated((cause, x))) for x in sizes]
        return [p for p in out if VISIBLE <= p.seen <= MOST]

    @functools.cached_property
    def outsiders(self):
        """Effects that never were in the catalogue."""
        out = []
        for effect in EFFECTS:
            sizes = effect.sizes if self.code == store.LIMIT or effect.change is None else effect.sizes[1:2]
            out += [self.plant((), effect.name, self.outside(effect, x)) for x in sizes]
        return [p for p in out if VISIBLE <= p.seen <= MOST]

    @functools.cached_property
    def two_listed(self):
        """Two causes of the list, neither enough alone."""
        by_name, out = {c.name: c for c in CAUSES}, []
        for a, x, b, y in store.TWO:
            out.append(self.plant((a, b), f"{a} + {b}", self.simulated((by_name[a], x), (by_name[b], y))))
        for first in SIMULATED:
            for second in READ:
                x, y = store.planted_sizes(first)[-1], second.baseline + 0.6 * (second.sides[0] - second.baseline)
                names = (first.name, second.name)
                out.append(self.plant(names, " + ".join(names), self.simulated((first, x), (second, y))))
        return [p for p in out if p.seen >= CLEAR and p.rival >= TWO]

    @functools.cached_property
    def listed_and_outside(self):
        """A cause of the list with an effect that is not, both visible."""
        by_name, out = {c.name: c for c in CAUSES}, []
        for effect in EFFECTS:
            if effect.change is None:
                pairs = [(c, store.planted_sizes(c)[-1]) for c in SIMULATED]
            else:
                pairs = [(c, c.baseline + 0.5 * (c.sides[0] - c.baseline)) for c in READ]
            for cause, size in pairs:
                logs = self.outside(effect, effect.sizes[1], (by_name[cause.name], size))
                out.append(self.plant((), f"{cause.name} + {effect.name}", logs))
        return [p for p in out if p.seen >= CLEAR]

    def of_class(self, kind):
        """Plants of a class."""
        if kind == "clear":
            return [p for p in self.listed if p.seen >= CLEAR and p.rival >= CLEAR and p.lever >= CLEAR]
        if kind == "near a rival":
            return [p for p in self.listed if p.seen >= CLEAR and NEAR <= p.rival < CLEAR]
        if kind == "near the baseline":
            return [p for p in self.listed if NEAR <= p.seen < CLEAR]
        if kind == "missing, of the list":
            return [p for p in self.listed if VISIBLE <= p.seen <= MOST]
        return {
            "missing, never listed": lambda: self.never_listed, "outsiders": lambda: self.outsiders,
            "two listed": lambda: self.two_listed, "listed and outside": lambda: self.listed_and_outside,
        }.get(kind, lambda: [self.nothing])()

    def list_without(self, names):
        """The list without some causes."""
        return tuple(c for c in CAUSES if c.name not in names)


@functools.lru_cache(maxsize=8)
def place(name, code=store.LIMIT):
    """A campaign, made once."""
    return Place(name, code)


def chosen(plants, rng):
    """One plant: a label first, so that all effects count alike."""
    labels = sorted({p.label for p in plants})
    label = labels[int(rng.integers(len(labels)))]
    some = [p for p in plants if p.label == label]
    return some[int(rng.integers(len(some)))]


def values_of(where, plant, rng, column=None):
    """Measured values: a friction, noise, and its share within the labels of a column."""
    logs = plant.logs[int(rng.integers(len(plant.logs)))]
    noise = rng.standard_normal(len(logs))
    if column is not None:
        noise = np.linalg.cholesky(assumed(where.study.covariates[column], SHARED)) @ noise
    return np.exp(logs + NOISE * noise)


def outcome(verdict, names):
    """Which of ``OUTCOMES`` a verdict is when the causes of a name, or something outside the list, were hidden."""
    hidden = set(names)
    if verdict.kind in ("none", "scatter", "unexplained"):
        return str(verdict.kind)
    if verdict.distinct:  # this one explanation, identified or behaves like: peaks alone identify nothing
        wrong = "wrong pair named" if verdict.pairs else "wrong name"
        return "named" if hidden == set(verdict.causes) else wrong
    if verdict.kind == "behaves like":
        return "behaves like it" if hidden == set(verdict.causes) else "behaves like another"
    sets = [set(p) for p in verdict.pairs] or [{c} for c in verdict.causes]
    return "set with it" if hidden and any(hidden <= s for s in sets) else "set without it"


def one(design, kind, seed, *, code=store.LIMIT, column=None, recorded=True, carried=True, untold=None, rule=RULE):
    """Hide one data set and diagnose it.

    Parameters
    ----------
    design, kind : campaign and class
    seed : integers
    code : of the truth
    column : within whose labels the noise is shared
    recorded, carried : whether that column is known to the study, and its share estimated; where it is not known the
        study is told nothing, where it is not carried that all noise is independent
    untold : a column that the study does not know, and within which nothing is shared

    Returns
    -------
    dict, or None where the design has no truth of the class
    """
    where = place(design, code)
    plants = where.of_class(kind)
    if not plants:
        return None
    rng = np.random.default_rng(seed)
    plant = chosen(plants, rng)
    values = values_of(where, plant, rng, column)
    causes = where.list_without(plant.names if kind.startswith("missing") else ())
    study = where.study
    if column is not None:
        known = {k: v for k, v in study.covariates.items() if recorded or k != column}
        shared = None if not recorded else (column,) if carried else ()
        study = study.replace(covariates=known, shared=shared)
    if untold is not None:
        study = study.replace(covariates={k: v for k, v in study.covariates.items() if k != untold})
    verdict = study.replace(measured=values).diagnose(causes, seed=seed[-1], draws=DRAWS, rule=rule)
    truth = () if kind.startswith("missing") else plant.names
    out = {"design": design, "kind": kind, "truth": plant.label, "outcome": outcome(verdict, truth),
           "said": " + ".join(verdict.causes)}
    record = verdict.identification
    if record is not None:
        fit = verdict.verdict.tested[record.names].fit
        rival = surface.Surfaces(verdict.design, verdict.covariates).evidence(verdict.y)
        out |= {"excess": record.excess, "expected": record.expected, "margin": record.margin,
                "missing": list(record.missing), "surface": float(fit.loglik[0]) - rival,
                "right": set(truth) == set(verdict.causes), "pair": bool(verdict.pairs)}
    return out


def exact_power(design, alarms, seed, count):
    """Detection by the largest gain over the list, at a threshold that nulls of the same tables pass with ``alarms``.

    Returns
    -------
    found, count : of data sets of the class "near the baseline"
    """
    where = place(design)
    plants = where.of_class("near the baseline")
    if not plants:
        return 0, 0
    d, names = where.design, [(c.name,) for c in CAUSES]

    def gain(y):
        zero = np.zeros((len(y), d.inputs))
        best = np.max([f.loglik for f in d.fits(names, y, zero)], axis=0)
        return best - d.fits([()], y, zero)[0].loglik

    def drawn(plant_of, rng, number):
        return np.array([d.whiten(values_of(where, plant_of(rng), rng)) for _ in range(number)])

    rng = np.random.default_rng([*seed, 1])
    limit = np.quantile(gain(drawn(lambda r: where.nothing, rng, 4000)), 1.0 - alarms)
    return int((gain(drawn(lambda r: chosen(plants, r), rng, count)) > limit).sum()), count
