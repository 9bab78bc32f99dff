"""Collapse multiplier by the DEM: equilibrium-checked increments, or a slow ramp read at the supports."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.joints import JointOptions
from dem.state import QUASI_STATIC, State, make_state
from dem.stepping import (
    EQUILIBRIUM,
    MOVING,
    UNDECIDED,
    Damping,
    Scale,
    Verdict,
    displacement_since,
    hold,
    run,
)
from limitmason.certificate import certify, scaled_mechanism
from limitmason.model import Assembly, Loads
from limitmason.results import CANNOT_STAND, NOT_CONVERGED, SOLVED, UNBOUNDED, Mechanism, Prediction

Array = NDArray[np.float64]
Grid = tuple[int, int]

INCREMENTS, RAMP = "increments", "ramp"
CHECKS = ("stiffness", "contact points", "rate")

SETTLING = Damping(local=0.8)
LOADING = Damping(local=0.4, kinetic=True)
RAMPING = Damping(local=0.5)


@dataclass(frozen=True)
class Controls:
    """Numerical settings of a search; see :func:`collapse` for those not explained here."""

    tolerance: float
    max_steps: int
    moved_limit: float  # of the smallest block dimension [-]
    equilibrium: float  # largest tolerance of unbalanced forces over the mean block load [-]
    damping: Damping
    ramp_steps: int
    progress: Callable[[float, Verdict], object] | None = None


@dataclass
class Search:
    """Outcome of a search: bracket, where it ended, and the record of every load tried."""

    stable: float
    moving: float
    status: str
    state: State
    mechanism: Mechanism | None
    record: list[tuple[float, Verdict]]
    steps: int
    details: dict[str, Any]


def collapse(
    assembly: Assembly,
    loads: Loads,
    *,
    contact_points: Grid | Mapping[str, Grid] = (4, 8),
    contact_model: str = "grid",
    method: str = INCREMENTS,
    tolerance: float = 5e-3,
    error_budget: tuple[str, ...] = (),
    joint_options: JointOptions | None = None,
    first_increment: float | None = None,
    max_steps: int = 60_000,
    moved_limit: float = 0.02,
    equilibrium: float = 1e-4,
    ramp_steps: int = 40_000,
    damping: Damping | None = None,
    progress: Callable[[float, Verdict], object] | None = None,
) -> Prediction:
    """Collapse multiplier of an assembly by the explicit distinct element method, quasi-static.

    The structure settles under the dead load and the live load grows until the blocks keep moving.

    Parameters
    ----------
    contact_points : points along the unit and across the thickness of every interface, one pair or one per kind
        ("bed", "head", "base"); at psi < phi torsion needs about 8 across
    contact_model : "grid", or "vertices" for corners only
    method : "increments" holds each load until force and moment are small in four checks in a row, restores the last
        equilibrium when the blocks keep moving and halves the increment; "ramp" raises the load steadily, reads the
        largest multiplier at the supports as max(Rh / Rv) does, and repeats at half speed until it changes by < 1 %
    tolerance : width of the final bracket over the multiplier [-]
    error_budget : which of "stiffness" (kn, ks x 10), "contact points" (x 2) and "rate" (increments or ramp at half
        speed) to repeat the search with; the changes are in ``details["error budget"]``
    joint_options : limits of dilation, softening lengths
    first_increment : first step of the multiplier; a twentieth of that at which live equals dead load by default
    max_steps : budget for one load; when it runs out the load is "undecided", never counted as stable
    moved_limit : displacement that counts as collapse, over the smallest block dimension [-]
    equilibrium : largest unbalanced force and moment over the mean block load [-]; a twentieth of the load increment
        where that is less
    ramp_steps : steps in which a ramp reaches the estimate of the multiplier
    progress : called with every load tried and its verdict
    damping : while loading; local 0.4 with stops at peaks of kinetic energy (increments) or local 0.5 (ramp)

    Returns
    -------
    Prediction
        ``collapse_multiplier`` is the largest load found in equilibrium (increments) or the largest one measured at
        the supports (ramp); ``details`` holds the bracket, every load tried, undecided loads and the error budget.

    Raises
    ------
    ValueError
        For unknown methods or checks, no live load, and what :func:`dem.state.make_state` refuses.

    Notes
    -----
    The flow rule is that of the joints: psi = 0 unless they dilate. Finite stiffness lowers the multiplier of slender
    walls (bending before collapse), and torsion depends on the contact points: ask for the error budget. It is an
    estimate, not a bound. Source of the procedure: Godio, Stefanou, Sab 2017, eq. 5.
    """
    if method not in (INCREMENTS, RAMP):
        raise ValueError(f"method must be {INCREMENTS!r} or {RAMP!r}, got {method!r}")
    for check in error_budget:
        if check not in CHECKS:
            raise ValueError(f"unknown check {check!r} in error_budget; known: {', '.join(CHECKS)}")
    unit = _unit(assembly, loads)
    if not tolerance > 0:
        raise ValueError(f"tolerance must be positive, got {tolerance!r}")
    begun = time.perf_counter()
    controls = Controls(
        tolerance, max_steps, moved_limit, equilibrium, damping or (LOADING if method == INCREMENTS else RAMPING),
        ramp_steps, progress,
    )  # fmt: skip
    options = joint_options or JointOptions()
    model = {"contact_points": contact_points, "contact_model": contact_model}
    increment = first_increment if first_increment is not None else 0.05 * unit

    def one(changed: Mapping[str, Any], law: JointOptions, speed: float, guess: float | None) -> Search:
        state = make_state(assembly, loads, **{**model, **changed}, joint_options=law, mode=QUASI_STATIC)
        if method == INCREMENTS:
            return _increments(assembly, loads, state, controls, speed * increment, unit, speed, guess)
        return _ramps(assembly, loads, state, controls, increment, unit, speed, guess)

    found = one({}, options, 1.0, None)
    budget: dict[str, dict[str, float]] = {}
    warnings = list(found.state.warnings)
    if found.status == SOLVED:
        for check in error_budget:
            law, changed, speed = options, {}, 1.0
            if check == "stiffness":
                law = replace(options, stiffness_factor=10.0 * options.stiffness_factor)
            elif check == "contact points":
                changed = {"contact_points": _doubled(contact_points), "contact_model": "grid"}
            else:
                speed = 0.5
            again = one(changed, law, speed, found.stable)
            budget[check] = {
                "multiplier": again.stable,
                "change": again.stable / found.stable - 1.0 if found.stable else float("nan"),
                "steps": again.steps,
            }
            if abs(budget[check]["change"]) > 0.03 or again.status != SOLVED:
                warnings.append(
                    f"the multiplier changes by {100 * budget[check]['change']:+.1f} % with {check} changed "
                    f"({again.status}): it is not converged in this respect"
                )
    if "interrupted" in found.details:
        warnings.append(f"interrupted while holding {found.details['interrupted']:.5g}: the bracket is not closed")
    undecided = [value for value, verdict in found.record if verdict.outcome == UNDECIDED]
    if undecided and found.status == SOLVED:
        warnings.append(
            f"undecided after {max_steps} steps at {', '.join(f'{u:.5g}' for u in undecided)}; not counted as stable"
        )
    prediction = Prediction(
        method=f"dem, {method}",
        collapse_multiplier=found.stable if found.status in (SOLVED, NOT_CONVERGED) else
        float("inf") if found.status == UNBOUNDED else float("nan"),
        bound="estimate for joints of finite stiffness with their own dilatancy angles",
        status=found.status,
        resultants=found.state.resultants(assembly) if found.status in (SOLVED, NOT_CONVERGED) else None,
        warnings=tuple(warnings),
        provenance={
            "method": method, "contact points": contact_points, "contact model": contact_model,
            "tolerance": tolerance, "steps": found.steps, "seconds": time.perf_counter() - begun,
            "damping": controls.damping, "moved limit": moved_limit,
        },
        details={
            "largest stable": found.stable, "smallest moving": found.moving, "undecided": undecided,
            "loads tried": [(value, v.outcome, v.steps) for value, v in found.record], "error budget": budget,
            **found.details,
        },
    )  # fmt: skip
    if prediction.resultants is not None and method == INCREMENTS:
        prediction = replace(prediction, certificate=certify(assembly, loads, prediction))
    return replace(prediction, mechanism=found.mechanism)


def _unit(assembly: Assembly, loads: Loads) -> float:
    """Multiplier at which the live load equals the dead load, the natural scale of the search."""
    if len(loads.dead) != assembly.n_blocks:
        raise ValueError(f"loads are for {len(loads.dead)} blocks, the assembly has {assembly.n_blocks}")
    moves = ~assembly.held
    size = np.r_[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    dead = np.linalg.norm(loads.dead * moves * size, axis=1).sum()
    live = np.linalg.norm(loads.live * moves * size, axis=1).sum()
    if live == 0.0:
        length = np.cbrt(assembly.arrays.volume)[:, None]
        live = np.linalg.norm((loads.live * moves)[:, 3:] / length, axis=1).sum()
    if live == 0.0:
        raise ValueError("no live load acts on a free degree of freedom: there is nothing to multiply")
    return float(dead / live) if dead > 0 else 1.0


def _doubled(grid: Grid | Mapping[str, Grid]) -> Any:
    if isinstance(grid, Mapping):
        return {k: (2 * a, 2 * b) for k, (a, b) in grid.items()}
    return (2 * grid[0], 2 * grid[1])


def _settle(assembly: Assembly, loads: Loads, state: State, scale: Scale, c: Controls) -> Verdict:
    return hold(
        state, loads.dead, scale, SETTLING, tolerance=min(1e-6, c.equilibrium),
        limit=2.5 * c.moved_limit * scale.smallest, max_steps=c.max_steps,
    )  # fmt: skip


def _increments(
    assembly: Assembly, loads: Loads, state: State, c: Controls, step: float, unit: float, speed: float,
    guess: float | None,
) -> Search:
    """Bracket of the multiplier by loads held one after the other; ``guess`` narrows the start of a repetition."""
    scale = Scale.of(assembly, loads.dead if loads.dead.any() else loads.live * unit)
    record: list[tuple[float, Verdict]] = []
    verdict = _settle(assembly, loads, state, scale, c)
    record.append((0.0, verdict))
    used = verdict.steps
    if verdict.outcome != EQUILIBRIUM:
        status = CANNOT_STAND if verdict.outcome == MOVING else NOT_CONVERGED
        return Search(float("nan"), 0.0, status, state, None, record, used, {})
    stable, refused, moving = 0.0, np.inf, np.inf
    mechanism, start, patience, refused_from = None, step, verdict.steps, 0.0
    if guess:
        step = 0.5 * speed * guess
    while True:
        if np.isfinite(refused):
            width = c.tolerance * max(abs(stable), 1e-3 * unit)
            if refused - stable <= width:
                if stable - refused_from <= 4.0 * width:
                    break
                # the load was refused after a long stride: from close by it may hold after all
                new = refused
            else:
                new = min(stable + step, 0.5 * (stable + refused)) if speed < 1.0 else 0.5 * (stable + refused)
        else:
            new = stable + step
            if new > 1e3 * unit:
                return Search(stable, np.inf, UNBOUNDED, state, None, record, used, {})
        keep = state.copy()
        gap = new - stable
        try:
            verdict = hold(
                state, loads.dead + new * loads.live, scale, c.damping,
                tolerance=min(c.equilibrium, 0.05 * gap / unit), limit=c.moved_limit * scale.smallest,
                max_steps=c.max_steps, patience=patience,
            )  # fmt: skip
            used += verdict.steps
            record.append((float(new), verdict))
            if c.progress is not None:
                c.progress(float(new), verdict)
        except KeyboardInterrupt:
            # what was found so far stands: the largest load in equilibrium, and a bracket that is not closed
            note = {"interrupted": float(new)}
            return Search(float(stable), float(moving), NOT_CONVERGED, keep, mechanism, record, used, note)
        if verdict.outcome == EQUILIBRIUM:
            patience = max(patience, verdict.steps)
            if new >= refused:
                # reopen the bracket: up to the next refused load, or upwards again
                above = [x for x, v in record if v.outcome != EQUILIBRIUM and x > new]
                refused, step = min(above, default=np.inf), gap
                moving = min((x for x, v in record if v.outcome == MOVING and x > new), default=np.inf)
                refused_from = 0.0
            stable = new
            if not np.isfinite(refused):
                # the first climb takes longer strides, to a quarter of the load, a repetition ever shorter ones
                longest = max(2.0 * start, 0.25 * stable)
                step = step * 0.5 if guess and stable > 0.7 * guess else step if guess else min(1.5 * step, longest)
            state.stop()
        else:
            if verdict.outcome == MOVING:
                moving = min(moving, new)
                mechanism = _mechanism(assembly, loads, state)
            refused, refused_from = new, stable
            if speed < 1.0:
                step = 0.5 * gap
            state = keep
    status = SOLVED if np.isfinite(moving) else NOT_CONVERGED
    return Search(float(stable), float(moving), status, state, mechanism, record, used, {})


def _mechanism(assembly: Assembly, loads: Loads, state: State) -> Mechanism | None:
    """Velocities of the moving state as a mechanism; None when it does not move along the live load."""
    now = state.resultants(assembly)
    twists = np.concatenate([state.bodies.vel, state.bodies.spin], axis=1)
    if not twists.any():
        return None
    return scaled_mechanism(assembly, loads, twists, now.point_position, now.point_interface)


def _ramps(
    assembly: Assembly, loads: Loads, start: State, c: Controls, step: float, unit: float, speed: float,
    guess: float | None,
) -> Search:
    """Ramps at falling speed until the largest multiplier at the supports changes by less than 1 %."""
    scale = Scale.of(assembly, loads.dead if loads.dead.any() else loads.live * unit)
    verdict = _settle(assembly, loads, start, scale, c)
    record, used = [(0.0, verdict)], verdict.steps
    if verdict.outcome != EQUILIBRIUM:
        status = CANNOT_STAND if verdict.outcome == MOVING else NOT_CONVERGED
        return Search(float("nan"), 0.0, status, start, None, record, used, {})
    steps = c.ramp_steps / speed
    rate = (guess if guess else 10.0 * step) / steps
    values: list[tuple[float, float]] = []
    for _ in range(8):
        state = start.copy()
        peak, taken, moved = _one_ramp(assembly, loads, state, scale, c, rate)
        used += taken
        values.append((rate, peak))
        record.append((peak, Verdict(MOVING if moved else UNDECIDED, taken, (np.nan, np.nan), c.moved_limit)))
        if not moved:
            return Search(peak, np.inf, NOT_CONVERGED, state, None, record, used, {"ramps": values})
        if guess or (len(values) > 1 and abs(values[-1][1] / values[-2][1] - 1.0) < 0.01):
            break
        # the first ramp only finds the scale: from then on the multiplier is reached in ramp_steps and twice as many
        rate = peak / steps if len(values) == 1 and rate > peak / steps else 0.5 * rate
    else:
        return Search(values[-1][1], np.inf, NOT_CONVERGED, state, None, record, used, {"ramps": values})
    mechanism = _mechanism(assembly, loads, state)
    return Search(values[-1][1], values[-1][1], SOLVED, state, mechanism, record, used, {"ramps": values})


def _one_ramp(
    assembly: Assembly, loads: Loads, state: State, scale: Scale, c: Controls, rate: float
) -> tuple[float, int, bool]:
    """Largest multiplier at the supports while the live load rises by ``rate`` per step until the blocks have moved."""
    cases = np.stack([loads.dead, loads.live])
    moves = ~assembly.held[:, :3]
    dead = (loads.dead[:, :3] * moves).sum(axis=0)
    live = (loads.live[:, :3] * moves).sum(axis=0)
    if not np.linalg.norm(live) > 1e-9 * np.abs(loads.live[:, :3]).sum():
        raise ValueError("the live loads have no resultant: a ramp cannot read the multiplier at the supports")
    shift, quat = state.bodies.shift.copy(), state.bodies.quat.copy()
    value, taken, chunk = 0.0, 0, 50
    window: list[float] = []
    peak = 0.0
    for _ in range(int(c.max_steps * 20 / chunk)):
        factors = np.ones((chunk, 2))
        factors[:, 1] = value + rate * np.arange(1, chunk + 1)
        value = factors[-1, 1]
        run(state, cases, factors, c.damping)
        taken += chunk
        # what the joints hand to the supports, less the dead load, along the live load
        support = (state.bodies.contact[:, :3] * ~moves).sum(axis=0)
        window.append(float((support - dead) @ live / (live @ live)))
        if len(window) >= 5:
            peak = max(peak, float(np.median(window[-5:])))
        if displacement_since(state, shift, quat, scale) > 5.0 * c.moved_limit * scale.smallest:
            return peak, taken, True
    return peak, taken, False


