"""Monte Carlo and Sobol indices: random joints and builder parameters, one row per sample."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.stats import qmc

from limitmason.errors import InputError
from limitmason.methods import get_method
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.study.draws import BOUNDS, UNITS, Random, check_joint_draws, draw_joints
from limitmason.study.store import fingerprint
from limitmason.study.sweep import Progress, sweep
from limitmason.study.table import Table

Array = NDArray[np.float64]
Build = Callable[..., tuple[Assembly, Loads]]

SCHEMES = ("latin hypercube", "random")


def monte_carlo(
    build: tuple[Assembly, Loads] | Build,
    samples: int,
    method: str = "limit",
    *,
    joints: Mapping[str, Random] | None = None,
    parameters: Mapping[str, Random] | None = None,
    scheme: str = "latin hypercube",
    seed: int = 0,
    options: Mapping[str, Any] | None = None,
    executor: Any = None,
    workers: int = 1,
    store: str | Path | None = None,
    progress: Progress | None = None,
) -> Table:
    """Collapse multipliers of a structure with random joints.

    Parameters
    ----------
    build : assembly and loads, or a function of the drawn parameters that returns them
    samples : how many
    method, options : as in :func:`limitmason.predict`
    joints : what varies by property of ``Joint``, or "friction_coefficient" [-] and "dilatancy_ratio" psi / phi [-]
    parameters : what varies among the keywords of ``build``; one value per assembly
    scheme : "latin hypercube" stratifies the values drawn per assembly, "random" draws them independently; values per
        kind and per interface are always independent from sample to sample
    seed : equal seeds give equal tables
    executor, workers, store, progress : as in :func:`limitmason.study.sweep`

    Returns
    -------
    Table
        sample, the drawn values (mean and deviation of spatial ones), multiplier, status. A sample that cannot stand
        under dead load has multiplier NaN and says so: leave it out of no average silently.

    Raises
    ------
    InputError
        For nothing random, unknown properties, and distributions without probability within the physical bounds.

    Notes
    -----
    The random numbers of a sample depend on the seed and its number alone (``numpy.random.SeedSequence`` with a spawn
    key), so the number of workers, their order and an interruption change nothing. Longer random runs begin with the
    shorter ones; Latin hypercubes of different sizes have no sample in common. Loads of a fixed model stay those given.
    """
    names, joints, parameters = _variables(build, joints, parameters)
    if scheme not in SCHEMES:
        raise InputError(f"scheme must be one of {SCHEMES}, got {scheme!r}")
    if samples < 1:
        raise InputError(f"samples must be at least 1, got {samples!r}")
    shares = _stratified(len(names), samples, seed) if scheme == SCHEMES[0] else _independent(len(names), samples, seed)
    points = [{"sample": k, "shares": dict(zip(names, shares[k].tolist(), strict=True))} for k in range(samples)]
    run = functools.partial(_sample, build, method, joints, parameters, seed, dict(options or {}))
    key = (
        None if store is None else fingerprint("monte carlo", build, method, joints, parameters, seed, options, points)
    )
    return sweep(
        run, points, executor=executor, workers=workers, store=store, key=key, progress=progress,
        units={k: unit for name, unit in UNITS.items() for k in (name, f"{name} mean", f"{name} deviation")},
    )  # fmt: skip


def _variables(
    build: Any, joints: Mapping[str, Random] | None, parameters: Mapping[str, Random] | None
) -> tuple[list[str], dict[str, Random], dict[str, Random]]:
    """Names of what is drawn once per assembly, and both mappings checked."""
    joints, parameters = dict(joints or {}), dict(parameters or {})
    if not joints and not parameters:
        raise InputError("nothing is random: give joints={...} or parameters={...}")
    check_joint_draws(joints)
    if parameters and not callable(build):
        raise InputError("parameters vary what a function builds; build is a fixed model")
    for name, random in parameters.items():
        if not isinstance(random, Random) or random.per != "assembly":
            raise InputError(f"parameter {name!r} needs a Random(...) per assembly, got {random!r}")
        if name in BOUNDS:
            raise InputError(f"parameter {name!r} has the name of a joint property: draw it in joints")
    return [*(n for n in BOUNDS if n in joints and joints[n].per == "assembly"), *parameters], joints, parameters


def _stratified(width: int, samples: int, seed: int) -> Array:
    if width == 0:
        return np.zeros((samples, 0))
    return qmc.LatinHypercube(d=width, seed=np.random.default_rng(seed)).random(samples)


def _independent(width: int, samples: int, seed: int) -> Array:
    # the last word of the spawn key lies beyond those of the joint properties
    keys = [np.random.SeedSequence(seed, spawn_key=(k, 1000)) for k in range(samples)]
    return np.array([np.random.default_rng(key).random(width) for key in keys]).reshape(samples, width)


def _sample(
    build: Any, method: str, joints: Mapping[str, Random], parameters: Mapping[str, Random], seed: int,
    options: Mapping[str, Any], *, sample: int, shares: Mapping[str, float],
) -> dict[str, Any]:  # fmt: skip
    drawn = {name: float(random.value(shares[name])) for name, random in parameters.items()}
    assembly, loads = build(**drawn) if callable(build) else build
    record: dict[str, float] = {}
    if joints:
        assembly, record = draw_joints(assembly, joints, sample, seed, shares)
    chosen = get_method(method)
    found = chosen.predict(assembly, loads, **chosen.one_of_many(options))
    return {**drawn, **record, "multiplier": float(found.collapse_multiplier), "status": found.status}


@dataclass(frozen=True, eq=False)
class SobolIndices:
    """Shares of the multiplier's variance.

    Parameters
    ----------
    names : of the variables
    first : share each explains alone [-], shape (d,)
    total : share that would go if only it were known, interactions included [-], shape (d,)
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
    executor: Any = None,
    workers: int = 1,
    store: str | Path | None = None,
    progress: Progress | None = None,
) -> SobolIndices:
    """Sobol indices of the collapse multiplier: which random input its scatter comes from.

    Parameters
    ----------
    samples : a power of two, n; n (d + 2) runs for d variables
    build, method, joints, parameters, seed, options, executor, workers, store, progress : as in :func:`monte_carlo`;
        only values per assembly

    Returns
    -------
    SobolIndices
        First-order and total indices; small samples may leave them slightly outside 0 to 1.

    Raises
    ------
    InputError
        For spatial draws, a number that is no power of two, and samples without a finite multiplier.

    Notes
    -----
    Saltelli's design on scrambled Sobol points, indices by ``scipy.stats.sobol_indices``. Inputs are independent.
    """
    names, joints, parameters = _variables(build, joints, parameters)
    if len(names) < len(joints) + len(parameters):
        raise InputError("Sobol indices are for values drawn per assembly; a field of values has no single index")
    if samples < 2 or samples & (samples - 1):
        raise InputError(f"samples must be a power of two, got {samples!r}")
    d = len(names)
    both = qmc.Sobol(d=2 * d, seed=np.random.default_rng(seed)).random(samples)
    a, b = both[:, :d], both[:, d:]
    mixed = np.repeat(a[None], d, axis=0)
    for i in range(d):
        mixed[i, :, i] = b[:, i]
    shares = np.concatenate([a, b, mixed.reshape(-1, d)])
    points = [{"sample": k, "shares": dict(zip(names, row, strict=True))} for k, row in enumerate(shares.tolist())]
    run = functools.partial(_sample, build, method, joints, parameters, seed, dict(options or {}))
    key = None if store is None else fingerprint("sobol", build, method, joints, parameters, seed, options, points)
    table = sweep(run, points, executor=executor, workers=workers, store=store, key=key, progress=progress, units=UNITS)
    value = table["multiplier"]
    if not np.isfinite(value).all():
        bad = int((~np.isfinite(value)).sum())
        raise InputError(f"{bad} of {len(value)} samples have no finite multiplier: narrow the distributions")
    given = {"f_A": value[None, :samples], "f_B": value[None, samples : 2 * samples],
             "f_AB": value[2 * samples :].reshape(d, 1, samples)}  # fmt: skip
    found = stats.sobol_indices(func=given, n=samples)
    return SobolIndices(
        tuple(names), np.ravel(found.first_order).astype(float), np.ravel(found.total_order).astype(float), table
    )
