"""Time series for ParaView: one VTU file of blocks per sample, and the PVD file that gives their times."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import choice
from limitmason.errors import InputError
from limitmason.formats import vtu
from limitmason.geometry.rotation import rotation_matrices, rotation_vectors
from limitmason.mechanics.motion import RigidMotion
from limitmason.model import Assembly
from limitmason.storage.files import named_path, write_text


def write_pvd(
    path: str | Path,
    assembly: Assembly,
    history: Any = None,
    *,
    shift: ArrayLike | None = None,
    quaternion: ArrayLike | None = None,
    times: ArrayLike | None = None,
    every: int = 1,
    encoding: str = "base64",
) -> tuple[Path, ...]:
    """Write the motion of the blocks as a series that ParaView plays.

    Parameters
    ----------
    path : of the index, by custom ending in .pvd; samples go to "<stem>-0000.vtu", ... beside it
    assembly : what was simulated
    history : anything with ``shift``, ``quaternion`` and, by name, "step" or "time", such as ``dem.History``
    shift, quaternion : instead of a history: displacement of every centroid [m], shape (samples, n, 3), and rotation
        of every block from its place in the assembly, scalar first, shape (samples, n, 4)
    times : shape (samples,); by default the history's steps, else sample numbers
    every : write only every so many-th sample; the last one is always written
    encoding : "base64" or "ascii", as in :func:`limitmason.formats.write_vtu`

    Returns
    -------
    paths written, the index first

    Raises
    ------
    InputError
        When there is no sample, the arrays are not those of the assembly, or times decrease.

    Notes
    -----
    Points are those of the assembly at rest; the point data ``displacement`` [m] is the finite rigid motion of their
    block, so that *Warp By Vector* with factor 1 shows the true position. Per cell: ``block``, ``density`` [kg/m3],
    ``fixed``, ``shift`` [m] of the block's centroid, ``rotation`` vector [rad], and ``opening`` [m], the largest one in
    the block's joints, where the history records it (NaN where its contacts were found anew).
    """
    choice("encoding", encoding, vtu.ENCODINGS)
    if not isinstance(every, int) or every < 1:
        raise InputError(f"every must be a whole number of at least 1, got {every!r}")
    if history is not None:
        shift = history.shift if shift is None else shift
        quaternion = history.quaternion if quaternion is None else quaternion
        times = history["step"] if times is None else times
    u, q, t = _checked(assembly, shift, quaternion, times)
    opening = None if history is None else getattr(history, "opening", None)
    target = named_path(path)
    grid, cells, _ = vtu._blocks(assembly, None, None)
    counts = [len(part.vertices) for block in assembly.blocks for part in block.parts]
    owner = np.repeat(cells["block"], counts)
    names = [b.name for b in assembly.blocks]
    rows = sorted({*range(0, len(t), every), len(t) - 1})
    files = []
    for number, k in enumerate(rows):
        vector = rotation_vectors(q[k])
        motion = RigidMotion(assembly.centroids, u[k], rotation_matrices(vector))
        data = {"displacement": motion.moved(grid.points, owner) - grid.points}
        more = {"shift": u[k][cells["block"]], "rotation": vector[cells["block"]]}
        if opening is not None and len(assembly.interfaces):
            more["opening"] = _of_blocks(assembly, np.asarray(opening[k], dtype=float))[cells["block"]]
        files.append(target.with_name(f"{target.stem}-{number:04d}.vtu"))
        vtu._write(files[-1], grid, {**cells, **more}, data, encoding, names)
    _write_index(target, files, t[rows])
    return (target, *files)


def _checked(
    assembly: Assembly, shift: ArrayLike | None, quaternion: ArrayLike | None, times: ArrayLike | None
) -> tuple[Array, Array, Array]:
    if shift is None or quaternion is None:
        raise InputError("give a history, or shift and quaternion")
    u, q = np.asarray(shift, dtype=float), np.asarray(quaternion, dtype=float)
    n = assembly.n_blocks
    if u.ndim != 3 or u.shape[1:] != (n, 3) or q.shape != u.shape[:2] + (4,):
        raise InputError(
            f"shift and quaternion have shapes {u.shape} and {q.shape}; an assembly of {n} blocks needs "
            f"(samples, {n}, 3) and (samples, {n}, 4)"
        )
    if not len(u):
        raise InputError("there is no sample to write")
    t = np.arange(len(u), dtype=float) if times is None else np.asarray(times, dtype=float)
    if t.shape != (len(u),) or not (np.diff(t) >= 0.0).all():
        raise InputError(f"times must not decrease and be one per sample ({len(u)}), got shape {t.shape}")
    return u, q, t


def _of_blocks(assembly: Assembly, opening: Array) -> Array:
    """Largest opening among the interfaces of each block, NaN where none is known [m], shape (n,)."""
    largest = np.full(assembly.n_blocks, -np.inf)
    known = np.isfinite(opening)
    x = assembly.arrays
    for blocks in (x.block_a, x.block_b):
        np.maximum.at(largest, blocks[known], opening[known])
    return np.where(np.isfinite(largest), largest, np.nan)


def _write_index(path: Path, files: Sequence[Path], times: Array) -> None:
    out = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "<Collection>"]
    for file, time in zip(files, times.tolist(), strict=True):
        out.append(f'<DataSet timestep="{time!r}" part="0" file={quoteattr(file.name)}/>')
    out += ["</Collection>", "</VTKFile>", ""]
    write_text(path, "\n".join(out))
