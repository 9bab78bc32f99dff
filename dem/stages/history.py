"""What a simulation recorded: displacements, reactions, energies, cracks, its end.

The record that shakes the ground is ``limitmason.model.base_motion``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dem.contact.near import on_ground
from dem.kernels import E_BEGUN
from dem.model.joint_marks import MARKS, JointMarks, first_opening
from dem.model.joints import losses
from dem.model.state import DYNAMIC, State
from dem.model.vibration import state_system
from dem.papers import PAPERS
from dem.stages.debris_floor import Floor
from dem.stages.resuming import Position, RunStatus, check_continues
from dem.stages.store import CHECKPOINT, Store, StoredSamples
from limitmason.answers.curve import Curve
from limitmason.answers.references import data_behind
from limitmason.arrays import Array, Index
from limitmason.checks import positive
from limitmason.display.notebook import Displayed
from limitmason.errors import InputError
from limitmason.geometry.rotation import rotation_matrices, rotation_vectors
from limitmason.model import Assembly
from limitmason.model.input import read_direction
from limitmason.model.stages import Damping
from limitmason.storage.csv_table import Tabular
from limitmason.storage.files import as_json, named_path, of_json, read_archive, write_archive
from limitmason.storage.frozen import ReadOnly
from limitmason.vibration.system import VibratingSystem

COLUMNS = {
    "time": "s",
    "step": "-",
    "stage": "-",
    "multiplier": "-",
    "tilt": "rad",
    "unbalanced force": "-",
    "unbalanced moment": "-",
    "kinetic": "J",
    "elastic": "J",
    "friction": "J",
    "fracture": "J",
    "viscous": "J",
    "damping": "J",
    "applied": "J",
    "support": "J",
    "largest opening": "m",
    "largest slip": "m",
}
"""Recorded scalars and their units; in quasi-static mode time counts steps and kinetic energy is of scaled masses."""


OVERTURNED = np.radians(60.0)
"""Turn beyond which a block counts as overturned [rad]: past atan(b / h), where all fall that are h > .6 b high."""

_NO_WORK = 1e-300  # what an energy is over where no load has done work yet [J]

_ARRAYS = ("reaction", "reaction_blocks", "shift", "quaternion", *MARKS)


class RunSettings(NamedTuple):
    """How a run was made, as :func:`dem.simulate` was told, and how stages had gone.

    ``stages`` are texts by which other stages are told apart, ``status`` is how those that are over have ended and
    ``watch`` the numbers of :class:`dem.stages.resuming.Watch`, None where nobody has looked for contacts yet.
    """

    sample: int | float = 1
    damping: Damping | None = None
    stages: tuple[str, ...] = ()
    detect_every: int | None = None
    status: RunStatus = RunStatus.FINISHED
    watch: Sequence[Any] | None = None


@dataclass(frozen=True, eq=False)
class History(Displayed, JointMarks, Tabular, ReadOnly):
    """Record of a simulation.

    Parameters
    ----------
    assembly : what was simulated
    status : "finished", "interrupted", "not settled" or "unstable", a ``RunStatus``
    scalars : one array per entry of ``COLUMNS``, shape (samples,)
    reaction : force and moment about the block's centroid that the support (or drive) exerts on each recorded block,
        [N, N m], shape (samples, r, 6)
    reaction_blocks : numbers of the recorded blocks
    shift, quaternion : displacement of the centroid [m] and rotation of every block, shapes (samples, n, 3), (.., 4)
    opening : largest opening in every interface [m], shape (samples, k); NaN where contacts were found anew
    slip, crushed, used, failed : largest plastic slip and crushing [m], largest part of the strength in use and part of
        the area that has reached it [-] in every interface, shape (samples, k), see :mod:`dem.model.joint_marks`
    factors : of the load cases at the end
    state : where the simulation ended, with its loads, factors and laws; pass it, or the history, to
        ``simulate(start=...)`` for further stages
    tie_force : tension in every tie of the assembly [N], shape (samples, t)
    position, settings : where in its stages a run was cut off, and how it was run, for :func:`dem.resume`
    store, recorded : folder in which the samples are, None for those in memory; numbers of the blocks in ``shift`` and
        ``quaternion``, all where none were chosen
    same : digests by name of what a run that takes up the file must have in common with this one; runs that start from
        a history keep those of it
    """

    assembly: Assembly
    status: RunStatus
    scalars: Mapping[str, Array]
    reaction: Array
    reaction_blocks: Index
    shift: Array
    quaternion: Array
    state: State
    stages: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    factors: tuple[float, ...] = ()
    position: Position | None = None
    settings: RunSettings = field(default_factory=RunSettings)
    tie_force: Array = field(default_factory=lambda: np.zeros((0, 0)))
    same: Mapping[str, str] = field(default_factory=dict)
    store: Store | None = None
    recorded: Index | None = None

    def save(self, path: str | Path) -> None:
        """Write everything but the assembly to a numpy archive at a path.

        The file is whole, or the one that was there before. Samples that are in a store are not written to its own
        checkpoint again.
        """
        own = self.store is not None and named_path(path) == self.store.checkpoint  # samples are in the store's files
        arrays: dict[str, Any] = {f"state.{k}": v for k, v in self.state.arrays().items()}
        arrays |= {f"scalar.{k}": v for k, v in self.scalars.items()}
        arrays |= {} if own else {k: getattr(self, k) for k in (*_ARRAYS, "tie_force")}
        arrays |= self.position.arrays() if self.position is not None else {}
        settings = self.settings._asdict()
        if self.settings.damping is not None:
            settings["damping"] = asdict(self.settings.damping)
        words = {name: getattr(self, name) for name in ("status", "stages", "warnings", "factors")}
        write_archive(path, arrays | {
            "reaction_blocks": self.reaction_blocks, "recorded": self._blocks,
            "words": as_json(words | {"settings": settings}), "same": as_json(dict(self.same)),
        })

    @classmethod
    def load(cls, path: str | Path, assembly: Assembly) -> History:
        """Read a history that was saved, or that a run has written on its way.

        Samples in a folder are read when they are looked at.

        Parameters
        ----------
        path : file written by :meth:`save`, checkpoint of a run, or folder of a :class:`dem.Store`
        assembly : the one that was simulated; files hold no geometry

        Raises
        ------
        InputError
            For an assembly with other blocks, interfaces or joint laws, and a file that lacks something, by name.
        """
        folder = place if (place := named_path(path)).is_dir() else None  # of a store: its samples are files
        file = read_archive(place if folder is None else folder / CHECKPOINT)
        state = State.from_arrays(file.group("state"), path)
        check_continues(assembly, state, state.loads, options=None)
        recorded, store = file["recorded"].astype(np.intp), None
        samples = {k: file[k] for k in (*_ARRAYS, "tie_force")} if folder is None else {}
        if folder is not None:
            stored = StoredSamples.read(folder, len(file["scalar.step"]))
            samples = {k: v for k, v in stored.arrays().items() if k != "rows"}
            samples["reaction_blocks"] = file["reaction_blocks"]
            chosen = None if len(recorded) == assembly.n_blocks else tuple(recorded.tolist())
            # a store without marks of joints has entries without numbers
            store = Store(folder, chosen, joints=stored.shapes["opening"] == (len(assembly.interfaces),))
        words = of_json(file, "words")
        settings = words["settings"]
        damping = None if settings["damping"] is None else Damping(**settings["damping"])
        settings |= {"damping": damping, "stages": tuple(settings["stages"]), "status": RunStatus(settings["status"])}
        return cls(
            assembly, RunStatus(words["status"]), {c: file[f"scalar.{c}"] for c in COLUMNS}, state=state,
            **samples, store=store, recorded=recorded, position=Position.from_arrays(file),
            stages=tuple(words["stages"]), warnings=tuple(words["warnings"]), factors=tuple(words["factors"]),
            settings=RunSettings(**settings), same=of_json(file, "same"),
        )

    def __getitem__(self, name: str) -> Array:
        """A recorded scalar by its name in ``COLUMNS``."""
        if name not in self.scalars:
            raise InputError(f"a history records {', '.join(self.scalars)}; got {name!r}")
        return self.scalars[name]

    def tabulated(self) -> tuple[Mapping[str, str], list[Sequence[Any]]]:
        """Recorded scalars with their units, and a row for each sample."""
        return COLUMNS, list(zip(*(self.scalars[name] for name in COLUMNS), strict=True))

    @property
    def lost_in_failure(self) -> tuple[str, ...]:
        """What the joints lose where they fail, one sentence per joint law.

        It says by what and over which energy.
        """
        return losses(self.assembly, self.state.laws)

    def reaction_of(self, block: int | str) -> Array:
        """Reaction on a held or driven block [N, N m], shape (samples, 6)."""
        i = self.assembly.block_index(block)
        found = np.flatnonzero(self.reaction_blocks == i)
        if not len(found):
            raise InputError(f"no reaction is recorded for block {block!r}: it is neither held nor driven")
        return self.reaction[:, int(found[0])]

    def displacement_of(self, block: int | str) -> Array:
        """Displacement of a block's centroid [m], shape (samples, 3)."""
        return self.shift[:, self._column(block)]

    def _column(self, block: int | str) -> int:
        """Column of a block in ``shift`` and ``quaternion``, which may not hold all."""
        i = self.assembly.block_index(block)
        found = np.flatnonzero(self._blocks == i)
        if not len(found):
            name = self.assembly.blocks[i].name
            raise InputError(f"the motion of block {name!r} was not recorded: it is not among Store(blocks=...)")
        return int(found[0])

    @property
    def _blocks(self) -> Index:
        """Numbers of the blocks in ``shift`` and ``quaternion``."""
        return np.arange(self.assembly.n_blocks) if self.recorded is None else self.recorded

    def rotation_of(self, block: int | str) -> Array:
        """Rotation vector of a block [rad], shape (samples, 3).

        The second column is the rotation of a block that rocks about y.
        """
        return rotation_vectors(self.quaternion[:, self._column(block)])

    def curve(self, block: int | str, direction: tuple[float, float, float] = (1.0, 0.0, 0.0)) -> Curve:
        """Force of a drive over the displacement of its block along a direction [N, m].

        It unpacks as displacement, force. Its errors are the energy from nowhere over the largest work of the loads and
        the kinetic energy over the work so far, both [-].

        Parameters
        ----------
        block : name or number
        direction : of any length, shape (3,); the force that the drive exerts along it is positive

        Raises
        ------
        InputError
            For a block that is neither held nor driven, and a history with nothing recorded.
        """
        along = read_direction("direction", direction)
        i = self.assembly.block_index(block)
        return Curve(
            self.displacement_of(i) @ along, self.reaction_of(i)[:, :3] @ along, label=self.assembly.blocks[i].name,
            errors={"energy": self.energy_error / self._work, "kinetic": self.kinetic_ratio},
            status=self.status, warnings=self.warnings, source="dem",
            references=(*PAPERS, *data_behind(self.assembly.recipe)),
        )

    @property
    def quantities(self) -> dict[str, float]:
        """What a test on a table that shakes, or a release, would write down, by name.

        "peak rotation" [rad] is the largest turn of any block at any time. "peak displacement" and "residual
        displacement" [m] are the largest at any time and at the end, against the mean of the held blocks. "overturned"
        is 1 where a block has turned by more than ``OVERTURNED`` or has fallen to the floor, else 0.

        Raises
        ------
        InputError
            Where nothing is recorded, or all recorded blocks are held, or none while the ground may move.
        """
        free = ~self.assembly.fixed[self._blocks]
        if not len(self.shift) or not free.any():
            raise InputError("this history has no block that moves, or nothing recorded: it has no quantities")
        moved = np.linalg.norm(self._against_ground()[:, free], axis=2)
        # a quaternion of a turn theta is (cos, sin times the axis) of theta / 2, up to its sign
        q = self.quaternion[:, free]
        turned = float(2.0 * np.arctan2(np.linalg.norm(q[..., 1:], axis=2), np.abs(q[..., 0])).max())
        # only runs of real masses have a floor
        down = self.state.mode == DYNAMIC and len(Floor(self.assembly, self.state.dead).landed(self.state)) > 0
        return {
            "peak rotation": turned, "peak displacement": float(moved.max()),
            "residual displacement": float(moved[-1].max()), "overturned": float(down or turned > OVERTURNED),
        }

    def _against_ground(self) -> Array:
        """Displacement of recorded blocks against the held ones [m], (samples, r, 3)."""
        held = on_ground(self.assembly)[self._blocks]
        if held.any():
            return np.asarray(self.shift - self.shift[:, held].mean(axis=1, keepdims=True))
        if self.state.mode == DYNAMIC and on_ground(self.assembly).any():
            raise InputError("displacements count from the ground, and no held block is among Store(blocks=...)")
        return self.shift

    def diagram(self) -> dict[str, Any]:
        """What ``plot()`` draws, as arguments of ``limitmason.figures.history_curves``.

        The displacement of the block that ends farthest away [mm], against the ground, over time or quasi-static steps.
        """
        if not len(self.shift):
            raise InputError("this history has nothing recorded: there is nothing to draw")
        moved = self._against_ground()
        k = int(np.argmax(np.linalg.norm(moved[-1], axis=1)))
        against, unit = ("time", "s") if self.state.mode == DYNAMIC else ("step", "")
        columns = {against: self[against]} | dict(zip("xyz", 1e3 * moved[:, k].T, strict=True))
        label = f"displacement of {self.assembly.blocks[self._blocks[k]].name} [mm]"
        return {"history": columns, "names": list("xyz"), "against": against, "units": {against: unit}, "ylabel": label}

    def corners(self, sample: int = -1) -> list[Array]:
        """Corners of every block at a recorded sample [m], to draw the deformed shape: one array (v, 3) for each."""
        if not (isinstance(sample, int | np.integer) and -len(self.shift) <= sample < len(self.shift)):
            raise InputError(f"the history has samples 0 to {len(self.shift) - 1}, got {sample!r}")
        out = []
        for k, block in enumerate(self.assembly.blocks):
            i = self._column(k)
            turn = rotation_matrices(rotation_vectors(self.quaternion[sample, i]))
            centre = self.assembly.centroids[k]
            out.append((block.vertices - centre) @ turn.T + centre + self.shift[sample, i])
        return out

    def first_crack(self, opening: float, kind: str | None = None) -> tuple[int, int] | None:
        """Sample and interface, by number, at which an opening [m] is first reached.

        Only joints of ``kind`` count where one is given. Of several at one sample the first is taken, as openings grow
        in a line between two samples. The result is None if it never is.
        """
        positive("opening", opening, "m")
        if self.opening.shape[1] != len(self.assembly.interfaces):
            raise InputError("the openings of this run were not recorded: it was kept by a Store with joints=False")
        found = first_opening(self, self.assembly, opening, kind)
        return None if found is None else (found.sample, found.joint)

    @property
    def energy_error(self) -> Array:
        """Energy from nowhere [J], shape (samples,).

        Kinetic + elastic + friction + fracture + viscous + damping - applied - support, less what was kinetic and
        elastic before the first step. Damping is artificial, or what searches for contacts take: those found anew never
        store more than those they replace. Stops of ``Damping(kinetic=True)`` leave up to a third of the work out.
        Springs are read half a step after velocities: a vibration of w [rad/s] swings by w dt / 2 of its energy.
        Dashpots are too: a landing books about dashpot w^2 dt / 2 of its energy too much, less with a smaller ``dt``.
        """
        s = self.scalars
        stored = s["kinetic"] + s["elastic"] + s["friction"] + s["fracture"] + s["viscous"] + s["damping"]
        return stored - s["applied"] - s["support"] - self.state.total[E_BEGUN]

    @property
    def _work(self) -> float:
        """Largest work of the loads [J], not quite zero."""
        applied, support = (np.abs(self.scalars[name]).max(initial=0.0) for name in ("applied", "support"))
        return max(float(applied + support), _NO_WORK)

    @property
    def kinetic_ratio(self) -> Array:
        """Kinetic energy over work so far [-], small in quasi-static runs, (samples,)."""
        return self.kinetic_ratio_since(None)

    def kinetic_ratio_since(self, before: History | None) -> Array:
        """Kinetic energy over the work since the end of ``before``, or the first step [-], (samples,)."""
        done = [0.0 if before is None else before.scalars[name][-1] for name in ("applied", "support")]
        work = np.abs(self.scalars["applied"] - done[0]) + np.abs(self.scalars["support"] - done[1])
        return self.scalars["kinetic"] / np.maximum(work, _NO_WORK)

    def vibration(self, *, sliding: str = "sticks") -> VibratingSystem:
        """Blocks on the joints that the end of the run leaves closed.

        The system is meant for :func:`limitmason.modes`, see there.
        """
        return state_system(self.state, self.assembly, sliding)

    @property
    def support_multiplier(self) -> Array:
        """Rh / Rv of all recorded reactions [-], shape (samples,)."""
        total = self.reaction[:, :, :3].sum(axis=1)
        return np.linalg.norm(total[:, :2], axis=1) / np.maximum(np.abs(total[:, 2]), 1e-300)

    def __str__(self) -> str:
        """Status, length, how well energy is balanced, and what to know of it."""
        return repr(self) + "".join(f"\n  note: {w}" for w in self.warnings)

    def __repr__(self) -> str:
        """Status, length, and how well energy is balanced."""
        n = len(self.scalars["time"])
        if not n:
            return f"history: {self.status}, nothing recorded"
        return (
            f"history: {self.status}, {n} samples, {self.scalars['step'][-1]:.0f} steps, "
            f"energy error {np.abs(self.energy_error).max() / self._work:.1e} of the work of the loads"
        )
