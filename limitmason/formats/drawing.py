"""Drawings as assemblies: outlines of a .dxf made prisms, solids of an .obj as they are."""

from pathlib import Path

from limitmason.errors import InputError
from limitmason.formats.dxf import read_dxf
from limitmason.formats.obj import read_obj
from limitmason.model import Assembly, Joint

DRAWINGS = (".dxf", ".obj")


def read_drawing(
    path: str | Path,
    *,
    joint: Joint | None = None,
    thickness: float | None = None,
    scale: float | None = None,
    tolerance: float | None = None,
) -> Assembly:
    """Blocks of a drawing and their contacts, without supports.

    Parameters
    ----------
    path : .dxf (closed outlines, x and z) or .obj (solids)
    joint : of every contact; where omitted one of 30 degrees, which is enough to look for contacts
    thickness : of the prisms over the outlines of a .dxf [m]; 1 m where omitted
    scale : metres per unit of the drawing; that of the file, or 1
    tolerance : gap or overlap up to which faces touch [m]; see :meth:`limitmason.Assembly.from_polyhedra`

    Raises
    ------
    InputError
        For another kind of file, for a thickness of solids, which have their own, and as the readers do.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in DRAWINGS:
        raise InputError(f"{path}: a drawing ends in {' or '.join(DRAWINGS)}, this in {suffix or 'nothing'}")
    law = Joint(30.0) if joint is None else joint
    if suffix == ".obj":
        if thickness is not None:
            raise InputError(f"{path}: thickness is for .dxf outlines; solids have their own")
        solids, names = read_obj(path) if scale is None else read_obj(path, scale=scale)
        return Assembly.from_polyhedra(solids, names=names, joint=law, tolerance=tolerance)
    outlines, names, _ = read_dxf(path, scale=scale)
    deep = 1.0 if thickness is None else thickness
    return Assembly.from_polygons(outlines, names=names, thickness=deep, joint=law, tolerance=tolerance)
