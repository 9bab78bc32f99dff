"""The load-displacement curve of zoned blocks, with what their joints and zones did."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dem.driving import widest_spacing
from dem.joint_marks import JointMarks
from dem.kernels.solid_arrays import FaceContacts, RigidSolids
from dem.kernels.zone_arrays import Sides, Zones
from dem.papers import PAPERS
from dem.push_curve import JointPoint, PushCurve, dynamic_notes, failure_events
from dem.zones.marks import AT_YIELD, ELASTIC, TENSION, YIELDED
from dem.zones.mesh import ZoneMesh
from dem.zones.recording import Record, ZoneState
from dem.zones.solid_mesh import SolidMesh
from dem.zones.zoned_model import ZonedModel
from limitmason.answers.curve import Event
from limitmason.answers.references import data_behind
from limitmason.deformable import SOLID
from limitmason.deformable.levels import ZONED
from limitmason.errors import InputError

Array = NDArray[np.float64]



@dataclass(frozen=True, eq=False)
class ZonedCurve(PushCurve):
    """Curve of a zoned structure; sample 0 is the settled structure before it is driven.

    Parameters
    ----------
    mesh : nodes and zones
    zones : state of the zones at every sample
    plane : "plane stress", "plane strain" or "solid"
    seconds : time that the run took [s]
    """

    mesh: ZoneMesh | SolidMesh | None = None
    zones: Sequence[ZoneState] = ()
    plane: str = ""
    seconds: float = 0.0

    def moved(self, index: int) -> tuple[Array, Array]:
        """Displacements of the centroids [m] and quaternions of all blocks at a sample, own weight included."""
        return self.states[self.point(index).index]

    def first_unit_crack(self, width: float) -> JointPoint | None:
        """Where a zone that failed in tension is first stretched by a width; None where none is.

        Its accumulated plastic strain times its size (``mesh.zone_sizes``): a crack is smeared over a zone, whose first
        touch of the tensile strength nobody could see; of its four points the most strained counts. Cracks that are
        joints: ``first_crack(width, "crack")``.

        Parameters
        ----------
        width : [m]
        """
        if not width > 0.0:
            raise InputError(f"width must be positive [m], got {width!r}")
        assert self.mesh is not None
        sizes = self.mesh.zone_sizes
        return self._first_zone([z.plastic * sizes * (z.marks == TENSION) for z in self.zones], width)

    def first_crushing(self, strain: float) -> JointPoint | None:
        """Where a zone that yielded in shear and never failed in tension first has a plastic strain; None where none.

        Parameters
        ----------
        strain : accumulated length of the plastic strain [-], 1.4 times the shortening of a zone crushed along one axis
            without dilatancy
        """
        if not strain > 0.0:
            raise InputError(f"strain must be positive, got {strain!r}")
        return self._first_zone([z.plastic * np.isin(z.marks, (AT_YIELD, YIELDED)) for z in self.zones], strain)

    def _first_zone(self, values: Sequence[Array], least: float) -> JointPoint | None:
        """First sample at which a zone has a value, and the block of the zone that has the largest."""
        assert self.mesh is not None
        assert self.assembly is not None
        for i, value in enumerate(values):
            k = int(np.argmax(value))
            if value[k] >= least:
                where = self.assembly.blocks[int(self.mesh.zone_block[k])].name
                return JointPoint(i, float(self.displacement[i]), float(self.load[i]), where, float(value[k]))
        return None

    def __str__(self) -> str:
        """As :class:`PushCurve`, with the zones."""
        assert self.mesh is not None
        marks = self.zones[-1].marks if self.zones else np.zeros(0)
        share = f"{np.mean(marks > ELASTIC):.1%} of them yielded or cracked at the end"
        if self.plane == SOLID:
            share = "elastic"
        return PushCurve.__str__(self) + (
            f"\n  {len(self.mesh.zones)} zones up to {1e3 * self.mesh.size:.4g} mm, {self.plane}; {share}"
        )

    __repr__ = __str__


def zoned_curve(model: ZonedModel, record: Record, steps: int, twist: Array) -> ZonedCurve:
    """Curve of a run from what was kept at its samples; ``twist`` of rigid blocks per displacement of 1 m."""
    moved, marks, zones = record.moved, record.marks, record.zones
    notes = [*model.warnings, *([record.ended] if record.ended else [])]
    restless = np.array(record.kinetic)
    notes += dynamic_notes(np.array(moved), restless)
    slid = float(np.nanmax(marks[-1].slip, initial=0.0))
    if slid > 0.5 * _shortest(model):
        notes.append(
            f"a joint has slid by {1e3 * slid:.3g} mm: contacts are those of the reference position, and a block that "
            "leaves the face it lies on is still carried by its plane"
        )
    columns: dict[str, Any] = {name: np.array([getattr(m, name) for m in marks]) for name in JointMarks._fields}
    driven = int(np.argmax(np.abs(twist).max(axis=1)))
    curve = ZonedCurve(
        np.array(moved), np.array(record.load), errors={"energy": np.array(record.energy), "kinetic": restless},
        states=record.places, status=record.status, warnings=tuple(notes), source="dem.push", assembly=model.assembly,
        settlement=float(-zones[0].shift[model.nodes.body == driven].mean(axis=0) @ -twist[driven, : model.dimension]),
        blocks=ZONED, spacing=_spacing(model), law="; ".join(model.lost), steps=steps, mesh=model.mesh, zones=zones,
        plane=model.plane, seconds=record.seconds, references=(*PAPERS, *data_behind(model.assembly.recipe)),
        **columns,
    )  # fmt: skip
    events = [*failure_events(curve)]
    for name, wanted in (("unit yields", (AT_YIELD, YIELDED)), ("unit cracks", (TENSION,))):
        for i, state in enumerate(zones):
            hit = np.flatnonzero(np.isin(state.marks, wanted))
            if len(hit):
                block = model.assembly.blocks[int(model.mesh.zone_block[hit[0]])].name
                events.append(Event(name, i, block, float(state.plastic[hit].max())))
                break
    return replace(curve, events=tuple(events))


def _shortest(model: ZonedModel) -> float:
    """Shortest edge of a facet of the blocks' faces [m]."""
    if isinstance(model.sides, Sides):
        steps = np.diff(model.sides.arc)
        return float(steps[steps > 0.0].min())
    x = model.nodes.place[model.sides.node]
    return float(np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2).min())


def _spacing(model: ZonedModel) -> float:
    """Largest distance between neighbouring contact points of a joint [m]."""
    contacts = model.contacts

    def along(row: int) -> Array:
        own = contacts.joint == row
        if isinstance(contacts, FaceContacts):
            return np.asarray((contacts.origin[own] @ contacts.tangent[row].T).T)
        return np.asarray(contacts.arc[own][None])

    return widest_spacing(along(row) for row in range(len(model.interface)))


def zone_state(model: ZonedModel) -> ZoneState:
    """State of the zones now; those in space are elastic."""
    if not isinstance(model.zones, Zones):
        e = len(model.zones.kind)
        return ZoneState(model.nodes.shift.copy(), np.zeros((e, 1), np.int64), np.zeros(e))
    return ZoneState(model.nodes.shift.copy(), model.zones.flag.copy(), model.zones.plastic.max(axis=1))


def rigid_motion(model: ZonedModel) -> tuple[Array, Array]:
    """Displacement of the centroids [m] and quaternions of all blocks, nearest to their nodes' motion."""
    if model.space:
        return _motion_in_space(model)
    n, mesh = model.assembly.n_blocks, model.mesh
    count = np.bincount(mesh.block, minlength=n)
    place, shift = model.nodes.place, model.nodes.shift

    def mean(values: Array) -> Array:
        return np.column_stack([np.bincount(mesh.block, values[:, k], n) / count for k in range(2)])

    middle, mean_shift = mean(place), mean(shift)
    r = place - middle[mesh.block]
    s = r + shift - mean_shift[mesh.block]
    cross = np.bincount(mesh.block, r[:, 0] * s[:, 1] - r[:, 1] * s[:, 0], n)
    turn = np.arctan2(cross, np.bincount(mesh.block, (r * s).sum(axis=1), n))
    arm = model.assembly.centroids[:, [0, 2]] - middle
    cos, sin = np.cos(turn) - 1.0, np.sin(turn)
    out = np.zeros((n, 3))
    out[:, 0] = mean_shift[:, 0] + cos * arm[:, 0] - sin * arm[:, 1]
    out[:, 2] = mean_shift[:, 1] + cos * arm[:, 1] + sin * arm[:, 0]
    quaternion = np.zeros((n, 4))
    quaternion[:, 0], quaternion[:, 2] = np.cos(0.5 * turn), -np.sin(0.5 * turn)
    return out, quaternion


def _motion_in_space(model: ZonedModel) -> tuple[Array, Array]:
    """As :func:`rigid_motion`; of a rigid block its own, of a zoned one the rotation nearest to its nodes' (Kabsch)."""
    assert isinstance(model.rigid, RigidSolids)
    mesh, shift = model.mesh, model.nodes.shift
    out, quaternion = np.zeros((model.assembly.n_blocks, 3)), np.zeros((model.assembly.n_blocks, 4))
    out[mesh.rigid], quaternion[mesh.rigid] = model.rigid.shift[:, :3], model.rigid.turn
    for block in np.flatnonzero(~mesh.rigid):
        own = mesh.block == block
        place = mesh.place[own]
        middle, mean = place.mean(axis=0), shift[own].mean(axis=0)
        r = place - middle
        turn, _ = Rotation.align_vectors(r + shift[own] - mean, r)
        arm = model.assembly.centroids[block] - middle
        out[block] = mean + turn.apply(arm) - arm
        quaternion[block] = turn.as_quat(canonical=True)[[3, 0, 1, 2]]
    return out, quaternion
