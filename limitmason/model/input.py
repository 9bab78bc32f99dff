"""What users write, read into the model's own forms: solids, densities and tables of joints."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from limitmason.checks import numbers
from limitmason.errors import InputError
from limitmason.geometry.polygon import clean_outline, convex_pieces
from limitmason.geometry.polyhedron import Solid, encloses, prism
from limitmason.model.joint import Joint

JointTable = Mapping[Any, Joint]


def read_names(names: Sequence[str] | None, count: int) -> tuple[str, ...]:
    """Names of blocks, each its own.

    Where ``names`` is None they are "block-0", "block-1", ..., as many as ``count``.
    """
    if names is None:
        return tuple(f"block-{i}" for i in range(count))
    if isinstance(names, str) or not isinstance(names, Iterable):
        raise InputError(f"names must be a list of block names, got {names!r}")
    read = tuple(str(n) for n in names)
    if len(read) != count:
        raise InputError(f"{len(read)} names are given for {count} blocks")
    if len(set(read)) < len(read):
        twice = next(n for n in read if read.count(n) > 1)
        raise InputError(f"block name {twice!r} is used more than once")
    return read


def read_list(name: str, value: Any) -> list[Any]:
    """Items of a list or of what else gives them one after the other, or an error that names the argument."""
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise InputError(f"{name} must be a list, got {value!r}")
    return list(value)


def read_recipe(recipe: Any) -> dict[str, Any]:
    """A copy of a recipe, an empty one for None."""
    if not isinstance(recipe, Mapping | None):
        raise InputError(f"recipe must be a mapping of plain data, got {recipe!r}")
    return dict(recipe or {})


def read_axes(axes: Any, count: int) -> list[Any]:
    """Length direction of every block as laid, None for one without; ``axes`` None gives none to all."""
    read = [None] * count if axes is None else read_list("axes", axes)
    if len(read) != count:
        raise InputError(f"{len(read)} axes are given for {count} blocks: give None for a block without")
    return read


def read_densities(density: Any, names: Sequence[str]) -> list[float]:
    """Density of every block [kg/m3] from one number or one per block.

    A wrong one is an error naming the block.

    Parameters
    ----------
    density : as given [kg/m3]; booleans and text are no numbers, though arrays can be made of them
    names : of the blocks, for messages
    """
    try:
        values = np.asarray(density, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"density must be a number [kg/m3] or one per block, got {density!r}") from None
    if np.asarray(density).dtype.kind not in "fiu":
        raise InputError(f"density must be a number [kg/m3] or one per block, got {density!r}")
    if values.shape not in ((), (len(names),)):
        raise InputError(f"density must be one number or one per block ({len(names)}), got shape {values.shape}")
    values = np.broadcast_to(values, (len(names),))
    for name, value in zip(names, values.tolist(), strict=True):
        if not (np.isfinite(value) and value >= 0):
            raise InputError(f"block {name!r}: density must be finite and not negative [kg/m3], got {value}")
    return [float(v) for v in values]


def read_pieces(solid: Any, name: str) -> tuple[Solid, ...]:
    """Convex pieces of one block, whatever of the allowed forms it came in.

    Parameters
    ----------
    solid : a solid, (vertices [m], faces as vertex numbers), or a list of these
    name : of the block, for messages
    """
    try:
        if isinstance(solid, Solid):
            items = [solid]
        elif len(solid) == 2 and np.ndim(solid[0][0]) == 1 and np.ndim(solid[0][0][0]) == 0:
            items = [solid]  # vertices first: a list of pieces would have a whole array there
        else:
            items = list(solid)
        out = []
        for vertices, faces in items:
            v = np.array(vertices, dtype=float)
            if v.ndim != 2 or v.shape[1] != 3:
                raise InputError(f"vertices must have shape (n, 3), got {v.shape}")
            v.setflags(write=False)
            # tuples of whole numbers already: kept without a copy
            plain = isinstance(faces, tuple) and all(isinstance(f, tuple) for f in faces)
            if not (plain and all(type(i) is int for f in faces for i in f)):
                given = [tuple(f) for f in faces]
                faces = tuple(tuple(int(i) for i in f) for f in given)
                if list(faces) != given:
                    raise InputError("faces must be whole numbers of vertices")
            # a tetrahedron has the fewest
            if len(faces) < 4:
                raise InputError(f"a solid has four faces or more, here are {len(faces)}")
            out.append(Solid(v, faces))
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"block {name!r}: expected (vertices, faces) or a list of such pieces; {error}") from None
    if not out:
        raise InputError(f"block {name!r} has no pieces")
    return tuple(out)


def read_prisms(
    outlines: Sequence[Any], names: Sequence[str], thickness: float, tolerance: float | None
) -> list[list[Solid]]:
    """Convex pieces of blocks that are prisms over outlines.

    Outlines lie in the x-z plane, prisms between y = 0 and a thickness.

    Parameters
    ----------
    outlines : simple polygons in either sense, columns x and z [m], shape (n, 2) each
    names : of the blocks, for messages
    thickness : extent in y [m], > 0
    tolerance : gap up to which faces touch, if it was given [m]
    """
    arrays = [numbers(f"outlines: {name}", o) for name, o in zip(names, outlines, strict=True)]
    sizes = [np.ptp(o, axis=0).min() for o in arrays if o.ndim == 2 and o.shape[0] > 2 and np.isfinite(o).all()]
    # corners nearer than this are one: far below what counts as a gap, far above rounding
    slack = 1e-3 * tolerance if tolerance else 1e-9 * (float(np.median(sizes)) if sizes else 1.0)
    solids = []
    for name, outline in zip(names, arrays, strict=True):
        try:
            pieces = convex_pieces(clean_outline(outline, slack))
        except ValueError as error:
            raise InputError(f"block {name!r}: {error}") from None
        prisms = [prism(piece, y0=0.0, y1=thickness) for piece in pieces]
        # corners all but on one line, as rounding of a drawing leaves them, make pieces that enclose nothing
        whole = prisms if len(prisms) == 1 else [p for p, full in zip(prisms, encloses(prisms), strict=True) if full]
        solids.append(whole or prisms)
    return solids


def read_vector(name: str, value: Any) -> np.ndarray:
    """Three finite numbers, shape (3,), or an error that names the argument.

    Parameters
    ----------
    name : of the argument, for the message
    value : as given
    """
    try:
        vector = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        vector = np.empty(0)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError(f"{name} must be three finite numbers, got {value!r}")
    return vector


def read_direction(name: str, value: Any) -> np.ndarray:
    """A direction made of unit length, or an error that names the argument."""
    vector = read_vector(name, value)
    if not vector.any():
        raise InputError(f"{name} must be a direction that is not zero, got {value!r}")
    # squares of longer and of shorter ones are no numbers
    if not 1e-100 < np.abs(vector).max() < 1e100:
        vector = vector / np.abs(vector).max()
    return vector / np.linalg.norm(vector)


def read_fixed(fixed: Any, name: str = "fixed") -> tuple[int | str, ...]:
    """Names or numbers of blocks, as a user gives them.

    A single one is an error that says how to write it.

    Parameters
    ----------
    fixed : as given
    name : of the argument, for messages
    """
    if isinstance(fixed, str | int | np.integer):
        raise InputError(f"{name} must be a list of block names or numbers: write {name}=[{fixed!r}]")
    if not isinstance(fixed, Iterable):
        raise InputError(f"{name} must be a list of block names or numbers: for none write {name}=[]")
    out = tuple(fixed)
    for item in out:
        if not isinstance(item, str | int | np.integer) or isinstance(item, bool):
            raise InputError(f"{name}: {item!r} is neither a block name nor a whole number")
    return out


class JointChoice:
    """Picks a joint by pair of block names, then by kind, then the default.

    ``pairs`` and ``kinds`` are the laws by both, ``names`` those of all blocks by number. ``used`` are the keys by
    which a law was picked so far.
    """

    def __init__(
        self, default: Joint | None, table: JointTable, names: Sequence[str], *, required: bool = True
    ) -> None:
        """Sort a table of joint laws by kind and by pair of blocks.

        Parameters
        ----------
        default : law of the joints that the table does not name; None where these keep theirs
        table : laws by kind, or by pair of block names in either order
        names : of all blocks, by number
        required : whether there must be a default
        """
        if not isinstance(default, Joint) and (required or default is not None):
            raise InputError(f"joint must be a limitmason.Joint, got {default!r}")
        self.default = default
        self.kinds: dict[str, Joint] = {}
        self.pairs: dict[frozenset[str], Joint] = {}
        self.used: set[Any] = set()
        self.names = names
        if not isinstance(table, Mapping):
            raise InputError(f"joints must be a table {{'head': Joint(...)}} or {{('a', 'b'): ...}}, got {table!r}")
        for key, law in table.items():
            if not isinstance(law, Joint):
                raise InputError(f"joints[{key!r}] must be a limitmason.Joint, got {law!r}")
            if isinstance(key, str):
                self.kinds[key] = law
            elif isinstance(key, tuple) and len(key) == 2:
                for name in key:
                    if name not in names:
                        raise InputError(f"joints[{key!r}]: there is no block named {name!r}")
                self.pairs[frozenset(key)] = law
            else:
                raise InputError(f"joints[{key!r}]: a key is a kind ('bed', 'head', 'base') or a pair of block names")

    def __call__(self, a: int, b: int, kind: str) -> Joint | None:
        """Law of a joint: that of its pair of blocks, else of its kind, else the default.

        ``a`` and ``b`` are the numbers of the blocks.
        """
        if self.pairs and (pair := frozenset((self.names[a], self.names[b]))) in self.pairs:
            self.used.add(pair)
            return self.pairs[pair]
        if kind in self.kinds:
            self.used.add(kind)
            return self.kinds[kind]
        return self.default

    def check_all_used(self) -> None:
        """A pair that touches nowhere is a mistake, and so is a kind that is not known."""
        for pair in self.pairs:
            if pair not in self.used:
                raise InputError(f"joints: blocks {' and '.join(map(repr, sorted(pair)))} do not touch")
        for kind in self.kinds:
            if kind not in ("bed", "head", "base") and kind not in self.used:
                raise InputError(f"joints: there is no joint of kind {kind!r}; kinds are 'bed', 'head' and 'base'")
