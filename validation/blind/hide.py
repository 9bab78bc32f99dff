"""Draws what is hidden: the truth comes from a seed, and only measured values leave this module unsealed.

Planted by d2, the squared distance in noise units to the nearest rival of the list after that rival and the measured
friction are refitted. The distances choose *which* truth is drawn; the measured values come from the simulator.
"""

from dataclasses import dataclass, field

import numpy as np

from limitmason.diagnosis import Noise, Study
from limitmason.diagnosis.inference.grid import at_measured
from limitmason.diagnosis.inference.next_tests import distances

from . import surrogate

VISIBLE = 30.0  # d2 from the baseline that a twin must have
SEEN = 36.0  # d2 from the baseline that divides the middle class in the report
FAR = 150.0  # d2 beyond which nothing is left to be tested
OUTSIDE = 2.5  # effect outside the list in units of the noise: root mean square, or amplitude when weak
CLASSES = ("null", "clear", "middle", "twins", "unlisted", "unlisted weak", "scatter", "pair")
RANGES = {"clear": (25.0, FAR), "middle": (9.0, 25.0), "twins": (0.0, 1.0)}


@dataclass(frozen=True)
class Truth:
    """What was hidden.

    Parameters
    ----------
    kind : class
    names, sizes : planted causes of the list
    d2, seen : distance to the nearest rival, and to the refitted baseline, NaN where it has no meaning
    covariate : of an effect outside the list
    friction : true friction in standard deviations from the measured one
    expected : values without noise
    """

    kind: str
    names: tuple[str, ...] = ()
    sizes: tuple[float, ...] = ()
    d2: float = float("nan")
    seen: float = float("nan")
    covariate: str | None = None
    friction: float = 0.0
    expected: np.ndarray = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class Campaign:
    """A design with its tables, shared by all trials on it.

    Parameters
    ----------
    name : of the design
    study : without measured values
    sizes, d2, seen, single : per cause its node sizes, their d2 to the nearest rival, the baseline and each rival
    """

    name: str
    study: Study
    sizes: dict[str, np.ndarray]
    d2: dict[str, np.ndarray]
    seen: dict[str, np.ndarray]
    single: dict[str, dict[str, np.ndarray]]


def campaign(name, noise=None, covariates=surrogate.COVARIATES, pair_tables="exact"):
    """Tables and distances of the design of a name."""
    study = Study(
        surrogate.design(name),
        surrogate.simulate,
        None,
        noise or Noise(surrogate.NOISE),
        surrogate.NUISANCE,
        covariates,
        shared=(),  # the noise is independent: what is counted here is the rule itself
        levels=33,
        nuisance_levels=9,
        pair_tables=pair_tables,
    )
    design = study.known_design(surrogate.CAUSES)
    sizes, d2, seen, single = {}, {}, {}, {}
    for cause in surrogate.CAUSES:
        grid = design.singles[cause.name]
        curve = at_measured(grid)
        rivals = {r: distances(curve, g) for r, g in design.singles.items() if r != cause.name}
        sizes[cause.name], single[cause.name] = grid.sizes[0], rivals
        d2[cause.name] = np.min(list(rivals.values()), axis=0)
        seen[cause.name] = distances(curve, design.null)
    return Campaign(name, study, sizes, d2, seen, single)


def hide(where, kind, seed, *, noise=surrogate.NOISE, blunder=0.0, predict=None):
    """One data set of a class.

    Parameters
    ----------
    where : campaign
    kind : class
    seed : any sequence of integers
    noise : true relative noise
    blunder : error of one value in units of the noise
    predict : another simulator for the truth; None is that of the candidates

    Returns
    -------
    values, truth : what is measured, and what the diagnosing code must not see
    """
    rng = np.random.default_rng(seed)
    friction = float(rng.standard_normal())
    names, sizes, d2, seen, covariate = (), (), float("nan"), float("nan"), None
    if kind in RANGES:
        names, sizes, d2, seen = _one(where, kind, rng)
    elif kind == "pair":
        names, sizes, d2 = _two(where, rng)
    log_values = np.log((predict or expected)(where, names, sizes, friction))
    if kind.startswith("unlisted"):
        covariate, effect = _outside(where, rng)
        if kind == "unlisted":
            effect = effect / np.sqrt(np.mean((effect - effect.mean()) ** 2))
        log_values = log_values + OUTSIDE * surrogate.NOISE * effect
    true_noise = noise * rng.uniform(1.5, 2.0) if kind == "scatter" else noise
    measured = log_values + true_noise * rng.standard_normal(where.study.n)
    if blunder:
        measured[int(rng.integers(where.study.n))] += blunder * noise * rng.choice([-1.0, 1.0])
    return np.exp(measured), Truth(kind, names, sizes, d2, seen, covariate, friction, np.exp(log_values))


def expected(where, names, sizes, friction):
    """Values without noise, straight from the simulator."""
    by_name = {c.name: c for c in surrogate.CAUSES}
    chosen = [by_name[n] for n in names]
    parameters = {c.parameter: s for c, s in zip(chosen, sizes, strict=True) if not c.transforms}
    mu = surrogate.FRICTION + surrogate.FRICTION_ERROR * friction
    out = []
    for s in where.study.specimens:
        value = surrogate.simulate(s, friction_coefficient=mu, **parameters)
        for cause, size in zip(chosen, sizes, strict=True):
            if cause.transforms:
                value = cause.apply(size, value, s)
        out.append(value)
    return np.array(out)


def _one(where, kind, rng):
    low, high = RANGES[kind]
    options = {}
    for name, d2 in where.d2.items():
        good = (d2 >= low) & (d2 < high) & (where.seen[name] >= (VISIBLE if kind == "twins" else low))
        if good.any():
            options[name] = np.flatnonzero(good)
    if not options:
        raise LookupError(f"design {where.name} has no {kind}")
    name = sorted(options)[int(rng.integers(len(options)))]
    row = int(rng.choice(options[name]))
    return (name,), (float(where.sizes[name][row]),), float(where.d2[name][row]), float(where.seen[name][row])


def _two(where, rng):
    """Two causes, each seen clearly alone, neither passing as the other."""
    while True:
        a, b = (surrogate.CAUSES[i].name for i in sorted(rng.choice(len(surrogate.CAUSES), 2, replace=False)))
        rows = [np.flatnonzero((where.seen[x] >= 36) & (where.single[x][y] >= 25)) for x, y in ((a, b), (b, a))]
        if not (len(rows[0]) and len(rows[1])):
            continue
        sizes = tuple(float(where.sizes[x][int(rng.choice(r))]) for x, r in zip((a, b), rows, strict=True))
        values = np.log(expected(where, (a, b), sizes, 0.0))
        design = where.study.known_design(surrogate.CAUSES)
        y = (values - design.origin) / design.scale
        d2 = min(float(distances(y, g)[0]) for g in design.singles.values())
        if 25.0 <= d2 <= FAR:
            return (a, b), sizes, d2


def _outside(where, rng):
    """A covariate on which no cause of the list depends, and an effect along it: -1 to 1, or 0 and 1 for a group."""
    kind = ("line", "hump", "group")[int(rng.integers(3))]
    sign = float(rng.choice([-1.0, 1.0]))
    if kind == "group":
        return "operator", sign * np.array([1.0 if s["operator"] == "Z" else 0.0 for s in where.study.specimens])
    age = np.array([s["age"] for s in where.study.specimens])
    x = 2.0 * (age - age.min()) / (age.max() - age.min()) - 1.0
    return "age", sign * (x if kind == "line" else 1.0 - 2.0 * x**2)
