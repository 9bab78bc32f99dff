"""Steps of the kernel in chunks: under constant or tabulated loads, and from velocities half a step back."""

import numpy as np

from dem import kernels
from dem.model.shared_steps import shared_advance
from dem.model.state import DYNAMIC, State, UnstableError
from dem.model.unbalance import CALM
from limitmason.arrays import Array
from limitmason.geometry.rotation import axial
from limitmason.model import Assembly
from limitmason.model.stages import Damping


def run(
    state: State,
    cases: Array,
    factors: Array,
    damping: Damping,
    drives: Array | None = None,
    speeds: Array | None = None,
) -> None:
    """Advance by ``len(factors)`` steps and check that the state is finite.

    Parameters
    ----------
    state : changed
    cases : loads per case and block, as ``Acting`` takes them [N, N m], shape (c, n, 15 or 6)
    factors : of the cases in every step, shape (steps, c)
    damping : artificial damping of the steps
    drives : twists of driven blocks, shape (d, n, 6); None without drives
    speeds : their factors in every step, shape (steps, d)

    Raises
    ------
    UnstableError
        When a displacement or velocity is no longer finite; the message names the block.
    """
    steps = len(factors)
    # without combined damping the kernel is compiled without it; with it, it acts while motion is steady
    drifts = bool(state.total[kernels.E_KINETIC] < CALM * state.forces().elastic_energy) if damping.combined else None
    if drives is None or speeds is None:
        drives, speeds = np.zeros((0, cases.shape[1], 6)), np.zeros((steps, 0))
    # copies: to the compiler loads that may not be written are another type, and the kernel is compiled twice
    acting = kernels.Acting(*(np.array(v, dtype=float, order="C") for v in (cases, factors, drives, speeds)))
    scheme = kernels.Scheme(
        dt=float(state.dt), true_inertia=state.mode == DYNAMIC, local=float(damping.local),
        adaptive=float(damping.adaptive), kinetic_stop=damping.kinetic,
    )
    shared_advance(state, acting, scheme, drifts)
    state.time += steps * state.dt
    b = state.bodies
    of_modes = np.zeros((len(b.mass), 0)) if state.modes is None else state.modes.value
    finite = np.isfinite(np.concatenate([b.shift, b.quat, b.vel, b.ang, of_modes], axis=1)).all(axis=1)
    if not (finite.all() and np.isfinite(state.total).all()):
        raise UnstableError(
            f"the state of block number {np.argmin(finite)} is not finite at step {state.total[kernels.E_STEPS]:.0f}: "
            "the time step is too long for the stiffness, or a load is not finite"
        )


def run_constant(state: State, wrench: Array, steps: int, damping: Damping) -> None:
    """Advance by a number of steps under constant loads.

    ``wrench`` are the loads of every block [N, N m], shape (n, 15 or 6).
    """
    run(state, wrench[None], np.ones((steps, 1)), damping)


def without_arms(cases: Array) -> Array:
    """Loads of cases without their nine arms where all are zero.

    That is fewer numbers for every block and step.

    ``cases`` has shape (..., 15), and what is returned (..., 15 or 6).
    """
    return cases if cases[..., 6:].any() else cases[..., :6]


def stand_back(state: State, assembly: Assembly, wrench: Array) -> None:
    """Give blocks at rest the velocities of half a step ago.

    Under the force F of loads, joints and ties they are v(-1/2) = -dt F / (2 m). The first step then leads to
    v(1/2) = dt F / (2 m), and x(n) is that of time n dt. A whole step from rest would be half a step ahead for good.

    Parameters
    ----------
    state, assembly : state at rest, whose velocities are changed, and its blocks
    wrench : force and moment about the centroid of every block [N, N m], and the nine arms of its load [N m] where
        loads have them, shape (n, 6 or 15)
    """
    b, now = state.bodies, state.measured(assembly)
    wrench, arms, place = wrench[:, :6].copy(), wrench[:, 6:].reshape(-1, 3, 3), assembly.centroids + b.shift
    if len(arms):
        # moment of the loads as their points have turned with the block
        wrench[:, 3:] += axial(b.rot @ arms)
    if len(state.ties.block_a):
        # on copies: no tie yields before the first step
        pulled, ties = b._replace(contact=np.zeros_like(b.contact)), state.ties
        kernels.add_tie_forces(ties._replace(plastic=ties.plastic.copy()), pulled, np.zeros(kernels.E_SIZE))
        wrench += pulled.contact
    # forces of the joints act on b, and the opposite ones on a
    for block, sign in ((state.joints.block_a[now.owner], -1.0), (state.joints.block_b[now.owner], 1.0)):
        turning = np.cross(now.position - place[block], now.force)
        np.add.at(wrench, block, sign * np.concatenate([now.force, turning], axis=1))
    impulse = np.where(b.held, 0.0, -0.5 * state.dt * wrench)
    rot = b.rot + np.eye(3)
    b.vel[:] = impulse[:, :3] * b.inv_mass[:, None]
    b.ang[:] = impulse[:, 3:]
    # Omega = R J^-1 R^T L
    b.spin[:] = np.einsum("nij,njk,nlk,nl->ni", rot, b.inv_inertia, rot, b.ang)
