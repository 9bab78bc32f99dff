"""All causes: by name, as a list for a study, and as a table.

Made from their declarations.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from limitmason.causes import faces, joints, loads, measurement, shape
from limitmason.causes.cause import Cause
from limitmason.causes.declare import Declared
from limitmason.errors import InputError
from limitmason.methods import LIMIT, METHODS, MODES, get_method
from limitmason.model import Assembly

TOPICS = (joints, faces, shape, loads, measurement)

DELIVERED = ("batch", "delivery")  # circumstances that may change the units, not only the reading
FELT_BY_MODES = ("stiffness", "faces", "blocks", "weights")  # levers of natural frequencies and shapes

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
    if method == MODES:
        return cause.lever in FELT_BY_MODES or (cause.acts_on == "measurement" and not cause.reads)
    chosen = get_method(method)
    return cause.acts_on == "measurement" or not cause.lever or chosen.feels(cause.lever, plane=plane)


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
    covariates : what is recorded of every specimen; "order" adds wear
    batches : labels by covariate, such as {"batch": "B", "operator": "second"}: each adds a shift, and a batch or
        delivery its own friction
    without : names to leave out

    Raises
    ------
    InputError
        For an unknown method or name.
    """
    normal = (0.0, 1.0, 0.0) if plane else None
    causes = [
        joints.weak_base_joint(),
        joints.stress_dependent_friction(),
        joints.cohesion(),
        joints.dilatancy(),
        joints.finite_compressive_strength(),
        faces.edge_rounding(plane_normal=normal),
        faces.lost_overlap(),
        shape.out_of_plumb(),
        shape.second_order_displacement(),
        joints.joint_softness(),
        joints.joint_stiffness(kinds=("base",)),
        loads.load_direction(),
        measurement.gain(),
    ]
    if not plane:
        causes += [faces.effective_thickness(), faces.torsion_strength()]
    if overload:
        causes += [loads.overload_magnitude(), loads.eccentric_overload(), shape.block_density()]
    if tilting:
        causes.append(measurement.angle_offset())
    else:
        causes.append(measurement.rig_friction())
    if "order" in tuple(covariates):
        causes.append(joints.wear())
    for covariate, label in (batches or {}).items():
        causes.append(measurement.batch_shift(covariate=covariate, label=label))
        if covariate in DELIVERED:
            causes.append(joints.batch_friction(covariate=covariate, label=label))
    names = [c.name for c in causes]
    unknown = [n for n in without if n not in names]
    if unknown:
        raise InputError(f"without: the list has no cause {unknown[0]!r}; it has {', '.join(names)}")
    methods = (method,) if isinstance(method, str) else tuple(method)
    felt = [c for c in causes if any(acts_on(c, m, plane=plane) for m in methods)]
    return [c for c in felt if c.name not in tuple(without)]


def each_joint(
    assembly: Assembly, bounds: tuple[float, float] = (0.02, 1.0), kinds: Iterable[str] = joints.KINDS
) -> list[Cause]:  # fmt: skip
    """A cause per joint, "loose joint a|b", for "which one is loose or cracked?".

    A diagnosis pays for the whole list.

    Parameters
    ----------
    assembly : whose joints they are
    bounds : least and largest part of its stiffness that a joint may have [-]
    kinds : of the joints: "bed", "head", "base"
    """
    names = [b.name for b in assembly.blocks]
    pairs = [(names[i.block_a], names[i.block_b]) for i in assembly.interfaces if i.kind in tuple(kinds)]
    return [joints.joint_stiffness(bounds, joint=pair) for pair in dict.fromkeys(pairs)]


def table() -> list[dict[str, str]]:
    """One row per cause.

    Name, parameter, unit, baseline, bounds, methods, physics, isolating test, when hidden.
    """
    rows, methods = [], {name: get_method(name) for name in METHODS}
    for name, declared in ALL.items():
        cause = declared()
        feel = [m for m, method in methods.items() if method.feels(cause.lever)]
        rows.append(
            {
                "cause": name,
                "parameter": cause.parameter,
                "unit": cause.unit,
                "baseline": f"{cause.baseline:g}",
                "bounds": f"{cause.bounds[0]:g} to {cause.bounds[1]:g}",
                "acts on": cause.acts_on if cause.acts_on == "measurement" else "every method" if feel == list(methods)
                else ", ".join(feel),
                "physics": cause.physics,
                "source": cause.source,
                "isolating experiment": cause.isolate,
                "hidden when": cause.hidden_when,
            }
        )
    return rows
