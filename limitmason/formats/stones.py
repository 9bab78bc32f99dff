"""Scanned stones: triangle meshes in PLY, STL or OBJ, one file or body each, made to meet across their mortar."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from limitmason.errors import InputError
from limitmason.geometry import Solid
from limitmason.geometry.growing import Gap, grown
from limitmason.model import Assembly, Joint

Array = NDArray[np.float64]

MESHES = (".ply", ".stl", ".obj", ".off")
_TURNS = {"x": ([1, 2, 0], [1, 1, 1]), "y": ([0, 2, 1], [1, -1, 1]), "z": ([0, 1, 2], [1, 1, 1])}
_DEGREES = 0.5  # faces that were made to meet are parallel to rounding; others that come near are not meant


class Stones(NamedTuple):
    """Stones of scans: points of each [m], shape (n, 3), their names, and volume over that of the convex hull."""

    points: list[Array]
    names: list[str]
    convexity: list[float]

    def grown(self, reach: float, against: Mapping[str, Solid] | None = None) -> MetStones:
        """Stones that meet where the gap between them is at most a reach [m]: mortar counted to the stones, half each.

        Parameters
        ----------
        reach : largest gap that is closed, about the thickness of a thick mortar joint [m]
        against : convex solids by name that keep their shape, such as ground and beam: stones grow to their faces

        Raises
        ------
        InputError
            Naming a stone of which its neighbours leave nothing.
        """
        met = grown(self.points, reach, list((against or {}).values()), self.names)
        names = [*self.names, *(against or {})]
        solids = [*met.solids, *(against or {}).values()]
        return MetStones(solids, names, met.gaps, met.before, met.after, met.moved, reach)


class MetStones(NamedTuple):
    """Stones made to meet, and what that changed; ``str`` of it says so line by line.

    ``solids`` and ``names``, those that kept their shape last; ``gaps`` closed between them (stones by number, plane,
    gap [m], below zero where they overlapped); volumes ``before`` and ``after`` [m3]; ``moved``: farthest that a face
    of each moved out [m]; ``reach`` asked for [m].
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
        between = 1e3 * np.array([g.gap for g in self.gaps])
        spread = (
            f"{len(between)} gaps closed, {between.min():.3g} to {between.max():.3g} mm, "
            f"median {np.median(between):.3g}"
            if len(between) else "no gap closed"
        )  # fmt: skip
        lines = [
            f"{len(self.before)} stones; {spread}; volume {self.before.sum():.4g} -> {self.after.sum():.4g} m3",
            *(f"  {self.names[g.i]} and {self.names[g.j]} overlapped by {-1e3 * g.gap:.3g} mm and were cut"
              for g in self.gaps if g.gap < 0.0),
        ]  # fmt: skip
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
        chosen = {"angle_tolerance_deg": _DEGREES, "wedge_tolerance_deg": 0.0, **options}
        return Assembly.from_polyhedra(
            self.solids, joint=joint, density=density, fixed=list(fixed), names=self.names, **chosen
        )


def read_stones(
    path: str | Path | Sequence[str | Path], *, scale: float = 1.0, up: str = "z", convexity: float = 0.85
) -> Stones:
    """Read scanned stones, one from every file, or from every separate body where one file holds all.

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
    program that made the mesh, into files of its own, or lower ``convexity`` to accept the hull.
    """
    if up not in _TURNS:
        raise InputError(f"up must be 'x', 'y' or 'z', got {up!r}")
    if not (np.isfinite(scale) and scale > 0.0):
        raise InputError(f"scale must be positive [m per unit], got {scale!r}")
    try:
        import trimesh
    except ImportError:
        message = "scanned stones need trimesh: pip install 'limitmason[solids]' (or pip install trimesh)"
        raise ImportError(message) from None
    files = list(_files(path))
    if not files:
        raise InputError(f"{path}: no file {', '.join(MESHES)} there")
    order, signs = (np.array(t) for t in _TURNS[up])
    points, names, shares = [], [], []
    for name, suffix, content in files:
        try:
            mesh: Any = trimesh.load(BytesIO(content), file_type=suffix[1:], force="mesh")
        except Exception as error:  # its readers raise whatever they meet
            raise InputError(f"{name}{suffix}: not a mesh that can be read: {error}") from None
        bodies = [mesh] if len(files) > 1 else list(mesh.split(only_watertight=False))
        for k, body in enumerate(bodies):
            label = name if len(bodies) == 1 else f"{name}-{k + 1}"
            corners = np.array(body.vertices, dtype=float)[:, order] * signs * scale
            try:
                hull = ConvexHull(corners)
            except Exception:
                raise InputError(f"{label}: no volume; its points lie in one plane, or are fewer than four") from None
            share = abs(float(body.volume)) * scale**3 / float(hull.volume)
            if share < convexity:
                raise InputError(
                    f"{label}: fills {100 * share:.0f} % of its convex hull, {100 * convexity:.0f} % asked for: split "
                    "it into convex stones, close its mesh if it is open, or lower convexity to take the hull"
                )
            points.append(corners[hull.vertices])
            names.append(label)
            shares.append(min(share, 1.0))
    return Stones(points, names, shares)


def _files(path: str | Path | Sequence[str | Path]) -> Iterator[tuple[str, str, bytes]]:
    """Name, suffix and content of every mesh, in the order of their names with numbers counted."""
    several = [Path(p) for p in path] if isinstance(path, (list, tuple)) else [Path(str(path))]
    if len(several) == 1 and several[0].suffix == ".zip":
        with zipfile.ZipFile(several[0]) as archive:
            found = {Path(name): name for name in archive.namelist() if Path(name).suffix.lower() in MESHES}
            for p in sorted(found, key=_natural):
                yield p.stem, p.suffix.lower(), archive.read(found[p])
        return
    if len(several) == 1 and several[0].is_dir():
        several = sorted((p for p in several[0].iterdir() if p.suffix.lower() in MESHES), key=_natural)
    for p in several:
        if p.suffix.lower() not in MESHES:
            raise InputError(f"{p}: a mesh is a file {', '.join(MESHES)}")
        yield p.stem, p.suffix.lower(), p.read_bytes()


def _natural(path: Path) -> tuple[str, int]:
    digits = "".join(c for c in path.stem if c.isdigit())
    return path.stem.rstrip("0123456789"), int(digits or 0)
