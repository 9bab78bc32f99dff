"""Monte Carlo and Sobol indices: random joints, blocks and builder parameters, one row per sample."""

from __future__ import annotations

import functools
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Unpack

import numpy as np
from scipy import stats
from scipy.stats import qmc

from limitmason.answers.curve import Curve
from limitmason.answers.results import Prediction
from limitmason.arrays import Array
from limitmason.checks import choice, count, instance
from limitmason.errors import InputError, NotApplicable, NotConverged
from limitmason.methods import get_method
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.storage.frozen import ReadOnly
from limitmason.study import random_joints as draws
from limitmason.study.linked_formulas import LinkedFormulas
from limitmason.study.random_joints import Random
from limitmason.study.sampling import Stop, latin_hypercube
from limitmason.study.sweep import RunOptions, pair_of, sweep
from limitmason.study.table import Table

LoadsOf = Callable[[Assembly], Loads]
Build = Callable[..., tuple[Assembly, Loads | LoadsOf]]
Run = Callable[[Assembly, Loads], Any]

SCHEMES = ("latin hypercube", "random")

_SAME = 1e-8  # spread of multipliers over their size that is rounding of the program
_LOST = 1e-12  # probability that bounds take: less is rounding of the distribution function
_ONCE = 1000
"""Second number of the key of what is drawn once: beyond joint properties, which have their place in ``BOUNDS``."""


def monte_carlo(
    build: tuple[Assembly, Loads | LoadsOf] | Build,
    samples: int,
    method: str = "limit",
    *,
    run: Run | None = None,
    joints: Mapping[str, Random] | None = None,
    blocks: Mapping[str, Random] | None = None,
    links: Mapping[str, str] | None = None,
    parameters: Mapping[str, Random] | None = None,
    stop: Stop | None = None,
    scheme: str = "latin hypercube",
    seed: int = 0,
    options: Mapping[str, Any] | None = None,
    **runs: Unpack[RunOptions],
) -> Table:
    """Collapse multipliers, or any answers, with random joints and blocks.

    Parameters
    ----------
    build : assembly and loads, or a function of the drawn parameters that returns them. Loads may be a function of the
        drawn assembly, ``lm.Loads.weight``
    samples : how many, or at most how many with ``stop``
    method, options : as in :func:`limitmason.predict`
    run : ``run(assembly, loads)`` in place of a method: returns numbers, words (a mode) and curves by name, a curve, a
        prediction or a number. Where it raises ``NotApplicable`` or ``NotConverged`` the row has that as its status and
        no answer
    joints : what varies by property of ``Joint``, or "friction_coefficient" [-] and "dilatancy_ratio" psi / phi [-]
    blocks : what varies of blocks, "density", "young_modulus", "poisson_ratio", per block or per assembly
    links : properties of joints by formula from others, joint by joint, {"shear_stiffness": "normal_stiffness / 2.32",
        "cohesion": "2 * tensile_strength * tan(radians(friction_angle_deg))"}
    parameters : what varies among the keywords of ``build``; one value per assembly
    stop : rule by which fewer samples may do; needs scheme "random", whose shorter runs begin the longer ones
    scheme : "latin hypercube" stratifies the values drawn per assembly, "random" draws them independently; values per
        kind, interface and block are always independent from sample to sample
    seed : equal seeds give equal tables
    runs : executor, workers, store and progress of :func:`limitmason.study.sweep`

    Returns
    -------
    Table
        sample, the drawn and linked values (mean and deviation of spatial ones), multiplier or what ``run`` returned,
        status. A sample that cannot stand under dead load has multiplier NaN and says so: leave it out of no average
        silently. A curve is a mapping of its columns, see :func:`curves_of`. The notes say what truncation takes,
        and where no draw changed the multiplier.

    Raises
    ------
    InputError
        For nothing random, unknown properties, distributions without probability within the physical bounds, and a
        random density under loads that do not follow it.

    Notes
    -----
    The random numbers of a sample depend on the seed and its number alone (``numpy.random.SeedSequence`` with a spawn
    key), so the number of workers, their order and an interruption change nothing. Longer random runs begin with the
    shorter ones, and a store of them is gone on with; Latin hypercubes of different sizes have no sample in common.
    With "random" every property has random numbers of its own, so that studies that draw different properties share
    those of the same name: their differences are not sampling. Loads of a fixed model stay those given.
    """
    if run is not None and (method != "limit" or options):
        raise InputError("run takes the place of a method: leave method and options out")
    blocks, ties = dict(blocks or {}), draws.check_links(dict(links or {}), dict(joints or {}))
    draws.check_block_draws(blocks)
    names, joints, parameters = _variables(build, joints, parameters, blocks)
    if "density" in blocks and not callable(build) and not callable(build[1]):
        raise InputError("a random density needs loads that follow it: give a function, such as lm.Loads.weight")
    if stop is not None and instance("stop", stop, Stop) and scheme != "random":
        raise InputError('a stopping rule needs scheme="random": a Latin hypercube is one whole')
    choice("scheme", scheme, SCHEMES)
    samples, seed = count("samples", samples), count("seed", seed, least=0)
    shares = latin_hypercube(len(names), samples, seed) if scheme == SCHEMES[0] else _independent(names, samples, seed)
    points = [{"sample": k, "shares": dict(zip(names, shares[k].tolist(), strict=True))} for k in range(samples)]
    drawn = RandomInputs(joints, blocks, ties, parameters, seed)
    refusals = () if run is None else (NotApplicable, NotConverged)
    solve = run or functools.partial(_by_method, method, dict(options or {}))
    one = functools.partial(_sample, build, solve, refusals, drawn)
    # the samples of a random run follow from the seed, so that a longer one goes on with the rows of a shorter
    which = points if scheme == SCHEMES[0] else scheme
    key = ("monte carlo", build, run or method, joints, blocks, ties.formulas, parameters, seed, options, which)
    found = sweep(
        one, points, key=key, **runs,
        units={k: unit for name, unit in draws.UNITS.items() for k in (name, f"{name} mean", f"{name} deviation")},
        batch=None if stop is None else stop.every, enough=stop,
    )
    return replace(found, notes=(*found.notes, *_truncations(joints, blocks, parameters), *_without_effect(found)))


def _without_effect(found: Table) -> list[str]:
    """Note where the multipliers of all rows are equal, as a method may ignore a draw."""
    given = (row.get("multiplier") for row in found.rows)
    values = [v for v in given if isinstance(v, float) and np.isfinite(v)]
    if len(values) < 2 or np.ptp(values) > _SAME * np.abs(values).max():
        return []
    return [
        f"every multiplier is {values[0]:.6g}: it does not hang on what was drawn, or the method leaves that out, as "
        "associative limit analysis does dilatancy and stiffness"
    ]


def _truncations(
    joints: Mapping[str, Random], blocks: Mapping[str, Random], parameters: Mapping[str, Random]
) -> list[str]:
    """Notes of what bounds, physical ones and given ones, take from the distributions, one by one."""
    out = []
    for name, random in (*joints.items(), *blocks.items(), *parameters.items()):
        # the package knows no bounds of an argument of a building function
        bounds = draws.BOUNDS.get(name) or draws.BLOCK_BOUNDS.get(name, (-np.inf, np.inf))
        lost = random.cut(bounds)
        if lost > _LOST:
            low, high = max(bounds[0], random.low), min(bounds[1], random.high)
            out.append(f"{name} is truncated to {low:.4g} ... {high:.4g}, which takes {lost:.2g} of its probability")
    return out


def curves_of(table: Table, column: str = "curve") -> list[Curve]:
    """Curves of the samples that have one.

    Parameters
    ----------
    table : of a Monte Carlo study whose run returned curves
    column : that holds them

    Raises
    ------
    InputError
        Where the column holds no curves.
    """
    found = [row[column] for row in table if row.get(column) is not None]
    if not found or not all(isinstance(c, Mapping) and "displacement" in c for c in found):
        raise InputError(f"column {column!r} holds no curves")
    return [
        Curve(np.array(c["displacement"]), np.array(c["load"]), c["displacement unit"], c["load unit"]) for c in found
    ]


@dataclass(frozen=True)
class RandomInputs:
    """What varies in a study, and the seed of its random numbers."""

    joints: Mapping[str, Random]  # by property
    blocks: Mapping[str, Random]  # by property
    links: LinkedFormulas  # of properties that follow from others
    parameters: Mapping[str, Random]  # of the function that builds, by name
    seed: int


def _by_method(method: str, options: Mapping[str, Any], assembly: Assembly, loads: Loads) -> Prediction:
    """The prediction of a method as the run of a sample."""
    chosen = get_method(method)
    return chosen.predict(assembly, loads, **chosen.one_of_many(options))


def _variables(
    build: Any, joints: Mapping[str, Random] | None, parameters: Mapping[str, Random] | None,
    blocks: Mapping[str, Random],
) -> tuple[list[str], dict[str, Random], dict[str, Random]]:
    """Check ``build`` and what varies of it, and name what is drawn once per assembly.

    Parameters
    ----------
    build : pair of assembly and loads, or a function of the parameters that returns one
    joints : what varies of them, by property
    blocks : the same of blocks, which :func:`.random_joints.check_block_draws` has checked
    parameters : what varies among the arguments of ``build``, by name

    Returns
    -------
    once : names of what is drawn once per assembly
    joints, parameters : both mappings, empty for None
    """
    joints, parameters = dict(joints or {}), dict(parameters or {})
    if not callable(build):
        pair = build if isinstance(build, tuple | list) and len(build) == 2 else (None, None)
        if not isinstance(pair[0], Assembly) or not (callable(pair[1]) or isinstance(pair[1], Loads)):
            raise InputError("build must be a pair (assembly, loads), or a function that returns one")
    if not joints and not parameters and not blocks:
        raise InputError("nothing is random: give joints={...}, blocks={...} or parameters={...}")
    draws.check_joint_draws(joints)
    if parameters and not callable(build):
        raise InputError("parameters vary what a function builds; build is a fixed model")
    for name, random in parameters.items():
        if not isinstance(random, Random) or random.per != "assembly":
            raise InputError(f"parameter {name!r} needs a Random(...) per assembly, got {random!r}")
        if name in draws.BOUNDS or name in draws.BLOCK_BOUNDS:
            where = "joints" if name in draws.BOUNDS else "blocks"
            raise InputError(f"parameter {name!r} has the name of a {where[:-1]} property: draw it in {where}")
    # in a fixed order, so that mappings that are equal have equal columns of a hypercube
    once = [n for n in draws.BOUNDS if n in joints and joints[n].per == "assembly"]
    once += [n for n in draws.BLOCK_BOUNDS if n in blocks and blocks[n].per == "assembly"]
    return [*once, *sorted(parameters)], joints, parameters


def _independent(names: Sequence[str], samples: int, seed: int) -> Array:
    """Random probabilities of what is drawn once per assembly, shape (samples, names).

    A value is read from its distribution at a probability from 0 to 1. Every name and sample has random numbers of its
    own, by the seed: another name or a longer study changes none.
    """
    out = np.zeros((samples, len(names)))
    for column, name in enumerate(names):
        word = zlib.crc32(name.encode())  # the name as a number
        for k in range(samples):
            stream = np.random.SeedSequence(seed, spawn_key=(k, _ONCE, word))
            out[k, column] = np.random.default_rng(stream).random()
    return out


def _sample(
    build: Any, run: Run, refusals: tuple[type[Exception], ...], drawn: RandomInputs, *, sample: int,
    shares: Mapping[str, float],
) -> dict[str, Any]:
    """Row of one sample: its numbers are drawn, the model is built and run.

    Parameters
    ----------
    build : model, or function that makes it
    run : what is asked of it
    refusals : errors of the run that count as an answer, which the row then tells as its status
    drawn : what varies, and the seed
    sample : its number, which with the seed decides its random numbers
    shares : probability at which every value drawn once is read, from 0 to 1, by name
    """
    given = {name: float(random.value(shares[name])) for name, random in drawn.parameters.items()}
    assembly, loads = pair_of(build(**given)) if callable(build) else build
    record: dict[str, float] = {}
    if drawn.joints or drawn.links:
        assembly, record = draws.draw_joints(assembly, drawn.joints, sample, drawn.seed, shares, drawn.links)
    if drawn.blocks:
        assembly, of_blocks = draws.draw_blocks(assembly, drawn.blocks, sample, drawn.seed, shares)
        record |= of_blocks
        if "density" in drawn.blocks and not callable(loads):
            raise InputError("a random density needs loads that follow it: let build return a function of the assembly")
    if callable(loads):
        loads = loads(assembly)
    try:
        answer = _answers(run(assembly, loads))
    except refusals as refused:
        answer = {"status": f"no answer: {refused}"}
    if twice := [n for n in answer if n in record or n in given]:
        raise InputError(f"run returns {twice[0]!r}, which is the name of a drawn value: call it otherwise")
    return {**given, **record, **answer}


def _answers(found: Any) -> dict[str, Any]:
    """What a run returned, as entries of a row: curves become mappings, a bare number is "value"."""
    if isinstance(found, Prediction):
        return {"multiplier": float(found.collapse_multiplier), "status": found.status}
    if isinstance(found, Curve):
        found = {"curve": found}
    if not isinstance(found, Mapping):
        found = {"value": found}

    def kept(value: Any) -> Any:
        """A curve as a mapping, which a store can keep; anything else as it is."""
        if not isinstance(value, Curve):
            return value
        return {
            "displacement": value.displacement, "load": value.load, "displacement unit": value.displacement_unit,
            "load unit": value.load_unit,
        }

    return {name: kept(value) for name, value in found.items()}


@dataclass(frozen=True, eq=False)
class SobolIndices(ReadOnly):
    """Shares of the multiplier's variance.

    Parameters
    ----------
    names : of the variables
    first : share each explains alone [-], shape (d,)
    total : share that would be left if all others were known, interactions included [-], shape (d,)
    table : all runs
    """

    names: tuple[str, ...]
    first: Array
    total: Array
    table: Table

    def __str__(self) -> str:
        """One line per variable."""
        rows = zip(self.names, self.first, self.total, strict=True)
        return "\n".join(f"{n:<24} first {a:7.3f}   total {b:7.3f}" for n, a, b in rows)


def sobol(
    build: tuple[Assembly, Loads] | Build,
    samples: int,
    method: str = "limit",
    *,
    joints: Mapping[str, Random] | None = None,
    parameters: Mapping[str, Random] | None = None,
    seed: int = 0,
    options: Mapping[str, Any] | None = None,
    **runs: Unpack[RunOptions],
) -> SobolIndices:
    """Sobol indices of the collapse multiplier.

    They tell which random input its scatter comes from.

    Parameters
    ----------
    samples : a power of two, n; n (d + 2) runs for d variables
    build, method, joints, parameters, seed, options, runs : as in :func:`monte_carlo`;
        only values per assembly

    Returns
    -------
    SobolIndices
        First-order and total indices; small samples may leave them slightly outside 0 to 1.

    Raises
    ------
    InputError
        For spatial draws, a number that is no power of two, samples without a finite multiplier, and multipliers that
        are all equal.

    Notes
    -----
    Saltelli's design on scrambled Sobol points, indices by ``scipy.stats.sobol_indices``. Inputs are independent.
    """
    names, joints, parameters = _variables(build, joints, parameters, {})
    if len(names) < len(joints) + len(parameters):
        raise InputError("Sobol indices are for values drawn per assembly; a field of values has no single index")
    samples = count("samples", samples)
    if samples < 2 or samples & (samples - 1):  # Sobol points are even over the cube in powers of two alone
        raise InputError(f"samples must be a power of two, got {samples!r}")
    d, seed = len(names), count("seed", seed, least=0)
    # Saltelli's scheme: independent samples A and B, and A with one column at a time taken from B
    both = qmc.Sobol(d=2 * d, seed=np.random.default_rng(seed)).random(samples)
    a, b = both[:, :d], both[:, d:]
    mixed = np.repeat(a[None], d, axis=0)
    for i in range(d):
        mixed[i, :, i] = b[:, i]
    shares = np.concatenate([a, b, mixed.reshape(-1, d)])
    points = [{"sample": k, "shares": dict(zip(names, row, strict=True))} for k, row in enumerate(shares.tolist())]
    drawn = RandomInputs(joints, {}, LinkedFormulas({}), parameters, seed)
    solve = functools.partial(_by_method, method, dict(options or {}))
    run = functools.partial(_sample, build, solve, (), drawn)
    key = ("sobol", build, method, joints, parameters, seed, options, points)
    table = sweep(run, points, key=key, **runs, units=draws.UNITS)
    value = table["multiplier"]
    if not np.isfinite(value).all():
        bad = int((~np.isfinite(value)).sum())
        raise InputError(f"{bad} of {len(value)} samples have no finite multiplier: narrow the distributions")
    f_ab = value[2 * samples :].reshape(d, 1, samples)
    # scipy fails at a single variable: it is given twice, and the second left out
    given = {"f_A": value[None, :samples], "f_B": value[None, samples : 2 * samples],
             "f_AB": np.repeat(f_ab, 2, axis=0) if d == 1 else f_ab}
    if told := _without_effect(table):
        raise InputError(f"there is no scatter to share: {told[0]}")
    found = stats.sobol_indices(func=given, n=samples)
    first, total = (np.ravel(x).astype(float)[:d] for x in (found.first_order, found.total_order))
    return SobolIndices(tuple(names), first, total, table)
