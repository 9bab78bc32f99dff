"""All causes: by name, as a list for a study, and as a table.

It is made from their declarations in ``joints``, ``faces``, ``shape``, ``loads`` and ``measurement``. Sizes that are
tried, ``bounds``, stand there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from limitmason.causes import faces, joints, loads, measurement, shape
from limitmason.causes.cause import Cause, Extension
from limitmason.causes.declare import Declared
from limitmason.checks import choice
from limitmason.errors import InputError
from limitmason.methods import LIMIT, METHODS, MODES, get_method
from limitmason.model import Assembly

TOPICS = (joints, faces, shape, loads, measurement)

DELIVERED = ("batch", "delivery")  # circumstances that may change the units, not only the reading
FELT_BY_MODES = ("stiffness", "faces", "blocks", "weights")  # levers of natural frequencies and shapes
VIBRATION = ("vibration", "frequency", "mode")  # how readings of these begin, by kind or by quantity

ALL: Mapping[str, Declared] = MappingProxyType(
    {d.name: d for topic in TOPICS for d in vars(topic).values() if isinstance(d, Declared)}
)
"""Every declared cause by its name."""


def acts_on(cause: Cause, method: str, *, plane: bool = True) -> bool:
    """Whether a method feels a cause, and computes it with its default contact points.

    Parameters
    ----------
    method : a name of :func:`limitmason.methods.available_methods`, "limit", which is associative, or "modes", natural
        frequencies and shapes
    plane : whether the structure works in its plane; in space the corners of a face cannot represent crushing

    Raises
    ------
    InputError
        For an unknown method.
    """
    chosen = None if method == MODES else get_method(method)
    if cause.acts_on == "measurement" and cause.reads:
        of_modes = {r for r in cause.reads if r.startswith(VIBRATION)}
        if chosen is None:
            return bool(of_modes)
        rest = set(cause.reads) - of_modes
        # displacements are those of a method whose joints give way
        return bool(rest - set(measurement.SENSOR)) or (bool(rest) and chosen.feels("stiffness"))
    if cause.acts_on == "measurement" or not cause.lever:
        return True
    return cause.lever in FELT_BY_MODES if chosen is None else chosen.feels(cause.lever, plane=plane)


@dataclass(frozen=True)
class OfBatch:
    """A change of the model that the specimens of one batch have alone.

    Parameters
    ----------
    cause : the change
    covariate, label : what is recorded of these specimens
    """

    cause: Cause
    covariate: str
    label: Any

    def __call__(self, size: float, *model: Any, specimen: Any = None) -> Any:
        """The model, changed for a specimen of the batch: a single object for one, else a tuple."""
        if measurement.entry(specimen, self.covariate, self.cause.name) != self.label:
            return model[0] if len(model) == 1 else model
        return Extension(((self.cause, size),), specimen)(*model)


def of_batch(cause: Cause, label: Any, covariate: str = "batch") -> Cause:
    """The same cause for the specimens of one batch alone: where covariate == label.

    Parameters
    ----------
    cause : of the model, with ``apply``
    covariate : a column of the specimens

    Raises
    ------
    InputError
        For a reading, which :func:`batch_shift` changes, and a cause that the simulator takes as a keyword.

    >>> of_batch(joints.cohesion(), "B").name
    'cohesion of batch B'
    """
    if cause.apply is None or cause.acts_on == "measurement":
        raise InputError(f"cause {cause.name!r} is no change of the model: it cannot be that of a batch")
    return replace(
        cause, name=f"{cause.name} of {covariate} {label}", own=(*cause.own, covariate), reads_specimen=True,
        parameter="".join(c if c.isalnum() else "_" for c in f"{cause.parameter}_{covariate}_{label}"),
        physics=f"{cause.physics}, where {covariate} = {label}", apply=OfBatch(cause, covariate, label),
        hidden_when=f"the {covariate} goes with a change of geometry or load; {cause.hidden_when}",
    )


def delivered(label: Any, covariate: str = "batch", *, plane: bool = True, overload: bool = False) -> list[Cause]:
    """What units or mortar of one delivery may have: another friction, cohesion, thickness and density.

    Parameters
    ----------
    label, covariate : of the delivery, see :func:`of_batch`
    plane, overload : see :func:`standard`; without overload the density of dry blocks cancels, and in plane their
        thickness
    """
    found = [joints.joint_friction(), joints.cohesion()]
    found += [] if plane else [faces.effective_thickness()]
    found += [shape.block_density()] if overload else []
    return [of_batch(cause, label, covariate) for cause in found]


def standard(
    *,
    plane: bool = True,
    method: str | Sequence[str] = LIMIT,
    tilting: bool = False,
    overload: bool = False,
    covariates: Iterable[str] = (),
    batches: Mapping[str, Any] | None = None,
    without: Iterable[str] = (),
) -> list[Cause]:
    """The causes that a study of masonry tests should list, measurement included.

    Bounds are those declared: of small dry models, with a multiplier as the measured value. Where a force was
    measured, replace "friction of the rig" by one with bounds in its unit.

    Parameters
    ----------
    plane : True for walls in the x-z plane that work in it; False for out-of-plane and spatial ones
    method : the simulator's, or several where it finds several quantities; causes that none of them feels, or can
        compute with its default points, are left out
    tilting : the multiplier was read as a tilt angle
    overload : at least one specimen carries dead load beyond self weight
    covariates : what is recorded of every specimen; "order" adds wear and drift of the sensor, "height" a control point
        at another height
    batches : labels by covariate, such as {"batch": "B", "operator": "second"}: each adds a shift, and a batch or
        delivery what :func:`delivered` tells
    without : names to leave out

    Raises
    ------
    InputError
        For an unknown method or name.
    """
    normal = (0.0, 1.0, 0.0) if plane else None
    causes = [
        joints.weak_base_joint(), joints.stress_dependent_friction(), joints.cohesion(), joints.dilatancy(),
        joints.finite_compressive_strength(), faces.edge_rounding(plane_normal=normal), faces.lost_overlap(),
        shape.out_of_plumb(), shape.second_order_displacement(), joints.joint_softness(),
        joints.joint_stiffness(kinds=("base",)), loads.load_direction(), measurement.gain(),
    ]
    if not plane:
        causes += [faces.effective_thickness(), faces.torsion_strength()]
    if overload:
        causes += [loads.overload_magnitude(), loads.eccentric_overload(), shape.block_density()]
    causes.append(measurement.angle_offset() if tilting else measurement.rig_friction())
    recorded = (covariates,) if isinstance(covariates, str) else tuple(covariates)
    if "order" in recorded:
        causes += [joints.wear(), measurement.sensor_drift()]
    if "height" in recorded:
        causes.append(measurement.control_point())
    causes += [measurement.displacement_gain(), measurement.rig_compliance()]
    for covariate, label in (batches or {}).items():
        causes.append(measurement.batch_shift(covariate=covariate, label=label))
        if covariate in DELIVERED:
            causes += delivered(label, covariate, plane=plane, overload=overload)
    names, left_out = [c.name for c in causes], (without,) if isinstance(without, str) else tuple(without)
    if unknown := [n for n in left_out if n not in names]:
        raise InputError(f"without: the list has no cause {unknown[0]!r}; it has {', '.join(names)}")
    methods = (method,) if isinstance(method, str) else tuple(method)
    return [c for c in causes if c.name not in left_out and any(acts_on(c, m, plane=plane) for m in methods)]


def each_joint(
    assembly: Assembly, bounds: tuple[float, float] = (0.02, 1.0), kinds: Iterable[str] = joints.KINDS
) -> list[Cause]:
    """A cause per joint, "loose joint a|b", for "which one is loose or cracked?".

    A diagnosis pays for the whole list.

    Parameters
    ----------
    assembly : whose joints they are
    bounds : least and largest part of its stiffness that a joint may have [-]
    kinds : of the joints: "bed", "head", "base"

    Raises
    ------
    InputError
        For an unknown kind.
    """
    kinds = (kinds,) if isinstance(kinds, str) else tuple(kinds)
    for kind in kinds:
        choice("kinds", kind, sorted({*joints.KINDS, *(i.kind for i in assembly.interfaces)}))
    names = [b.name for b in assembly.blocks]
    pairs = [(names[i.block_a], names[i.block_b]) for i in assembly.interfaces if i.kind in kinds]
    return [joints.joint_stiffness(bounds, joint=pair) for pair in dict.fromkeys(pairs)]


def felt_by(cause: Cause) -> tuple[str, ...]:
    """Kinds of data, or quantities of a reading, that feel a cause by one method or another.

    ``cause.acts_on`` says where a cause is switched on, :func:`acts_on` whether a method feels it.
    """
    if cause.acts_on == "measurement":
        return cause.reads or ("all",)  # a reading that names no quantity changes all
    # what changes the force of a method may change its mechanism, and so the pattern of cracks; of deformations the
    # capacity curve tells most: it feels whatever a method with soft joints does
    force = any(acts_on(cause, m) for m in METHODS)
    felt = {"force": force, "deformation": acts_on(cause, "pushover"), "vibration": acts_on(cause, MODES),
            "pattern": force}
    return tuple(kind for kind, feels in felt.items() if feels)


def table() -> list[dict[str, str]]:
    """One row of text per cause: what it is, where it acts, and how it is isolated."""
    rows = []
    for name, declared in ALL.items():
        cause = declared()
        feel = [m for m in METHODS if get_method(m).feels(cause.lever)]
        acts = cause.acts_on
        if acts != "measurement":
            acts = "every method" if feel == list(METHODS) else ", ".join(feel)
        rows.append({
            "cause": name, "parameter": cause.parameter, "unit": cause.unit, "baseline": f"{cause.baseline:g}",
            "bounds": f"{cause.bounds[0]:g} to {cause.bounds[1]:g}", "acts on": acts,
            "felt by": ", ".join(felt_by(cause)), "physics": cause.physics, "source": cause.source,
            "isolating experiment": cause.isolate, "hidden when": cause.hidden_when,
        })
    return rows
