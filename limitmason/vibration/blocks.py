"""Rigid blocks on elastic joints: K = A k A^T from contact points, all closed or as a state has left them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from limitmason.contact_points import ContactPoints, contact_points
from limitmason.equilibrium import degrees_of_freedom, equilibrium_matrix
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.plane import Plane
from limitmason.stiffness import default_stiffness
from limitmason.vibration.system import VibratingSystem

Array = NDArray[np.float64]
Grid = tuple[int, int]

_SLIDES = 1.0 - 1e-6  # of the shear strength: a point at it slides


@dataclass(frozen=True, eq=False)
class BlockCarrier:
    """Shapes of blocks, displacement and rotation about each centroid, shape (n, 6)."""

    assembly: Assembly

    @property
    def places(self) -> Array:
        """Centroids [m], shape (n, 3)."""
        return self.assembly.centroids

    @property
    def masses(self) -> Array:
        """Of the blocks, those wholly held included [kg], shape (n,)."""
        return self.assembly.arrays.mass

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Blocks that are not wholly held, shape (n,)."""
        return ~self.assembly.fixed

    def at(self, shape: Array, points: Array) -> Array:
        """Displacement of points by the block that holds them, or whose box is nearest to them, shape (p, 3)."""
        bounds = np.array([b.bounds for b in self.assembly.blocks])
        outside = np.maximum(bounds[:, 0] - points[:, None], points[:, None] - bounds[:, 1]).max(axis=2)
        size = float(np.ptp(bounds.reshape(-1, 3), axis=0).max())
        # where boxes touch, the block that moves and whose centre is nearer carries the point
        gap = np.maximum(outside, 0.0) + 1e-6 * np.linalg.norm(points[:, None] - self.places, axis=2)
        gap[:, self.assembly.fixed] += 1e-3 * size
        owner = np.argmin(gap, axis=1)
        far = outside[np.arange(len(points)), owner] > 1e-2 * size
        if far.any():
            x = points[int(np.argmax(far))]
            raise InputError(f"point ({x[0]:g}, {x[1]:g}, {x[2]:g}) lies in no block")
        u = shape[owner]
        return np.asarray(u[:, :3] + np.cross(u[:, 3:], points - self.places[owner]))


def joint_stiffness(
    assembly: Assembly, dead: Array, stiffness: ArrayLike | tuple[ArrayLike, ArrayLike] | None = None
) -> tuple[Array, Array, tuple[str, ...]]:
    """Stiffnesses kn and ks of every interface [Pa/m], and a warning where joints name none.

    Parameters
    ----------
    dead : wrench per block, which sets the default [N, N m], shape (n, 6)
    stiffness : kn, or (kn, ks), of all joints or per interface; by default those of the joints
    """
    x = assembly.arrays
    k = len(assembly.interfaces)
    warnings: tuple[str, ...] = ()
    if stiffness is None:
        missing = np.isnan(x.normal_stiffness)
        standard = default_stiffness(assembly, dead) if missing.any() else np.nan
        kn = np.where(missing, standard, x.normal_stiffness)
        ks = np.where(np.isnan(x.shear_stiffness), kn, x.shear_stiffness)
        if missing.any():
            warnings = (
                f"{int(missing.sum())} of {k} joints name no stiffness: kn = ks = {standard:.3g} Pa/m is used, which "
                "is no material property; the frequencies are meaningless",
            )
    else:
        pair = stiffness if isinstance(stiffness, tuple) else (stiffness, stiffness)
        if len(pair) != 2:
            raise InputError(f"stiffness must be kn or (kn, ks) [Pa/m], got {stiffness!r}")
        kn, ks = (np.broadcast_to(np.asarray(v, dtype=float), (k,)) for v in pair)
    for name, value in (("normal", kn), ("shear", ks)):
        wrong = ~(np.isfinite(value) & (value > 0.0))
        if wrong.any():
            i = int(np.argmax(wrong))
            raise InputError(f"interface {i} has {name} stiffness {value[i]:g} Pa/m: it must be positive and finite")
    return kn, ks, warnings


def closed_system(
    assembly: Assembly,
    *,
    contact_points: Grid | Mapping[str, Grid] = (4, 4),
    contact_model: str = "grid",
    stiffness: ArrayLike | tuple[ArrayLike, ArrayLike] | None = None,
) -> VibratingSystem:
    """Blocks whose joints are closed over their whole faces and stick.

    Parameters
    ----------
    contact_points, contact_model : see :func:`limitmason.contact_points.contact_points`; from three points on a side
        joints bend as their faces do, with two their bending stiffness is three times too large
    stiffness : see :func:`joint_stiffness`
    """
    points = _points(assembly, contact_points, contact_model)
    kn, ks, warnings = joint_stiffness(assembly, Loads.weight(assembly).dead, stiffness)
    components = np.column_stack([kn, ks, ks])[points.interface]
    return block_system(assembly, points, components, "blocks on closed joints", warnings)


def _points(assembly: Assembly, grid: Grid | Mapping[str, Grid], model: str) -> ContactPoints:
    return contact_points(assembly, contact_model=model, grid=grid, elastic=True)


def state_stiffness(normal: Array, shear: Array, limit: Array, kn: Array, ks: Array, sliding: str) -> tuple[Array, str]:
    """Stiffness (kn, ks, ks) per point of a state [Pa/m], shape (m, 3), and how many points are open and slide.

    Parameters
    ----------
    normal, shear : forces of the points, compression positive, and the size of their shear [N], shape (m,)
    limit : shear strength of the points at those forces [N], shape (m,)
    kn, ks : of the points [Pa/m], shape (m,)
    sliding : "sticks", since a point that slides back sticks at first, or "drops" for no shear stiffness there

    Notes
    -----
    A point without force is open and carries nothing. Vibrations are taken so small that none opens or closes.
    """
    if sliding not in ("sticks", "drops"):
        raise InputError(f"sliding must be 'sticks' or 'drops', got {sliding!r}")
    scale = float(np.abs(normal).max(initial=0.0))
    is_open = np.abs(normal) + shear <= 1e-9 * scale
    slides = ~is_open & (shear >= _SLIDES * limit)
    kept = np.where(is_open | (slides & (sliding == "drops")), 0.0, ks)
    text = f"{int(is_open.sum())} of {len(normal)} points open, {int(slides.sum())} slide"
    return np.column_stack([np.where(is_open, 0.0, kn), kept, kept]), text


def block_system(
    assembly: Assembly,
    points: ContactPoints,
    stiffness: Array,
    label: str,
    warnings: tuple[str, ...] = (),
    plane: Plane | None = None,
) -> VibratingSystem:
    """Blocks on springs at contact points.

    Parameters
    ----------
    stiffness : per area, of normal and two tangents [Pa/m], shape (m, 3); of normal and one in plane, (m, 2)
    plane : in which blocks move, where points come with one

    Raises
    ------
    InputError
        When a free block has no mass.
    """
    x = assembly.arrays
    basis, kept = degrees_of_freedom(assembly, plane)
    free = kept.ravel()
    moving = ~assembly.held.all(axis=1)
    if (moving & ~(x.mass > 0.0)).any():
        name = assembly.blocks[int(np.flatnonzero(moving & ~(x.mass > 0.0))[0])].name
        raise InputError(f"block {name!r} has no mass: natural frequencies need a positive density")
    a = equilibrium_matrix(assembly, points, plane=plane)
    springs = sparse.diags_array((stiffness * points.area[:, None]).ravel())
    k = sparse.csc_array(a @ springs @ a.T)[free][:, free]
    inertia = np.zeros((assembly.n_blocks, 6, 6))
    inertia[:, :3, :3] = x.mass[:, None, None] * np.eye(3)
    inertia[:, 3:, 3:] = x.inertia
    diagonal = list(basis.T @ inertia @ basis)
    mass = sparse.csc_array(sparse.block_diag(diagonal, format="csc"))[free][:, free]
    unit = np.broadcast_to(basis[:3].T, (assembly.n_blocks, basis.shape[1], 3))
    excited = mass @ unit.reshape(-1, 3)[free]

    def spread(vector: Array) -> Array:
        out = np.zeros(free.size)
        out[free] = vector
        return np.asarray(out.reshape(-1, basis.shape[1]) @ basis.T)

    total = (x.mass[:, None] * ~assembly.held[:, :3]).sum(axis=0)
    return VibratingSystem(
        sparse.csc_array(k), sparse.csc_array(mass), np.asarray(excited), spread, BlockCarrier(assembly),
        np.asarray(total, dtype=np.float64), label, None, warnings,
    )  # fmt: skip
