"""Certificates: is a prediction in equilibrium, within the joint law, admissible as a motion, and how wide is the gap.

Everything is recomputed with numpy from the assembly, the loads and the prediction's forces and twists. Nothing of the
solver that made them is used, nor the equilibrium matrix: forces are summed block by block, rates are differences of
rigid velocities at the contact points.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.results import Certificate, Mechanism, Prediction, Resultants

Array = NDArray[np.float64]

__all__ = [
    "FORCE_CAP",
    "PointState",
    "certify",
    "equilibrium_residual",
    "kinematic_multiplier",
    "point_rates",
    "point_state",
    "resultants_from_points",
    "scaled_mechanism",
    "total_load",
    "yield_violation",
]

FORCE_CAP = 10.0
"""Joint force over the total load up to which a mechanism that cannot be repaired still gives a bound."""


class PointState(NamedTuple):
    """Forces, rates and law at every contact point, relative forces and rates already formed."""

    normal_force: Array  # N [N], (m,)
    shear_force: Array  # T in global axes [N], (m, 3)
    opening: Array  # e_n [m/s], (m,)
    sliding: Array  # e_t in global axes [m/s], (m, 3)
    tan_phi: Array
    tan_psi: Array
    cohesion: Array  # c A_p [N]
    tension: Array  # tension capacity min(ft A_p, c A_p / tan phi) [N]
    crushing: Array  # fc A_p [N]; infinite for stress blocks, which are checked by interface


def total_load(assembly: Assembly, loads: Loads) -> float:
    """Sum of the dead forces on free blocks [N], or of the live ones without dead load; the scale of residuals."""
    free = ~assembly.fixed
    dead = np.linalg.norm(loads.dead[free, :3], axis=1).sum()
    live = np.linalg.norm(loads.live[free, :3], axis=1).sum()
    return float(dead if dead > 0 else live if live > 0 else 1.0)


def point_rates(assembly: Assembly, twists: Array, position: Array, interface: NDArray) -> tuple[Array, Array]:
    """Opening [m/s], shape (m,), and sliding of b relative to a in global axes, shape (m, 3), at contact points."""
    x = assembly.arrays
    a, b = x.block_a[interface], x.block_b[interface]

    def velocity(block: NDArray) -> Array:
        arm = position - assembly.centroids[block]
        return twists[block, :3] + np.cross(twists[block, 3:], arm)

    jump = velocity(b) - velocity(a)
    n = x.normal[interface]
    opening = (jump * n).sum(axis=1)
    return opening, jump - opening[:, None] * n


def point_state(assembly: Assembly, resultants: Resultants, twists: Array) -> PointState:
    """Forces, rates and strengths at the contact points of a prediction."""
    x = assembly.arrays
    k = resultants.point_interface
    n = x.normal[k]
    normal_force = (resultants.point_force * n).sum(axis=1)
    opening, sliding = point_rates(assembly, twists, resultants.point_position, k)
    area = resultants.point_area
    cohesion = x.cohesion[k] * area
    with np.errstate(divide="ignore", invalid="ignore"):
        apex = np.where(x.tan_phi[k] > 0, cohesion / x.tan_phi[k], np.inf)
    tension = np.minimum(x.tensile_strength[k] * area, apex)
    return PointState(
        normal_force, resultants.point_force - normal_force[:, None] * n, opening, sliding, x.tan_phi[k], x.tan_psi[k],
        cohesion, tension, x.compressive_strength[k] * area,
    )  # fmt: skip


def equilibrium_residual(assembly: Assembly, loads: Loads, resultants: Resultants, multiplier: float) -> float:
    """Largest unbalanced force, or moment over the block's radius, relative to the total load [-]."""
    x = assembly.arrays
    k = resultants.point_interface
    rest = np.array(loads.dead + multiplier * loads.live)
    for block, sign in ((x.block_b[k], 1.0), (x.block_a[k], -1.0)):
        force = sign * resultants.point_force
        moment = np.cross(resultants.point_position - assembly.centroids[block], force)
        for c in range(3):
            rest[:, c] += np.bincount(block, force[:, c], assembly.n_blocks)
            rest[:, 3 + c] += np.bincount(block, moment[:, c], assembly.n_blocks)
    rest[assembly.held] = 0.0
    rest[:, 3:] /= np.cbrt(x.volume)[:, None]
    return float(np.abs(rest).max(initial=0.0) / total_load(assembly, loads))


def yield_violation(state: PointState, blocks: Array | None, scale: float) -> float:
    """Largest excess of a contact force over the joint law, relative to ``scale`` [N].

    ``blocks`` holds (N1, N2, capacity, tension) of in-plane stress blocks, shape (j, 4), or None.
    """
    shear = np.linalg.norm(state.shear_force, axis=1)
    excess = [
        shear - state.cohesion - state.tan_phi * state.normal_force,
        -state.normal_force - state.tension,
        state.normal_force - state.crushing,
    ]
    worst = max(float(e.max(initial=0.0)) for e in excess)
    if blocks is not None and len(blocks):
        n1, n2 = blocks[:, 0] + 0.5 * blocks[:, 3], blocks[:, 1] + 0.5 * blocks[:, 3]
        worst = max(worst, float(((n1 + n2) ** 2 / (2.0 * blocks[:, 2]) - np.minimum(n1, n2)).max()))
    return max(worst, 0.0) / scale


def _dissipation(state: PointState, opening: Array, sliding: Array) -> tuple[Array, Array]:
    """Power a point can dissipate under the associative law, and g = e_n - tan(phi) |e_t|, which must not be negative.

    D = c |e_t| A + N_t g for g >= 0 (N_t the tension capacity) and c |e_t| A - N_c g for g < 0 (N_c the crushing
    capacity; infinite without crushing, which is what makes g < 0 inadmissible).
    """
    slip = np.linalg.norm(sliding, axis=1)
    g = opening - state.tan_phi * slip
    power = state.cohesion * slip + np.where(g > 0, state.tension * g, 0.0)
    finite = np.isfinite(state.crushing)
    power[finite] += state.crushing[finite] * np.maximum(-g[finite], 0.0)
    return power, g


def _stress_block_power(g1: Array, g2: Array, capacity: Array, tension: Array) -> Array:
    """Power of a crushing in-plane section: max of -(g1 N1 + g2 N2) over N_i >= (N1 + N2)^2 / (2 Q)."""
    low, high = np.minimum(g1, g2), np.maximum(g1, g2)
    spread = np.maximum(high - low, 1e-300)
    n = np.where(low < 0, np.clip(capacity * -low / spread, 0.0, capacity), 0.0)
    return -low * n - (high - low) * n**2 / (2.0 * capacity) + 0.5 * tension * (g1 + g2)


def kinematic_multiplier(
    assembly: Assembly, loads: Loads, prediction: Prediction, *, candidates: tuple[Array, ...] = ()
) -> tuple[float, float, float]:
    """Upper bound of the associative multiplier from the prediction's mechanism, repaired to be admissible.

    lambda = [ -w_dead . v + sum D(e) ] / (w_live . v), valid for every v with e_n >= tan(phi) |e_t| at all points
    without crushing. A solver's v violates this by its tolerance. The repair adds just enough of a motion that opens
    every joint: the blocks flying apart affinely, v = (x, y, k z), or a candidate supplied by the caller. Where no
    motion opens every joint (blocks wedged between supports) the remaining violation is charged with the power of a
    joint force of at most ``FORCE_CAP`` times the load (or the largest force found): the bound then holds for all
    stress states within that cap, not beyond.

    Parameters
    ----------
    candidates : further opening motions to try, twists of shape (n_blocks, 6)

    Returns
    -------
    multiplier : the bound [-]
    violation : largest negative g before the repair over the largest rate [-]
    force_cap : joint force over the total load up to which the bound holds; infinite for a repaired mechanism
    """
    mechanism, resultants = prediction.mechanism, prediction.resultants
    if mechanism is None or resultants is None:
        return float("nan"), float("nan"), float("inf")
    twists = np.where(assembly.held, 0.0, mechanism.twists)
    state = point_state(assembly, resultants, twists)
    pairs = _stress_block_pairs(assembly, prediction)
    rigid = ~np.isfinite(state.crushing)
    if pairs is not None:
        rigid[pairs[0].ravel()] = False

    def value(v: Array) -> tuple[float, Array]:
        opening, sliding = point_rates(assembly, v, resultants.point_position, resultants.point_interface)
        if pairs is None:
            power, g = _dissipation(state, opening, sliding)
            total = power.sum()
        else:
            ends, capacity, tension = pairs
            power, g = _dissipation(state._replace(crushing=np.full_like(opening, np.inf)), opening, sliding)
            slip = np.linalg.norm(sliding, axis=1)
            others = np.ones(len(g), dtype=bool)
            others[ends.ravel()] = False
            total = power[others].sum() + (state.cohesion * slip)[ends].sum()
            total += _stress_block_power(g[ends[:, 0]], g[ends[:, 1]], capacity, tension).sum()
        rate = float((loads.live * v).sum())
        return (float(total - (loads.dead * v).sum()) / rate if rate > 0 else float("nan")), g

    first, g = value(twists)
    size = max(float(np.abs(state.opening).max(initial=0.0)), float(np.abs(state.sliding).max(initial=0.0)), 1e-300)
    worst = float(np.where(rigid, -g, 0.0).max(initial=0.0))
    if worst <= 0.0:
        return first, 0.0, float("inf")
    best = float("nan")
    for field in (*_opening_fields(assembly), *candidates):
        opening, sliding = point_rates(assembly, field, resultants.point_position, resultants.point_interface)
        margin = (opening - state.tan_phi * np.linalg.norm(sliding, axis=1))[rigid]
        if margin.min(initial=np.inf) <= 0.0:
            continue
        # g is concave in v, so adding t field raises every g by at least t times the field's own margin
        need = np.max(np.maximum(-g[rigid], 0.0) / margin)
        repaired, after = value(twists + (1.0 + 1e-9) * need * field)
        if np.where(rigid, -after, 0.0).max(initial=0.0) <= 1e-14 * size and not repaired >= best:
            best = repaired
    if not np.isnan(best):
        return best, worst / size, float("inf")
    scale = total_load(assembly, loads)
    cap = max(FORCE_CAP * scale, float(np.abs(state.normal_force).max(initial=0.0)))
    excess = cap * float(np.maximum(-g[rigid], 0.0).sum()) / float((loads.live * twists).sum())
    return first + excess, worst / size, cap / scale


def _opening_fields(assembly: Assembly):
    """Motions in which the blocks fly apart: from the middle of the held blocks, ever more upwards than sideways."""
    c = assembly.centroids
    x = assembly.arrays
    at = x.centre[assembly.fixed[x.block_a] | assembly.fixed[x.block_b]]
    foot = at if len(at) else c
    origin = 0.5 * (foot.min(axis=0) + foot.max(axis=0))
    for lift in (1.0, 2.0, 4.0, 8.0, 16.0, 64.0, 256.0):
        field = np.zeros((assembly.n_blocks, 6))
        field[:, :3] = (c - origin) * (1.0, 1.0, lift)
        field[assembly.held] = 0.0
        yield field


def _stress_block_pairs(assembly: Assembly, prediction: Prediction) -> tuple[Array, Array, Array] | None:
    """End points, crushing capacity Q and tension of interfaces with a crushing stress block; None where none has."""
    if prediction.provenance.get("crushing") != "stress block" or prediction.resultants is None:
        return None
    x = assembly.arrays
    k = prediction.resultants.point_interface
    rows = np.flatnonzero(np.isfinite(x.compressive_strength))
    first = np.searchsorted(k, rows)
    found = (first < len(k)) & (k[np.minimum(first, len(k) - 1)] == rows)
    rows, first = rows[found], first[found]
    tension = np.minimum(
        x.tensile_strength[rows], np.divide(x.cohesion[rows], x.tan_phi[rows], out=np.full(len(rows), np.inf),
                                            where=x.tan_phi[rows] > 0)
    ) * x.area[rows]  # fmt: skip
    return np.column_stack([first, first + 1]), x.compressive_strength[rows] * x.area[rows] + tension, tension


def certify(
    assembly: Assembly, loads: Loads, prediction: Prediction, *, candidates: tuple[Array, ...] = ()
) -> Certificate:
    """Certificate of a prediction, from the assembly, the loads and the prediction alone.

    Parameters
    ----------
    assembly, loads : the problem
    prediction : with forces at contact points, and a mechanism where there is one
    candidates : opening motions for the repair, see :func:`kinematic_multiplier`

    Returns
    -------
    Certificate
        For an associative prediction the kinematic bound and the gap are given; for a non-associative one the
        residual of its flow rule e_n >= tan(psi) |e_t| and its complementarity,
        sum (N + N_t) (e_n - tan(psi) |e_t|) + |T . e_t + (c A + N tan(phi)) |e_t|| over the total load's unit power
        (a point that crushes may close, e_n < tan(psi) |e_t|, at its capacity).
    """
    r, m = prediction.resultants, prediction.mechanism
    if r is None or not np.isfinite(prediction.collapse_multiplier):
        return Certificate(float("nan"), float("nan"))
    scale = total_load(assembly, loads)
    twists = np.zeros((assembly.n_blocks, 6)) if m is None else np.where(assembly.held, 0.0, m.twists)
    state = point_state(assembly, r, twists)
    pairs = _stress_block_pairs(assembly, prediction)
    blocks = None
    if pairs is not None:
        ends, capacity, tension = pairs
        blocks = np.column_stack([state.normal_force[ends], capacity, tension])
        crushing = state.crushing.copy()
        crushing[ends.ravel()] = np.inf
        state = state._replace(crushing=crushing)
    residual = equilibrium_residual(assembly, loads, r, prediction.collapse_multiplier)
    excess = yield_violation(state, blocks, scale)
    confinement = float(np.abs(r.normal).max(initial=0.0) / scale)
    if m is None:
        return Certificate(residual, excess, static_multiplier=prediction.collapse_multiplier, confinement=confinement)
    slip = np.linalg.norm(state.sliding, axis=1)
    size = max(float(np.abs(state.opening).max(initial=0.0)), float(slip.max(initial=0.0)))
    rate = float((loads.live * twists).sum())
    if prediction.provenance.get("flow_rule") == "non-associative" and not rate > 0.0:
        unknown = float("nan")  # a motion on which the live load does no work is no collapse mechanism
        return Certificate(residual, excess, unknown, unknown, prediction.collapse_multiplier, confinement=confinement)
    if prediction.provenance.get("flow_rule") == "non-associative":
        gap = state.opening - state.tan_psi * slip
        capacity = state.cohesion + state.tan_phi * state.normal_force
        opposed = np.abs((state.shear_force * state.sliding).sum(axis=1) + capacity * slip)
        # at the tension cut-off a point may open freely with N = -N_t, at the crushing limit it may close with N = N_c
        crushes = np.isfinite(state.crushing)
        lift = np.abs((state.normal_force + state.tension) * np.where(crushes, np.maximum(gap, 0.0), gap))
        rest = (state.crushing - state.normal_force)[crushes]
        lift[crushes] += np.abs(rest * np.maximum(-gap[crushes], 0.0))
        gap = np.where(crushes, 0.0, gap)
        power = max(abs(rate), 1e-300) * scale / max(_live_size(assembly, loads), 1e-300)
        return Certificate(
            residual, excess, float(np.maximum(-gap, 0.0).max(initial=0.0) / max(size, 1e-300)),
            float((opposed + lift).sum() / power), static_multiplier=prediction.collapse_multiplier,
            confinement=confinement,
        )  # fmt: skip
    kinematic, flow, force_cap = kinematic_multiplier(assembly, loads, prediction, candidates=candidates)
    power, _ = _dissipation(state, state.opening, state.sliding)
    used = (state.normal_force * state.opening) + (state.shear_force * state.sliding).sum(axis=1)
    unit = max(abs(rate), 1e-300) * scale / max(_live_size(assembly, loads), 1e-300)
    slack = np.abs(used + power) if pairs is None else np.full(1, np.nan)  # a stress block's two ends act together
    static = prediction.collapse_multiplier
    # relative to the multiplier itself, unless that is next to nothing beside the one at which live equals dead load
    gap = (kinematic - static) / max(1e-3 * scale / max(_live_size(assembly, loads), 1e-300), abs(static))
    return Certificate(
        residual, excess, flow, float(slack.max() / unit), static, kinematic, gap, confinement, force_cap
    )


def _live_size(assembly: Assembly, loads: Loads) -> float:
    """Sum of the live forces, and of the live couples over the size of their block [N]."""
    free = ~assembly.fixed
    force = np.linalg.norm(loads.live[free, :3], axis=1)
    couple = np.linalg.norm(loads.live[free, 3:], axis=1) / np.cbrt(assembly.volumes[free])
    return float(np.maximum(force, couple).sum())


def scaled_mechanism(
    assembly: Assembly, loads: Loads, twists: Array, position: Array, interface: NDArray
) -> Mechanism | None:
    """Mechanism scaled so that the live power is the size of the live load; None when the live load does no work."""
    v = np.where(assembly.held, 0.0, twists)
    rate = float((loads.live * v).sum())
    if not rate > 0:
        return None
    size = _live_size(assembly, loads)
    v = v * ((size if size > 0 else 1.0) / rate)
    opening, sliding = point_rates(assembly, v, position, interface)
    x = assembly.arrays
    t1 = (sliding * x.tangent_1[interface]).sum(axis=1)
    t2 = (sliding * x.tangent_2[interface]).sum(axis=1)
    return Mechanism(v, opening, np.column_stack([t1, t2]))


def resultants_from_points(
    assembly: Assembly, position: Array, interface: NDArray, area: Array, force: Array
) -> Resultants:
    """Resultants of all interfaces from contact-point forces on block b in global axes [N], shape (m, 3)."""
    x = assembly.arrays
    k = len(x.block_a)
    arm = position - x.centre[interface]
    moment = np.cross(arm, force)

    def total(vector: Array, direction: Array) -> Array:
        return np.bincount(interface, (vector * direction[interface]).sum(axis=1), k)

    return Resultants(
        total(force, x.normal),
        np.column_stack([total(force, x.tangent_1), total(force, x.tangent_2)]),
        np.column_stack([total(moment, x.tangent_1), total(moment, x.tangent_2)]),
        total(moment, x.normal), position, interface, area, force,
    )  # fmt: skip
