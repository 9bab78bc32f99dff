"""Catalogue of causes: physical extensions of the model, each usable on its own on any assembly.

>>> from limitmason.diagnosis import catalogue
>>> weak_base = catalogue.weak_base_joint()
>>> assembly, loads = weak_base.apply(0.8, assembly, loads)  # doctest: +SKIP

after which every method works as before. Measurement causes have ``apply(size, prediction, specimen)``. ``ALL`` holds
the factories by name; :func:`standard` is a list for a study, :func:`table` says what each is.
"""

from limitmason.diagnosis.catalogue.elastic import dead_load_stress, elastic_displacements
from limitmason.diagnosis.catalogue.faces import (
    edge_rounding,
    effective_thickness,
    lost_overlap,
    open_head_joints,
    torsion_strength,
)
from limitmason.diagnosis.catalogue.joint_laws import (
    cohesion,
    dilatancy,
    finite_compressive_strength,
    head_joint_friction,
    stress_dependent_friction,
    tension,
    weak_base_joint,
    wear,
)
from limitmason.diagnosis.catalogue.lists import ALL, METHODS, standard, table
from limitmason.diagnosis.catalogue.loading import eccentric_overload, load_direction, overload_magnitude
from limitmason.diagnosis.catalogue.measurement import angle_offset, batch_shift, gain, rig_friction
from limitmason.diagnosis.catalogue.shape import (
    block_density,
    block_size,
    joint_softness,
    out_of_plumb,
    second_order_displacement,
)

__all__ = [
    "ALL",
    "METHODS",
    "angle_offset",
    "batch_shift",
    "block_density",
    "block_size",
    "cohesion",
    "dead_load_stress",
    "dilatancy",
    "eccentric_overload",
    "edge_rounding",
    "effective_thickness",
    "elastic_displacements",
    "finite_compressive_strength",
    "gain",
    "head_joint_friction",
    "joint_softness",
    "load_direction",
    "lost_overlap",
    "open_head_joints",
    "out_of_plumb",
    "overload_magnitude",
    "rig_friction",
    "second_order_displacement",
    "standard",
    "stress_dependent_friction",
    "table",
    "tension",
    "torsion_strength",
    "weak_base_joint",
    "wear",
]
