"""The assembly: blocks, the interfaces found between them, supports and the recipe it was built from."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitmason.constants import GRAVITY, RELATIVE_TOLERANCE
from limitmason.geometry.contact import find_contacts
from limitmason.geometry.polygon import clean_outline, convex_pieces
from limitmason.geometry.polyhedron import Solid, check_solids, mass_properties, prism
from limitmason.model.arrays import AssemblyArrays, face_arrays
from limitmason.model.block import Block
from limitmason.model.input import JointChoice, JointTable, read_densities, read_fixed, read_number, read_pieces
from limitmason.model.interface import Interface, interface_kind, pulled_in
from limitmason.model.joint import Joint
from limitmason.model.support import Support

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Assembly:
    """Rigid blocks in contact.

    Build one with :meth:`from_polygons`, :meth:`from_polyhedra` or the builders in ``limitmason.build``.

    Parameters
    ----------
    blocks, interfaces, supports : see ``Block``, ``Interface``, ``Support``
    recipe : plain data the assembly was built from (wall plan, bond, units); mechanisms read their parameters there
    tolerance : gap or overlap up to which faces count as touching [m]
    """

    blocks: tuple[Block, ...]
    interfaces: tuple[Interface, ...]
    supports: tuple[Support, ...] = ()
    recipe: Mapping[str, Any] = field(default_factory=dict)
    tolerance: float = 0.0

    # ---- construction -------------------------------------------------------------------------------------------

    @classmethod
    def from_polyhedra(
        cls,
        solids: Sequence[Any],
        *,
        joint: Joint,
        density: float | ArrayLike = 2000.0,
        fixed: Iterable[int | str] = (),
        names: Sequence[str] | None = None,
        joints: JointTable | None = None,
        recipe: Mapping[str, Any] | None = None,
        tolerance: float | None = None,
        axes: Sequence[ArrayLike | None] | None = None,
    ) -> "Assembly":
        """Assembly of closed solids; contacts are found where plane faces of two blocks meet.

        Parameters
        ----------
        solids : per block (vertices [m], shape (n, 3); faces as vertex index lists, counter-clockwise from outside),
            or a list of such convex pieces for a concave block
        joint : law of every joint not named in ``joints``
        density : mass density [kg/m3], one or one per block
        fixed : names or numbers of blocks held in all six degrees of freedom
        names : unique block names; "block-0", ... by default
        joints : laws by kind ("bed", "head", "base") or by pair of block names ("a", "b"); a pair goes before a kind
        recipe : plain data to keep with the assembly
        tolerance : gap or overlap up to which faces count as touching [m]; 1e-4 of the median smallest block
            dimension by default
        axes : length direction of each unit as laid, or None

        Raises
        ------
        ValueError
            For open, inverted, flat, concave or overlapping solids, repeated names, negative density, and blocks
            without a path of contacts to a support; the message names the block.
        """
        if not len(solids):
            raise ValueError("an assembly needs at least one block")
        names = tuple(f"block-{i}" for i in range(len(solids))) if names is None else tuple(str(n) for n in names)
        if len(names) != len(solids):
            raise ValueError(f"{len(names)} names are given for {len(solids)} blocks")
        if len(set(names)) < len(names):
            twice = next(n for n in names if names.count(n) > 1)
            raise ValueError(f"block name {twice!r} is used more than once")
        densities = read_densities(density, names)
        pieces = [read_pieces(solid, name) for solid, name in zip(solids, names, strict=True)]
        if axes is None:
            axes = [None] * len(pieces)
        blocks = tuple(
            Block(n, p, d, None if a is None else np.asarray(a, dtype=float))
            for n, p, d, a in zip(names, pieces, densities, axes, strict=True)
        )
        supports = tuple(Support.fixed(f) for f in read_fixed(fixed))
        if tolerance is None:
            extent = np.array([np.ptp(np.vstack([s.vertices for s in p]), axis=0).min() for p in pieces])
            tolerance = RELATIVE_TOLERANCE * float(np.nanmedian(extent))
            tolerance = tolerance if np.isfinite(tolerance) and tolerance > 0 else RELATIVE_TOLERANCE
        elif not read_number("tolerance", tolerance) > 0:
            raise ValueError(f"tolerance must be positive [m], got {tolerance!r}")
        assembly = cls(blocks, (), supports, dict(recipe or {}), float(tolerance))
        return assembly._with_contacts(joint, joints or {})

    @classmethod
    def from_polygons(
        cls,
        outlines: Sequence[ArrayLike],
        *,
        thickness: float,
        joint: Joint,
        density: float | ArrayLike = 2000.0,
        fixed: Iterable[int | str] = (),
        names: Sequence[str] | None = None,
        joints: JointTable | None = None,
        recipe: Mapping[str, Any] | None = None,
        tolerance: float | None = None,
    ) -> "Assembly":
        """Assembly of prisms over outlines in the x-z plane, between y = 0 and y = thickness.

        Parameters
        ----------
        outlines : simple polygons in either sense, concave ones too [m], shape (n, 2) each, columns x and z
        thickness : extent in y [m], > 0
        joint, density, fixed, names, joints, recipe, tolerance : as in :meth:`from_polyhedra`

        Raises
        ------
        ValueError
            As :meth:`from_polyhedra`, and for outlines that cross themselves or enclose no area.
        """
        if not read_number("thickness", thickness) > 0:
            raise ValueError(f"thickness must be positive [m], got {thickness!r}")
        if names is not None and len(names) != len(outlines):
            raise ValueError(f"{len(names)} names are given for {len(outlines)} outlines")
        if tolerance is not None:
            read_number("tolerance", tolerance)
        names = tuple(f"block-{i}" for i in range(len(outlines))) if names is None else tuple(names)
        arrays = [np.asarray(o, dtype=float) for o in outlines]
        sizes = [np.ptp(o, axis=0).min() for o in arrays if o.ndim == 2 and o.shape[0] > 2 and np.isfinite(o).all()]
        slack = 1e-3 * tolerance if tolerance else 1e-9 * (float(np.median(sizes)) if sizes else 1.0)
        solids = []
        for name, outline in zip(names, arrays, strict=True):
            try:
                pieces = convex_pieces(clean_outline(outline, slack))
            except ValueError as error:
                raise ValueError(f"block {name!r}: {error}") from None
            solids.append([prism(piece, 0.0, thickness) for piece in pieces])
        return cls.from_polyhedra(
            solids, joint=joint, density=density, fixed=fixed, names=names, joints=joints, recipe=recipe,
            tolerance=tolerance,
        )  # fmt: skip

    def _with_contacts(self, joint: Joint, table: JointTable) -> "Assembly":
        pieces = [part for block in self.blocks for part in block.parts]
        owner = np.repeat(np.arange(self.n_blocks), [len(b.parts) for b in self.blocks])
        labels = [self.blocks[i].name for i in owner]
        check_solids(pieces, labels, self.tolerance)
        self._check_pieces(pieces, owner)
        found = find_contacts(pieces, owner, self.tolerance)
        if found.overlaps:
            i, j, depth = max(found.overlaps, key=lambda o: o[2])
            more = f" ({len(found.overlaps)} overlapping pairs in all)" if len(found.overlaps) > 1 else ""
            raise ValueError(
                f"blocks {self.blocks[i].name!r} and {self.blocks[j].name!r} overlap by {depth:.3g} m, more than the "
                f"tolerance of {self.tolerance:.3g} m{more}; correct the geometry or raise the tolerance"
            )
        choose = JointChoice(joint, table, [b.name for b in self.blocks])
        whole = self.fixed
        interfaces = []
        for a, b, polygon, normal in zip(
            found.a.tolist(), found.b.tolist(), found.polygons, found.normals, strict=True
        ):
            kind = interface_kind(normal, whole[a], whole[b])
            interfaces.append(Interface(a, b, polygon, normal, choose(a, b, kind) or joint, kind))
        choose.check_all_used()
        assembly = replace(self, interfaces=tuple(interfaces))
        if assembly.supports:
            assembly.check_connected()
        return assembly

    def _check_pieces(self, pieces: list[Solid], owner: NDArray[np.intp]) -> None:
        """Pieces of one block may touch but not overlap: their volumes are added up."""
        several = np.bincount(owner)[owner] > 1
        if not several.any():
            return
        rows = np.flatnonzero(several)
        among = find_contacts([pieces[i] for i in rows], np.arange(len(rows)), self.tolerance)
        for i, j, depth in among.overlaps:
            if owner[rows[i]] == owner[rows[j]]:
                raise ValueError(
                    f"two pieces of block {self.blocks[owner[rows[i]]].name!r} overlap by {depth:.3g} m; the convex "
                    "pieces of a block must fill it without overlapping"
                )

    # ---- variants -----------------------------------------------------------------------------------------------

    def with_supports(self, supports: Iterable[Support]) -> "Assembly":
        """This assembly with further supports; a new one for a block replaces the block's old one."""
        new = tuple(supports)
        replaced = {self.block_index(s.block) for s in new}
        kept = tuple(s for s in self.supports if self.block_index(s.block) not in replaced)
        assembly = replace(self, supports=kept + new)
        assembly.check_connected()
        return assembly

    def with_joints(
        self, joints: Joint | JointTable | Callable[[Joint], Joint], kinds: Iterable[str] | None = None
    ) -> "Assembly":
        """This assembly with other joint laws.

        Parameters
        ----------
        joints : one law, a function of the law a joint has that gives its new one, or a table by kind or by pair of
            block names; joints that share a law still share one after a function has changed it
        kinds : "bed", "head", "base": the joints that one law or a function is for; None is all

        Raises
        ------
        ValueError
            For kinds beside a table, which names its joints itself.
        """
        if isinstance(kinds, str):
            raise ValueError(f"kinds must be several names such as ('bed', 'base'), got the single word {kinds!r}")
        chosen = None if kinds is None else set(kinds)
        names = [b.name for b in self.blocks]
        if isinstance(joints, Joint) or callable(joints):
            new: dict[int, Joint] = {}
            laid = []
            for i in self.interfaces:
                if chosen is None or i.kind in chosen:
                    if id(i.joint) not in new:
                        new[id(i.joint)] = joints if isinstance(joints, Joint) else joints(i.joint)
                    i = replace(i, joint=new[id(i.joint)])
                laid.append(i)
            changed = tuple(laid)
        elif chosen is not None:
            raise ValueError("kinds goes with one law or a function; a table names its joints itself")
        else:
            choose = JointChoice(None, joints, names, required=False)
            changed = tuple(replace(i, joint=choose(i.block_a, i.block_b, i.kind) or i.joint) for i in self.interfaces)
            choose.check_all_used()
        return replace(self, interfaces=changed)

    def with_interfaces(self, interfaces: Iterable[Interface]) -> "Assembly":
        """This assembly with other interfaces, for example without some joints or with changed polygons."""
        return replace(self, interfaces=tuple(interfaces))

    def with_contact_ends_pulled_in(self, inset: float, *, direction: ArrayLike | None = None) -> "Assembly":
        """This assembly with every interface shortened at its ends, as by rounded block edges.

        Parameters
        ----------
        inset : distance each end is pulled in [m], >= 0
        direction : edges are pulled in only where they face this direction in the interface (for a wall in the x-z
            plane give the normal of the plane, (0, 1, 0), to keep the full thickness: edges that face it stay);
            None pulls in all edges

        Raises
        ------
        ValueError
            When an interface is not wider than twice the inset.
        """
        if not inset >= 0:
            raise ValueError(f"inset must be >= 0 m, got {inset!r}")
        keep = None if direction is None else np.asarray(direction, dtype=float) / np.linalg.norm(direction)
        changed = []
        for interface in self.interfaces:
            polygon = pulled_in(interface, inset, keep)
            if polygon is None:
                a, b = self.blocks[interface.block_a].name, self.blocks[interface.block_b].name
                raise ValueError(f"the interface between {a!r} and {b!r} is not wider than twice the inset {inset} m")
            changed.append(replace(interface, polygon=polygon))
        return replace(self, interfaces=tuple(changed))

    def transformed(self, matrix: ArrayLike, translation: ArrayLike = (0.0, 0.0, 0.0)) -> "Assembly":
        """This assembly rotated, mirrored or scaled by a matrix and moved; x -> M x + t, gravity stays along -z.

        Parameters
        ----------
        matrix : shape (3, 3), a multiple of an orthogonal matrix
        translation : [m], shape (3,)

        Notes
        -----
        The recipe is kept only under a pure translation: its directions and lengths would no longer be right.
        """
        m, t = np.asarray(matrix, dtype=float), np.asarray(translation, dtype=float)
        scale = abs(np.linalg.det(m)) ** (1.0 / 3.0)
        if m.shape != (3, 3) or scale == 0 or not np.allclose(m @ m.T, scale**2 * np.eye(3), atol=1e-9 * scale**2):
            raise ValueError(
                "matrix must be a multiple of an orthogonal 3 x 3 matrix (rotation, mirror, uniform scale)"
            )
        mirrored = np.linalg.det(m) < 0

        def moved(solid: Solid) -> Solid:
            faces = tuple(f[::-1] for f in solid.faces) if mirrored else solid.faces
            return Solid(solid.vertices @ m.T + t, faces)

        blocks = tuple(
            Block(b.name, tuple(moved(p) for p in b.parts), b.density, None if b.axis is None else m @ b.axis / scale)
            for b in self.blocks
        )
        interfaces = tuple(
            replace(
                i,
                polygon=(i.polygon[::-1] if mirrored else i.polygon) @ m.T + t,
                normal=m @ i.normal / scale,
            )
            for i in self.interfaces
        )
        recipe = self.recipe if np.allclose(m, np.eye(3)) else {}
        return replace(self, blocks=blocks, interfaces=interfaces, recipe=recipe, tolerance=self.tolerance * scale)

    def renumbered(self, order: Sequence[int]) -> "Assembly":
        """This assembly with its blocks in another order: new block k is old block ``order[k]``."""
        order = [int(k) for k in order]
        if sorted(order) != list(range(self.n_blocks)):
            raise ValueError("order must hold every block number once")
        new = np.empty(self.n_blocks, dtype=int)
        new[order] = np.arange(self.n_blocks)
        names = [b.name for b in self.blocks]
        supports = tuple(
            Support(names[self.block_index(s.block)], translations=s.translations, rotations=s.rotations, dofs=s.dofs)
            for s in self.supports
        )
        interfaces = tuple(
            replace(i, block_a=int(new[i.block_a]), block_b=int(new[i.block_b])) for i in self.interfaces
        )
        return replace(self, blocks=tuple(self.blocks[k] for k in order), interfaces=interfaces, supports=supports)

    # ---- looking things up --------------------------------------------------------------------------------------

    @property
    def n_blocks(self) -> int:
        """Number of blocks, held ones included."""
        return len(self.blocks)

    @cached_property
    def _numbers(self) -> dict[str, int]:
        return {b.name: i for i, b in enumerate(self.blocks)}

    def block_index(self, block: int | str) -> int:
        """Number of a block given by name or number; an unknown one is an error that lists near names."""
        if isinstance(block, str):
            if block not in self._numbers:
                near = sorted(self._numbers, key=lambda n: (n[:3] != block[:3], abs(len(n) - len(block))))[:5]
                raise ValueError(f"there is no block named {block!r}; names include {', '.join(near)}")
            return self._numbers[block]
        if not 0 <= int(block) < self.n_blocks:
            raise ValueError(f"block number {block} is outside 0 .. {self.n_blocks - 1}")
        return int(block)

    @cached_property
    def held(self) -> NDArray[np.bool_]:
        """Held degrees of freedom x, y, z, rx, ry, rz, shape (n_blocks, 6)."""
        flags = np.zeros((self.n_blocks, 6), dtype=bool)
        for support in self.supports:
            flags[self.block_index(support.block)] |= np.array(support.held)
        return flags

    @property
    def fixed(self) -> NDArray[np.bool_]:
        """Blocks held in all six degrees of freedom, shape (n_blocks,)."""
        return np.asarray(self.held.all(axis=1))

    @cached_property
    def _mass_properties(self) -> tuple[Array, Array, Array]:
        pieces = [part for block in self.blocks for part in block.parts]
        owner = np.repeat(np.arange(self.n_blocks), [len(b.parts) for b in self.blocks])
        part = mass_properties(pieces)
        volume = np.bincount(owner, part.volume, self.n_blocks).astype(float)
        centroid = np.stack(
            [np.bincount(owner, part.volume * part.centroid[:, k], self.n_blocks) / volume for k in range(3)], axis=1
        )
        arm = part.centroid - centroid[owner]
        steiner = (arm**2).sum(axis=1)[:, None, None] * np.eye(3) - arm[:, :, None] * arm[:, None, :]
        inertia = np.zeros((self.n_blocks, 3, 3))
        np.add.at(inertia, owner, part.inertia + part.volume[:, None, None] * steiner)
        return volume, centroid, inertia

    @property
    def centroids(self) -> Array:
        """Block centroids [m], shape (n_blocks, 3)."""
        return self._mass_properties[1]

    @property
    def volumes(self) -> Array:
        """Block volumes [m3], shape (n_blocks,)."""
        return self._mass_properties[0]

    @property
    def weights(self) -> Array:
        """Block weights, density times volume times g [N], shape (n_blocks,)."""
        return np.array([b.density for b in self.blocks]) * self.volumes * GRAVITY

    @cached_property
    def arrays(self) -> AssemblyArrays:
        """Everything as contiguous arrays, made once."""
        volume, centroid, inertia = self._mass_properties
        density = np.array([b.density for b in self.blocks])
        k = len(self.interfaces)
        normal = np.array([i.normal for i in self.interfaces]).reshape(k, 3)
        t1, t2, centre, area, corners, start = face_arrays([i.polygon for i in self.interfaces], normal)
        laws = {id(i.joint): i.joint for i in self.interfaces}
        table = {
            key: (
                j.tan_phi, j.tan_psi, j.cohesion, j.tensile_strength, j.compressive_strength,
                np.nan if j.normal_stiffness is None else j.normal_stiffness,
                np.nan if j.shear_stiffness is None else j.shear_stiffness,
            )
            for key, j in laws.items()
        }  # fmt: skip
        law = np.array([table[id(i.joint)] for i in self.interfaces], dtype=float).reshape(k, 7)
        return AssemblyArrays(
            centroid, volume, density * volume, density[:, None, None] * inertia, density * volume * GRAVITY, self.held,
            np.array([i.block_a for i in self.interfaces], dtype=np.intp),
            np.array([i.block_b for i in self.interfaces], dtype=np.intp),
            normal, t1, t2, centre, area, corners, start, *np.ascontiguousarray(law.T),
        )  # fmt: skip

    def check_connected(self) -> None:
        """Refuse an assembly in which nothing is held or a block has no path of contacts to a held one.

        Raises
        ------
        ValueError
            Naming the block that floats.
        """
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components

        n = self.n_blocks
        anchored = self.held.any(axis=1)
        if not anchored.any():
            raise ValueError("nothing is fixed: give fixed=[...] or with_supports([...]) for at least one block")
        a = np.array([i.block_a for i in self.interfaces], dtype=int)
        b = np.array([i.block_b for i in self.interfaces], dtype=int)
        _, label = connected_components(coo_matrix((np.ones(len(a)), (a, b)), shape=(n, n)), directed=False)
        loose = ~np.isin(label, label[anchored])
        if loose.any():
            first = self.blocks[int(np.flatnonzero(loose)[0])].name
            raise ValueError(
                f"block {first!r} floats: no chain of contacts joins it to a support ({int(loose.sum())} such blocks); "
                f"close the gap, or raise the tolerance above {self.tolerance:.3g} m if it should touch"
            )
