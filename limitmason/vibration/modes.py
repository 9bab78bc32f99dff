"""Natural modes of any model: frequencies, shapes at blocks, nodes or chosen points, and the mass that takes part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from inspect import signature
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import numbers
from limitmason.display.notebook import Displayed
from limitmason.display.text_table import aligned
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.storage.csv_table import Tabular
from limitmason.storage.frozen import ReadOnly
from limitmason.vibration.blocks import closed_system
from limitmason.vibration.eigensolver import REST, largest_of, lowest
from limitmason.vibration.system import Vibrates, VibratingSystem

# chosen, not derived, far from both what rounding leaves and what tells motions apart
_AT_REST = 1e-6  # of the largest frequency found: below it nothing holds the motion
_REPEATED = 1e-8  # of (2 pi f)^2: modes this near are equal, and any motion that they span is one
_ORDERS = 5  # degrees 0 to 4 of the moments that may give a mode its sign
_SEEN = 1e-2  # of the largest moment there could be: below it a moment may be rounding
_FIRST = 0.6  # of the largest moment of a degree: the first this large counts, so that equal ones cannot change places


@dataclass(frozen=True, eq=False)
class Modes(Displayed, Tabular, ReadOnly):
    """Natural modes, lowest first.

    Shapes are of unit modal mass. A mode moves the mass towards +x, +y or +z, the first that is among its largest
    moments. Where it moves none on balance the moments of the motion about the centroid count.

    Parameters
    ----------
    frequency : [Hz], shape (k,); zero where nothing holds the motion
    shape : displacement (and rotation, for blocks) of every block or node per mode, shape (k, n, 6) or (k, n, 3); of
        blocks that deform the coordinates of their shapes behind, (k, n, 6 + m)
    participating : mass that a mode moves when the ground shakes along x, y, z [kg], shape (k, 3)
    residual : |K u - w^2 M u| over |K u| per mode [-], shape (k,); over the largest |K u| for modes at rest
    system : what vibrates
    below : modes up to the last one, and those equal to it, counted by the pivots of K - w^2 M: none is missing; None
        where they could not be counted
    """

    frequency: Array
    shape: Array
    participating: Array
    residual: Array
    system: VibratingSystem
    below: int | None = None

    def __len__(self) -> int:
        return len(self.frequency)

    @property
    def places(self) -> Array:
        """Centroids of blocks or nodes of a continuum [m], shape (n, 3)."""
        return self.system.carrier.places

    @property
    def share(self) -> Array:
        """Participating mass over the mass that can move [-], shape (k, 3).

        It is 0 along an axis on which none can.
        """
        total = self.system.total
        return np.asarray(self.participating / np.where(total > 0.0, total, np.inf))

    @property
    def quantities(self) -> dict[str, float]:
        """Frequencies by name, "frequency 1" and so on [Hz]."""
        return {f"frequency {k + 1}": float(f) for k, f in enumerate(self.frequency)}

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know before trusting the frequencies."""
        if self.below is None:
            return (*self.system.warnings, "modes could not be counted: it is not proven that none is missing")
        if self.below > len(self):
            more = f"mode {len(self)} is one of several equal ones, of which {self.below - len(self)} are not shown: "
            return (*self.system.warnings, more + f"count={self.below} gives them all")
        return self.system.warnings

    def at(self, points: ArrayLike) -> Array:
        """Displacement of chosen points per mode, shape (k, p, 3).

        Points [m] have shape (p, 3).

        Raises
        ------
        InputError
            For points of other shapes, that are not finite, and points in no block.
        """
        p = np.atleast_2d(numbers("points", points))
        if p.ndim != 2 or p.shape[1] != 3:
            raise InputError(f"points must have three coordinates each, shape (p, 3), got {p.shape}")
        if not np.isfinite(p).all():
            raise InputError(f"points must have finite coordinates [m], got {p[~np.isfinite(p).all(axis=1)][0]}")
        return np.array([self.system.carrier.at(shape, p) for shape in self.shape])

    def tabulated(self) -> tuple[Mapping[str, str], list[Sequence[Any]]]:
        """Frequency and shares of mass with their units, and a row for each mode."""
        units = {"mode": "-", "frequency": "Hz", "mass x": "-", "mass y": "-", "mass z": "-"}
        return units, [[k + 1, f, *share] for k, (f, share) in enumerate(zip(self.frequency, self.share, strict=True))]

    def __str__(self) -> str:
        """Table of frequencies and participating masses."""
        head = ["mode", "frequency [Hz]", "mass x", "mass y", "mass z"]
        rows = [
            [str(k + 1), f"{f:.4g}", *(f"{s:.1%}" for s in share)]
            for k, (f, share) in enumerate(zip(self.frequency, self.share, strict=True))
        ]
        text = aligned([head, *rows], "<>>>>")
        return "\n".join([f"modes of {self.system.label}", text, *self.warnings])

    __repr__ = __str__


def modes(model: Assembly | Vibrates, count: int = 3, **options: Any) -> Modes:
    """Lowest natural modes of a model, K u = (2 pi f)^2 M u.

    Parameters
    ----------
    model : an ``Assembly`` (blocks on elastic joints, all closed), or what has a ``vibration`` method: a
        ``Continuum`` (elastic) or a curve of one (damaged), a capacity curve of blocks, a ``dem.History`` (the
        tangent at the state it ended in)
    count : how many modes
    options : of the model. Assembly: ``contact_points``, ``contact_model``, ``stiffness`` (kn or (kn, ks) [Pa/m]),
        ``blocks`` ("rigid", "simply deformable" or "ritz") and ``stress``, see
        :func:`limitmason.vibration.blocks.closed_system`; capacity curve: ``sample``, ``sliding``; DEM: ``sliding``
        ("sticks" or "drops": points at their strength keep or lose their shear stiffness)

    Returns
    -------
    Modes

    Raises
    ------
    InputError
        When a free block has no mass, fewer modes exist than asked for, or the model cannot vibrate.
    TypeError
        For an option that the model's vibration does not take.
    NotConverged
        When the iteration for the modes fails, or misses one that was counted.

    Notes
    -----
    Repeated modes, as of equal piers, come as often as they are. Any shapes that span the same motions are right: the
    first given moves most mass along x, or along y or z where that is far more. Damping is left out. Of a state only
    joints or cracks that are open count; large displacements of it do not.
    """
    vibrates = partial(closed_system, model) if isinstance(model, Assembly) else getattr(model, "vibration", None)
    if vibrates is None:
        raise InputError(f"a {type(model).__name__} has no vibration: give an Assembly, a Continuum or a state")
    taken = signature(vibrates).parameters
    for name in options:
        if name not in taken and not any(p.kind is p.VAR_KEYWORD for p in taken.values()):
            known = ", ".join(taken) or "none"
            raise TypeError(f"modes: there is no option {name!r} of this {type(model).__name__}; there are {known}")
    return solved(vibrates(**options), count)


def solved(system: VibratingSystem, count: int) -> Modes:
    """The ``count`` lowest modes of a system, with residuals and a count of all.

    Parameters
    ----------
    system : K and M of the free unknowns
    count : how many modes, at most as many as there are unknowns

    Raises
    ------
    InputError, NotConverged
        As :func:`modes`.
    """
    n = system.stiffness.shape[0]
    if not (isinstance(count, int | np.integer) and 1 <= count <= n):
        raise InputError(f"count must lie between 1 and {n}, got {count!r}")
    k, m = system.stiffness, system.mass
    value, vector, below, _ = lowest(system, count)
    # a motion that nothing holds, whose eigenvalue is rounding of the largest ones
    at_rest = value < max(_AT_REST**2 * float(value.max()), REST * largest_of(system))
    vector = _directed(system, np.where(at_rest, 0.0, value), vector)
    stiff = k @ vector
    size = np.linalg.norm(stiff, axis=0)
    off = np.linalg.norm(stiff - (m @ vector) * np.where(at_rest, 0.0, value), axis=0)
    # a motion that nothing resists has no force of its own to measure its residual by
    size = np.where(at_rest, max(float(size.max()), 1e-300), size)
    frequency = np.where(at_rest, 0.0, np.sqrt(np.maximum(value, 0.0))) / (2.0 * np.pi)
    shape = np.array([system.spread(v) for v in vector.T])
    participating = (vector.T @ system.excited) ** 2
    return Modes(frequency, shape, participating, off / size, system, below)


def _directed(system: VibratingSystem, value: Array, vector: Array) -> Array:
    """Eigenvectors whose sign does not hang on rounding or numbering.

    Nor do the directions of repeated ones. The first of a group of equal ones has the largest of one moment, the others
    none of it, and so on. Moments are taken in the order of their degree, translations before rotations of blocks.

    Parameters
    ----------
    system : what vibrates
    value : (2 pi f)^2, ascending, which tells which modes are equal [1/s2], shape (k,)
    vector : eigenvectors of unit modal mass as columns, shape (r, k)

    Returns
    -------
    ndarray
        Vectors as columns, those of every group turned among themselves, shape (r, k).
    """
    motion = np.array([system.spread(v)[:, :6] for v in vector.T])
    moments = list(_moments(system, motion))
    out = vector.copy()
    # a group ends where the next eigenvalue is farther off than those of equal ones
    breaks = np.flatnonzero(np.diff(value) > _REPEATED * np.abs(value[1:])) + 1
    for group in np.split(np.arange(len(value)), breaks):
        chosen = np.empty((0, len(group)))  # unit directions among the vectors of the group, as rows
        for of_degree in moments:
            left = of_degree[:, group]
            while len(chosen) < len(group):
                # what the directions chosen before leave of the moments, as Gram and Schmidt
                left = left - left @ chosen.T @ chosen
                size = np.linalg.norm(left, axis=1)
                # the moments of the next degree, where these may be rounding
                if size.max() < _SEEN:
                    break
                row = int(np.argmax(size >= _FIRST * size.max()))
                chosen = np.vstack([chosen, left[row] / size[row]])
        # any directions at right angles complete those that no moment tells apart
        rest = np.linalg.svd(chosen, full_matrices=True)[2][len(chosen) :] if len(chosen) else np.eye(len(group))
        out[:, group] = vector[:, group] @ np.vstack([chosen, rest]).T
    return out


def _moments(system: VibratingSystem, motion: Array) -> Iterator[Array]:
    """Moments of k motions about the centroid [-], per degree an array (moments, k).

    They choose signs and directions of modes, see :func:`_directed`. A moment is the sum of mass times motion times a
    product of coordinates, over the most it could be for a translation of unit modal mass. Translations come first,
    then rotations times the reach of the structure, whose moments may be larger.

    Parameters
    ----------
    system : whose places and masses count
    motion : of unit modal mass, displacement [m], and rotation [rad] of blocks, per place, shape (k, n, 3) or (k, n, 6)
    """
    moving = system.carrier.moving
    places, mass = system.carrier.places[moving], np.maximum(system.carrier.masses[moving], 0.0)
    from_centre = places - np.average(places, axis=0, weights=mass)
    reach = max(float(np.linalg.norm(from_centre, axis=1).max()), 1e-300)
    # roots of the mass with the motions and with the weights: the scalar product of two vectors, at most 1
    x, root = from_centre / reach, np.sqrt(mass)[:, None]
    for motions in (motion[:, moving, :3], reach * motion[:, moving, 3:]):
        for degree in range(_ORDERS):
            # all products of x, y and z of that degree
            powers = [(degree - a, a - b, b) for a in range(degree + 1) for b in range(a + 1)]
            weight = np.column_stack([np.prod(x**p, axis=1) for p in powers]) * root
            weight = weight / np.maximum(np.linalg.norm(weight, axis=0), 1e-300)
            shared = np.einsum("nw,kni->iwk", weight, root * motions)
            if shared.size:
                yield shared.reshape(-1, len(motion))
