"""Scanned stones: triangle meshes in PLY, STL or OBJ, one file or body each, made to meet across their mortar.

They are grown in :mod:`limitmason.geometry.growing`; drawn outlines in :mod:`limitmason.formats.drawn_mortar`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from limitmason.arrays import Array
from limitmason.checks import finite, instance
from limitmason.errors import InputError
from limitmason.formats.meshes import bodies
from limitmason.geometry import Solid
from limitmason.geometry.growing import Gap, grown
from limitmason.geometry.shells import volume_of_mixed_faces
from limitmason.model import Assembly, Joint

_DEGREES = 0.5  # faces that were made to meet are parallel to rounding; others that come near are not meant

_CONVEXITY = 0.85
"""Volume over that of the convex hull from which on a stone is taken for its hull; chosen."""


class Stones(NamedTuple):
    """Stones of scans, each as its convex hull.

    ``points`` are corners of the hull of each [m], shape (n, 3), and ``names`` those of the files. ``convexity`` is the
    volume of each over that of its hull.
    """

    points: list[Array]
    names: list[str]
    convexity: list[float]

    def grown(self, reach: float, against: Mapping[str, Solid] | None = None) -> MetStones:
        """Stones that meet where the gap between them is at most a reach.

        The mortar counts to the stones, half to each.

        Parameters
        ----------
        reach : largest gap that is closed, about the thickness of a thick mortar joint [m]
        against : convex solids by name that keep their shape, such as ground and beam: stones grow to their faces

        Raises
        ------
        InputError
            Naming a stone of which its neighbours leave nothing.
        """
        held = {} if against is None else instance("against", against, Mapping, "solids by name")  # type: ignore[type-abstract]
        given = [instance(f"against[{name!r}]", solid, Solid) for name, solid in held.items()]
        met = grown(self.points, reach, given, self.names)
        names = [*self.names, *held]
        solids = [*met.solids, *given]
        return MetStones(solids, names, met.gaps, met.before, met.after, met.moved, reach)


class MetStones(NamedTuple):
    """Stones made to meet, and what that changed, told line by line by ``str``.

    Parameters
    ----------
    solids : the stones, then those that kept their shape [m]
    names : of the solids
    gaps : closed between them: stones by number, plane, and gap [m], below zero where they overlapped
    before : volume of every stone as it was [m3]
    after : volume of every stone as it is [m3]
    moved : farthest that a face of each stone moved out [m]
    reach : largest gap that was closed, as asked for [m]
    """

    solids: list[Solid]
    names: list[str]
    gaps: tuple[Gap, ...]
    before: Array
    after: Array
    moved: Array
    reach: float

    def __str__(self) -> str:
        """What was changed."""
        widths = 1e3 * np.array([g.gap for g in self.gaps])  # [mm]
        spread = "no gap closed"
        if len(widths):
            spread = (f"{len(widths)} gaps closed, {widths.min():.3g} to {widths.max():.3g} mm, "
                      f"median {np.median(widths):.3g}")
        lines = [
            f"{len(self.before)} stones; {spread}; volume {self.before.sum():.4g} -> {self.after.sum():.4g} m3",
            *(f"  {self.names[g.i]} and {self.names[g.j]} overlapped by {-1e3 * g.gap:.3g} mm and were cut"
              for g in self.gaps if g.gap < 0.0),
        ]
        met = {k for g in self.gaps for k in (g.i, g.j)}
        lines += [f"  {name} meets no other stone" for k, name in enumerate(self.names) if k not in met]
        return "\n".join(lines)

    def assembly(
        self, *, joint: Joint, density: float | Sequence[float], fixed: Sequence[str] = (), **options: Any
    ) -> Assembly:
        """Assembly of the stones and of what they were grown against.

        Contacts are found between parallel faces only (0.5 degrees): those in which stones were made to meet.

        Parameters
        ----------
        joint : law of every joint; ``options`` go to ``Assembly.from_polyhedra``, ``joints`` by kind among them
        density : [kg/m3], one or one per solid
        fixed : names that are held
        """
        if "names" in options:
            raise InputError("names: the stones keep those of their files")
        chosen = {"angle_tolerance_deg": _DEGREES, "wedge_tolerance_deg": 0.0, **options}
        return Assembly.from_polyhedra(
            self.solids, joint=joint, density=density, fixed=fixed, names=self.names, **chosen
        )


def read_stones(
    path: str | Path | Sequence[str | Path], *, scale: float = 1.0, up: str = "z", convexity: float = _CONVEXITY
) -> Stones:
    """Read scanned stones, one from every file or body.

    Separate bodies of a file are told apart where it is the only one.

    Parameters
    ----------
    path : files (.ply, .stl, .obj, .off), a folder or a .zip of them, or one file with several bodies
    scale : metres per unit of the files
    up : axis of the files that points up: "x", "y" or "z"
    convexity : least volume over that of the convex hull; the hull is then taken for the stone

    Returns
    -------
    Stones
        Names are those of the files; ``Stones.grown(reach)`` makes them meet.

    Raises
    ------
    ImportError
        When trimesh is not installed; the message says how to install it.
    InputError
        Naming the file: not a mesh, without volume, or less convex than asked for.

    Notes
    -----
    A stone is its convex hull: hollows are filled, and reported as ``convexity``. Split an L-shaped stone in the
    program that made the mesh, into files of its own, or lower ``convexity`` to accept the hull. Blocks that meet
    without mortar come by :func:`limitmason.formats.read_solids` exactly as drawn, notches and all.
    """
    finite("convexity", convexity)
    points, names, shares = [], [], []  # the share of its hull that each fills
    for body in (b for group in bodies(path, scale=scale, up=up) for b in group):
        try:
            hull = ConvexHull(body.corners)
        except Exception:
            raise InputError(f"{body.name}: no volume; its points lie in one plane, or are fewer than four") from None
        share = volume_of_mixed_faces(body.corners, body.triangles) / float(hull.volume)
        if share < convexity:
            raise InputError(
                f"{body.name}: fills {100 * share:.0f} % of its convex hull, {100 * convexity:.0f} % asked for: split "
                "it into convex stones, close its mesh if it is open, lower convexity to take the hull, or read blocks "
                "that meet without mortar by formats.read_solids, which keeps their notches"
            )
        points.append(body.corners[hull.vertices])
        names.append(body.name)
        shares.append(min(share, 1.0))  # no stone fills more: above it is rounding
    return Stones(points, names, shares)
