"""What a run writes down: samples, energies, notes; when it must look or stop."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import astuple

import numpy as np

from dem import kernels
from dem.contact.detection import SOONEST, redetect
from dem.contact.joint_renewal import pivots_on_wrong_face
from dem.contact.near import SMALL, Neighbours, farthest, near_margin, travel_per_step
from dem.model.advance import stand_back, without_arms
from dem.model.joint_marks import MARKS, joint_marks
from dem.model.pieces import Pieces, reaches
from dem.model.state import DYNAMIC, LIVE, WEIGHT, WEIGHT_X, WEIGHT_Y, State, UnstableError
from dem.model.tie_arrays import pulls
from dem.model.unbalance import SLID, Scale, slid_and_moved, unbalance
from dem.stages.debris_floor import Floor
from dem.stages.history import COLUMNS, History, RunSettings
from dem.stages.resuming import Position, RunStatus, Watch
from dem.stages.servo_note import strayed_pushes
from dem.stages.store import Samples, Store, StoredSamples
from limitmason.arrays import Array, Flags
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Drive, Ramp, Settle, Stage, Tilt

_SUMS = {
    "friction": kernels.E_FRICTION, "fracture": kernels.E_FRACTURE, "viscous": kernels.E_VISCOUS,
    "damping": kernels.E_DAMPING, "applied": kernels.E_APPLIED, "support": kernels.E_SUPPORT,
}


_NEVER = 10**9  # steps

_LET, _LOOKED = 0.5, 0.45
"""Way that a corner may travel between two searches, and after which one is made, over the margin of contacts [-].

Steps to a search are counted out to the first; what has come as far as the second has all but arrived.
"""

EXPLODES = 10.0
"""Kinetic energy, and energy from nowhere, over all there was to become kinetic, from which a run explodes [-]."""

_SLOWER = 4
"""Times as many steps that are advised where loads overshot, or blocks slipped ahead of them: chosen."""

LEAD = 0.05
"""Displacement after a ramp, over the largest one, from which blocks that went ahead of it are pointed out [-]."""

FALLEN = 2.0
"""Displacement of a block that ends a Settle, over the extent of all joints [-], which a structure is as large as."""


class Recorder:
    """Load cases with their present factors, and the samples taken so far.

    Parameters
    ----------
    assembly, loads, stages, settings : of the run
    state : that the run changes
    store : folder in which samples are kept; None for memory

    Attributes
    ----------
    cases : loads per case and block, as the kernel takes them [N, N m], shape (5, n, 6 or 15)
    scale : what unbalanced forces and displacements are small against
    blocks : numbers of the blocks whose reactions are recorded
    recorded : numbers of those whose motion is
    margin : gap up to which two blocks count as near [m]
    reach : of every block from its centroid to its farthest corner [m], shape (n,)
    every : most steps between two searches for contacts, None for no searches
    watch : when contacts must be looked for
    begun : energies and works at the beginning, by column [J]
    """

    def __init__(
        self,
        assembly: Assembly,
        loads: Loads,
        state: State,
        stages: Sequence[Stage],
        settings: RunSettings,
        store: Store | None = None,
    ) -> None:
        """Split the loads into cases that stages scale, and lay out what is recorded.

        Cases are dead load without weight, weight, live load, and weight along x and y, for tilting tables.
        """
        n = assembly.n_blocks
        self.assembly, self.state, self.stages = assembly, state, stages
        dead, live = loads.rows("dead"), loads.rows("live")
        weight = np.zeros_like(dead)
        weight[:, 2] = -assembly.weights
        weight[assembly.fixed] = 0.0
        # loads on wholly held blocks go straight to the support and do not count
        dead[assembly.fixed] = live[assembly.fixed] = 0.0
        # the part of the dead load that is weight turns with a tilting table, the rest stays; a block whose vertical
        # dead load is nearer to nothing than to its weight was given none
        own = np.where(np.abs(dead[:, 2] - weight[:, 2]) <= np.abs(dead[:, 2]), 1.0, 0.0)[:, None] * weight
        east, north = np.zeros_like(dead), np.zeros_like(dead)
        east[:, 0], north[:, 1] = -own[:, 2], -own[:, 2]
        self.cases = without_arms(np.stack([dead - own, own, live, east, north]))
        self.scale = Scale.of(assembly, dead if dead.any() else live)
        driven = [assembly.block_index(b) for s in stages if isinstance(s, Drive) for b in s.displacement]
        driven += [assembly.block_index(b) for s in stages for b in s.servo]
        # an earlier run may have left blocks held by a Drive
        held = (assembly.held | state.bodies.held).any(axis=1)
        self.blocks = np.array(sorted({*np.flatnonzero(held).tolist(), *driven}), dtype=np.intp)
        self.store = store
        self.recorded = np.arange(n) if store is None else store.recorded(assembly)
        joints = (len(assembly.interfaces) if store is None or store.joints else 0,)
        shapes: dict[str, tuple[int, ...]] = {
            "rows": (len(COLUMNS),), "reaction": (len(self.blocks), 6), "shift": (len(self.recorded), 3),
            "quaternion": (len(self.recorded), 4), **dict.fromkeys(MARKS, joints),
            "tie_force": (len(assembly.ties),),
        }
        self.samples = Samples(**shapes) if store is None else StoredSamples(store.folder, shapes)
        self.floor = Floor(assembly, state.dead)
        self.margin, self.reach = near_margin(assembly), reaches(assembly)
        self.every, self.settings, self.watch = settings.detect_every, settings, Watch(*settings.watch or ())
        self._beyond_noted = False
        self.begun = self._energies()
        self.worked = 0.0  # largest work of the loads so far [J]: a block that comes back has taken none in all
        self.notes: list[str] = list(state.warnings)
        self.same: Mapping[str, str] = {}
        self.position: Position | None = None
        self.status = RunStatus.FINISHED

    def take_up(self, history: History) -> None:
        """Go on with samples, notes and energies of an interrupted run's history."""
        self.blocks, self.notes, self.status = history.reaction_blocks, list(history.warnings), history.settings.status
        self.same = history.same
        self.samples.shapes["reaction"] = (len(self.blocks), 6)
        # scalars are one column of the samples, all others have names of their own
        table = {"rows": np.column_stack([history.scalars[c] for c in COLUMNS])}
        self.samples.take_up(table | {k: getattr(history, k) for k in self.samples.columns if k not in table})
        self._beyond_noted = any("beyond small displacement" in note for note in self.notes)
        # energies that the run began with, and the largest work since
        if history.position is not None:
            self.begun = dict(zip(self.begun, history.position.energy.tolist(), strict=True))
        applied, support = (np.abs(history.scalars[name] - self.begun[name]) for name in ("applied", "support"))
        self.worked = float((applied + support).max(initial=0.0))

    def note_slip(self, stage: Settle, done: int) -> None:
        """Say how far joints slid where the first loads acted at once and overshot.

        ``done`` are the stage's steps.
        """
        state = self.state
        # real masses overshoot in truth; where steps were taken before, these loads are not the first
        if stage.gently or state.mode == DYNAMIC or state.total[kernels.E_STEPS] != done:
            return
        slid, moved = slid_and_moved(self.assembly, state)
        if slid > SLID * moved:
            self.notes.append(
                f"joints slid by up to {slid:.2g} m, {slid / moved:.0%} of the largest displacement, while the loads "
                "came to rest: at once they overshoot, and how far joints slide hangs on the way; "
                f"Settle(gently={_SLOWER * done}) puts them on evenly"
            )

    def note_pushes(self, stage: Stage, number: int) -> None:
        """Say where jacks strayed from their forces in a stage by its number, from 0."""
        self.notes += strayed_pushes(self.assembly, stage.servo, number, self.samples.arrays(), self.blocks)

    def note_motion_after_ramp(self, ramp: Stage, shift: Array) -> None:
        """Say how far blocks moved on while loads were held to which a ramp had led.

        Parameters
        ----------
        shift : of every block when the ramp ended, shape (n, 3)
        """
        if self.state.mode == DYNAMIC or not isinstance(ramp, Ramp | Tilt):
            return
        moved = float(np.linalg.norm(self.state.bodies.shift, axis=1).max())
        on = float(np.linalg.norm(self.state.bodies.shift - shift, axis=1).max())
        if on > LEAD * moved:
            self.notes.append(
                f"blocks moved on by {on:.2g} m, {on / moved:.0%} of the largest displacement, after the ramp had "
                "ended: what slips ahead of its loads comes to rest where inertia leaves it; a ramp of "
                f"{_SLOWER * (ramp.steps or 0)} steps shows how much hangs on that"
            )

    def fallen(self, shift: Array) -> bool:
        """Whether a block has fallen farther than all joints together extend; noted.

        Parameters
        ----------
        shift : of every block at that time, shape (n, 3)
        """
        gone = np.linalg.norm(self.state.bodies.shift - shift, axis=1)
        block, size = int(gone.argmax()), float(np.linalg.norm(np.ptp(self.assembly.arrays.corners, axis=0)))
        if gone[block] <= FALLEN * size:
            return False
        self.notes.append(
            f"block {self.assembly.blocks[block].name!r} has fallen by {gone[block]:.2g} m, {FALLEN:g} times the "
            "extent of all joints: it does not come to rest"
        )
        return True

    def hold_landed(self, held: Flags) -> bool:
        """Hold and note the blocks landed since the last call; True where there are any.

        Parameters
        ----------
        held : freedoms that stay held when the stage ends, shape (n, 6), changed in place
        """
        met = self.floor.hold_landed(self.state, held)
        self.notes += [
            f"block {self.assembly.blocks[k].name!r} fell to the floor, the lowest corner of the supports, at "
            f"{self.state.time:.3g} s: it lies where it met it and goes with the ground; what it would do there is not "
            "followed" for k in met.tolist()
        ]
        return bool(len(met))

    def _beyond(self) -> bool:
        """Whether blocks have moved so far that contacts may be others than the first.

        When that is seen first, it is noted.
        """
        block, moved = farthest(self.assembly, self.state, self.reach)
        beyond, names = moved > SMALL * self.margin, [block]
        if beyond:
            # blocks that went along with their neighbours have the contacts they had: what counts is how pairs that
            # are near have moved against each other, and pairs that are near no longer
            around = Neighbours.of(self.assembly, self.state, Pieces.of(self.assembly), self.margin, since=None)
            due = np.flatnonzero(around.due() & ~(around.new & around.apart))
            beyond = bool(len(due) or len(around.gone))
            if len(due):
                worst = due[around.moved[due].argmax()]
                names, moved = around.near.blocks[worst].tolist(), float(around.moved[worst])
        if beyond and not self._beyond_noted:
            self._beyond_noted = True
            words = " and ".join(repr(self.assembly.blocks[b].name) for b in names)
            what = (
                "contacts were kept as they were (detect_every=None): where blocks have left them, or meet others, the "
                "forces are wrong"
                if self.every is None
                else f"contacts are searched for from there on, at most {self.every} steps apart"
            )
            step = self.state.total[kernels.E_STEPS]
            against = " against each other" if len(names) > 1 else ""
            self.notes.append(
                f"block{'s' * (len(names) > 1)} {words} had moved by {moved:.2g} m{against}, beyond small "
                f"displacement, at step {step:.0f}: {what}"
            )
        # a state that was continued may have contacts that were found anew already
        return beyond or bool((self.state.interface < 0).any())

    def steps_to_look(self) -> int:
        """Steps that may be taken before :meth:`look` must be asked again.

        No corner may travel more than half the margin in them. While contacts are searched for, see
        ``resuming.Watch``, they end ``every`` steps after the last search too, and when open edges are due.
        """
        if self.every is None:
            return _NEVER
        # way that is left to the fastest corner, and its way in a step [m]
        left = _LET * self.margin - self.watch.travelled
        step = travel_per_step(self.state, self.reach)
        steps = int(min(left / step, _NEVER)) if step > 0.0 else _NEVER
        if self.watch.searching:
            steps = min(steps, self.every - self.watch.since, self.watch.due - self.watch.since)
        return max(1, steps)

    def look(self, steps: int) -> None:
        """Search for contacts when it is time to, ``steps`` after the last call."""
        if self.every is None:
            return
        watch = self.watch
        watch.since += steps
        watch.travelled += steps * travel_per_step(self.state, self.reach)
        far = watch.travelled > _LOOKED * self.margin
        if not watch.searching:
            if far:
                watch.travelled = 0.0
                self.start_looking()
        elif watch.since >= self.every or far:
            self._detect()
        # open edges and corners alone, whose time comes before that of a search of all pairs
        elif watch.since >= watch.due:
            self._detect(sharp=True)

    def _energies(self) -> dict[str, float]:
        """Energies and works now, by column [J].

        Kinetic energy is that of the velocities half a step ago.
        """
        state = self.state
        now = {"kinetic": state.energy_of_motion(), "elastic": state.measured(self.assembly).elastic_energy}
        return now | {c: float(state.total[k]) for c, k in _SUMS.items()}

    def start(self) -> None:
        """Begin: real masses at rest under loads, and contacts of blocks that have moved."""
        state = self.state
        if isinstance(self.samples, StoredSamples):
            self.samples.begin()
        still = not (state.bodies.vel.any() or state.bodies.ang.any())
        if state.mode == DYNAMIC and state.total[kernels.E_STEPS] == 0.0 and still:
            stand_back(state, self.assembly, np.tensordot(state.factors, self.cases, 1))
            self.begun = self._energies()
        if state.total[kernels.E_STEPS] == 0.0:
            state.total[kernels.E_BEGUN] = self.begun["kinetic"] + self.begun["elastic"]
        # what goes on from a history searches when that would have
        if self.settings.watch is None:
            self.start_looking()

    def start_looking(self) -> None:
        """Begin to search where blocks have moved beyond small displacement already."""
        if self.every is not None and self._beyond():
            self.watch.searching = True
            self._detect()

    def _detect(self, *, sharp: bool = False) -> None:
        """Search for contacts, of corners alone where ``sharp``, and set the next search."""
        notes, soonest = redetect(self.assembly, self.state, Pieces.of(self.assembly), margin=self.margin, sharp=sharp)
        self.notes += notes
        if not sharp:
            self.watch.since, self.watch.travelled = 0, 0.0
        self.watch.due = self.watch.since + max(SOONEST, int(min(soonest / self.state.dt, self.every or 0)))

    def add(self, state: State, stage: int) -> dict[str, float]:
        """Record a sample, and return it by column.

        A state in which energy appears from nowhere is refused.

        Parameters
        ----------
        state : of the blocks now
        stage : number of the stage, from 0

        Raises
        ------
        UnstableError
            Where kinetic energy is far more than the run began with or was given.
        """
        now = state.measured(self.assembly)
        sums = state.total
        force, moment = unbalance(state, self.scale)
        marks = joint_marks(state, now, len(self.assembly.interfaces))
        factors = state.factors
        row = {
            "time": state.time,
            "step": float(sums[kernels.E_STEPS]),
            "stage": float(stage),
            "multiplier": float(factors[LIVE]),
            "tilt": float(np.arctan2(np.hypot(factors[WEIGHT_X], factors[WEIGHT_Y]), factors[WEIGHT])),
            "unbalanced force": force,
            "unbalanced moment": moment,
            "kinetic": float(sums[kernels.E_KINETIC]),
            "elastic": now.elastic_energy,
            **{c: float(sums[k]) for c, k in _SUMS.items()},
            "largest opening": float(now.opening.max(initial=0.0)),
            "largest slip": float(np.linalg.norm(now.slip, axis=1).max(initial=0.0)),
        }
        if self.every is None:
            self._beyond()
        elif not self.watch.searching and pivots_on_wrong_face(self.assembly, state, now):
            self._detect()
        worked = abs(row["applied"] - self.begun["applied"]) + abs(row["support"] - self.begun["support"])
        self.worked = max(self.worked, worked)
        # all energy that could have become kinetic, not quite zero as others are divided by it
        size = max(self.begun["kinetic"] + self.begun["elastic"] + self.worked, 1e-300)
        # energy from nowhere: what is stored, lost and in motion, less the work that brought it in
        created = sum((row[c] - self.begun[c]) * (-1.0 if c in ("applied", "support") else 1.0) for c in self.begun)
        explodes = row["kinetic"] > EXPLODES * size and created > EXPLODES * size
        keeps_joints = self.store is None or self.store.joints
        if not explodes or not len(self.samples):  # of an explosion nothing is kept behind what was there before
            self.samples.add(
                rows=[row[c] for c in COLUMNS],
                # what the support adds so that the held degrees of freedom follow their prescribed motion
                reaction=np.where(state.bodies.held, -state.bodies.net, 0.0)[self.blocks],
                shift=state.bodies.shift[self.recorded], quaternion=state.bodies.quat[self.recorded],
                **(vars(marks) if keeps_joints else dict.fromkeys(MARKS, ())),
                tie_force=pulls(state.ties, state.bodies),
            )
        if explodes:
            raise UnstableError(
                f"energy explodes at step {row['step']:.0f}: kinetic {row['kinetic']:.3g} J against {size:.3g} J that "
                "the run began with or was given by the loads; the time step is too long for the stiffness of the "
                "joints"
            )
        return row

    def history(self, status: RunStatus) -> History:
        """History of all samples so far, and the state to go on from.

        ``status`` says how the run has ended, or that it has not.
        """
        columns = self.samples.arrays()
        table = columns.pop("rows")
        watched = None if self.every is None else astuple(self.watch)
        return History(
            self.assembly, status, {c: table[:, i].copy() for i, c in enumerate(COLUMNS)}, reaction_blocks=self.blocks,
            state=self.state, stages=tuple(s.name or type(s).__name__ for s in self.stages),
            warnings=tuple(dict.fromkeys(self.notes)), factors=tuple(self.state.factors.tolist()),
            position=copy.deepcopy(self.position), settings=self.settings._replace(status=self.status, watch=watched),
            same=self.same, store=self.store, recorded=self.recorded, **columns,
        )
