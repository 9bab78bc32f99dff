"""Compiled functions of the explicit distinct element method, a subject to a file.

Only these import each other.

- ``arrays`` and ``zone_arrays``: what all of them see of a model. ``compiled``: how they are compiled.
- ``joint_law``: the joint law at a point. ``joint_strength``: what a joint's row says of its strength. ``added_terms``:
  the terms that are added to the law.
- ``sums``: the law added up over the points of a joint. ``kinematics``: how the blocks of a joint lie to each other.
- ``joint_forces``: these sums brought to the blocks. ``ties``: the pull of rods. ``deformed``: what goes with blocks
  that strain.
- ``stepping``: steps of the blocks. ``rotations``: quaternions and spins. ``local_damping``: what it takes of a force.
  ``threads``: threads that share a step.
- ``measure``: forces and energy of a position. ``block_contact_stiffness``: how stiffly its joints hold a block.
- ``pieces``: convex pieces where they stand now. ``contact_geometry``: where they touch. ``internal_edges``: faces that
  go on from one block to the next.
- ``outlines``: whose edges end a joint. ``pivots``: joints that bear on an edge.
- ``cutting``: points of joints that are cut. ``point_transfer``: what they take over from the old ones.
- ``zones``: forces of blocks cut into zones in the plane, with the same joint law. ``zone_plasticity``: the return of a
  zone's stress to its strength (Mohr-Coulomb). ``zone_motion``: steps of zones. ``zone_measure``: what they bear.

Rule: a compiled function of ``dem`` stands in this package, is made by ``compiled.kernel`` and uses nothing from
outside but numpy and numba. What is kept on disk is stamped with the content of all files of the package and of the
terms that are added to the law, so that an edit of any is seen by all; an import from elsewhere would not be.

Blocks carry a displacement u of the centroid and a unit quaternion q (rotation from the reference position). A joint
owns its contact points: coordinates (s, t) on a plane carried by block a, frame (t1, t2, n). With d the displacement of
block b's joint origin against block a's in that frame, and G = R_rel - I, the total relative displacement at a point is
delta = d + G (s, t, 0): exact at any rotation, without drift. Forces act at block b's material point, on b and opposite
on a, so that elastic contact conserves energy and momentum exactly in continuous time.
"""

from dem.kernels.added_terms import COLUMNS, LAW_SIZE
from dem.kernels.arrays import (
    E_APPLIED,
    E_BEGUN,
    E_DAMPING,
    E_FRACTURE,
    E_FRICTION,
    E_KINETIC,
    E_SIZE,
    E_STEPS,
    E_SUPPORT,
    E_VISCOSITY,
    E_VISCOUS,
    LAW,
    SUMS,
    Acting,
    BlockModes,
    Joints,
    Points,
    RigidBodies,
    Scheme,
    Team,
    Ties,
)
from dem.kernels.block_contact_stiffness import add_springs
from dem.kernels.compiled import ADDED
from dem.kernels.contact_geometry import APART, CROSSING, FACES, MOST, contact_shapes
from dem.kernels.cutting import ROOM, Cut, Poses, cut_joints, facing_interface
from dem.kernels.internal_edges import Carrying, faces_that_go_on
from dem.kernels.joint_forces import contact_wrenches
from dem.kernels.measure import measure
from dem.kernels.outlines import SolidArrays, find_ends
from dem.kernels.pieces import Meetings, NearPairs, PieceArrays, face_planes, place_pieces, relative_motion
from dem.kernels.pivots import OF_A, OF_B, OF_BOTH, ON_A, UNKNOWN, bearing_ends
from dem.kernels.point_transfer import Heirs, Testators, inherit, keep_energy, largest_elastic_slip
from dem.kernels.rotations import rotation_of
from dem.kernels.stepping import advance
from dem.kernels.threads import SHUT, threads_allowed
from dem.kernels.ties import add_tie_forces

__all__ = [
    "ADDED", "APART", "COLUMNS", "CROSSING", "E_APPLIED", "E_BEGUN", "E_DAMPING", "E_FRACTURE", "E_FRICTION",
    "E_KINETIC", "E_SIZE", "E_STEPS", "E_SUPPORT", "E_VISCOSITY", "E_VISCOUS", "FACES", "LAW", "LAW_SIZE", "MOST",
    "OF_A", "OF_B", "OF_BOTH", "ON_A", "ROOM", "SHUT", "SUMS", "UNKNOWN", "Acting", "BlockModes", "Carrying", "Cut",
    "Heirs", "Joints", "Meetings", "NearPairs", "PieceArrays", "Points", "Poses", "RigidBodies", "Scheme",
    "SolidArrays", "Team", "Testators", "Ties", "add_springs", "add_tie_forces", "advance", "bearing_ends",
    "contact_shapes", "contact_wrenches", "cut_joints", "face_planes", "faces_that_go_on", "facing_interface",
    "find_ends", "inherit", "keep_energy", "largest_elastic_slip", "measure", "place_pieces", "relative_motion",
    "rotation_of", "threads_allowed",
]
