"""The catalogue as a whole: factories by name, a list for a study, and a table."""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

from limitmason.diagnosis.catalogue import faces, joint_laws, loading, measurement, shape
from limitmason.diagnosis.cause import Cause

METHODS = ("limit", "limit, associative", "limit, non-associative", "dem", "mechanisms")
"""Methods as ``Cause.methods`` names them. Of a cause "limit" covers both flow rules, of a study it is associative."""

ALL: Mapping[str, Callable[..., Cause]] = MappingProxyType(
    {
        "weak base joint": joint_laws.weak_base_joint,
        "head joint friction": joint_laws.head_joint_friction,
        "stress-dependent friction": joint_laws.stress_dependent_friction,
        "cohesion": joint_laws.cohesion,
        "tension": joint_laws.tension,
        "dilatancy": joint_laws.dilatancy,
        "finite compressive strength": joint_laws.finite_compressive_strength,
        "wear": joint_laws.wear,
        "edge rounding": faces.edge_rounding,
        "effective thickness": faces.effective_thickness,
        "lost overlap": faces.lost_overlap,
        "open head joints": faces.open_head_joints,
        "torsion strength": faces.torsion_strength,
        "out-of-plumb": shape.out_of_plumb,
        "block size": shape.block_size,
        "block density": shape.block_density,
        "second-order displacement": shape.second_order_displacement,
        "joint softness": shape.joint_softness,
        "eccentric overload": loading.eccentric_overload,
        "overload magnitude": loading.overload_magnitude,
        "load direction": loading.load_direction,
        "angle offset": measurement.angle_offset,
        "gain": measurement.gain,
        "batch shift": measurement.batch_shift,
        "friction of the rig": measurement.rig_friction,
    }
)
"""Every factory by the name of its cause."""


def acts_on(cause: Cause, method: str) -> bool:
    """Whether a method feels a cause.

    Parameters
    ----------
    method : one of ``METHODS``

    Raises
    ------
    ValueError
        For an unknown method.
    """
    if method not in METHODS:
        raise ValueError(f"method must be one of {', '.join(METHODS)}, got {method!r}")
    if cause.acts_on == "measurement" or not cause.methods:
        return True
    if method == "limit":
        method = "limit, associative"
    return method in cause.methods or ("limit" in cause.methods and method.startswith("limit"))


def standard(
    *,
    plane: bool = True,
    method: str = "limit",
    tilting: bool = False,
    overload: bool = False,
    covariates: Iterable[str] = (),
    batches: Mapping[str, Any] | None = None,
    without: Iterable[str] = (),
) -> list[Cause]:
    """The causes that a study of masonry tests should list, measurement included.

    Bounds are those of the factories: of small dry models, with a multiplier as the measured value. Where a force was
    measured, replace "friction of the rig" by one with bounds in its unit.

    Parameters
    ----------
    plane : True for walls in the x-z plane that work in it; False for out-of-plane and spatial ones
    method : the simulator's, one of ``METHODS``; causes that it does not feel are left out
    tilting : the multiplier was read as a tilt angle
    overload : at least one specimen carries dead load beyond self weight
    covariates : what is recorded of every specimen; "order" adds wear
    batches : labels by covariate, such as {"batch": "B", "operator": "second"}: each adds a shift
    without : names to leave out

    Raises
    ------
    ValueError
        For an unknown method or name.
    """
    normal = (0.0, 1.0, 0.0) if plane else None
    causes = [
        joint_laws.weak_base_joint(),
        joint_laws.stress_dependent_friction(),
        joint_laws.cohesion(),
        joint_laws.dilatancy(),
        joint_laws.finite_compressive_strength(),
        faces.edge_rounding(plane_normal=normal),
        faces.lost_overlap(),
        shape.out_of_plumb(),
        shape.second_order_displacement(),
        shape.joint_softness(),
        loading.load_direction(),
        measurement.gain(),
    ]
    if not plane:
        causes += [faces.effective_thickness(), faces.torsion_strength()]
    if overload:
        causes += [loading.overload_magnitude(), loading.eccentric_overload(), shape.block_density()]
    if tilting:
        causes.append(measurement.angle_offset())
    else:
        causes.append(measurement.rig_friction())
    if "order" in tuple(covariates):
        causes.append(joint_laws.wear())
    for covariate, label in (batches or {}).items():
        causes.append(measurement.batch_shift(covariate=covariate, label=label))
    names = [c.name for c in causes]
    unknown = [n for n in without if n not in names]
    if unknown:
        raise ValueError(f"without: the list has no cause {unknown[0]!r}; it has {', '.join(names)}")
    return [c for c in causes if acts_on(c, method) and c.name not in tuple(without)]


def table() -> list[dict[str, str]]:
    """One row per cause: name, parameter, unit, baseline, bounds, methods, physics, isolating test, when hidden."""
    rows = []
    for name, factory in ALL.items():
        cause = factory()
        methods = ", ".join(cause.methods) or "every method"
        rows.append(
            {
                "cause": name,
                "parameter": cause.parameter,
                "unit": cause.unit,
                "baseline": f"{cause.baseline:g}",
                "bounds": f"{cause.bounds[0]:g} to {cause.bounds[1]:g}",
                "acts on": cause.acts_on if cause.acts_on == "measurement" else methods,
                "physics": cause.physics,
                "source": cause.source,
                "isolating experiment": cause.isolate,
                "hidden when": cause.hidden_when,
            }
        )
    return rows
