"""Blocks in contact as laid, and what is read off them: numbers, supports, masses, arrays."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.constants import GRAVITY
from limitmason.errors import InputError
from limitmason.geometry.contact import ContactRules, DoubtfulContact
from limitmason.geometry.polyhedron import mass_properties, steiner
from limitmason.model.arrays import AssemblyArrays, face_arrays, with_ties
from limitmason.model.block import Block
from limitmason.model.fingerprint import Fingerprint
from limitmason.model.interface import Interface
from limitmason.model.support import Support
from limitmason.model.tie import Tie
from limitmason.storage.frozen import ReadOnly, frozen


@dataclass(frozen=True, eq=False)
class Blockwork(ReadOnly):
    """What an :class:`~limitmason.Assembly` holds.

    Its fields are explained there. How it is built and changed is not here.

    The parts that an assembly is made with (detection of contacts, moved copies, the contact report) read this.
    """

    blocks: tuple[Block, ...]
    interfaces: tuple[Interface, ...]
    supports: tuple[Support, ...] = ()
    recipe: Mapping[str, Any] = field(default_factory=dict)
    tolerance: float = 0.0
    contact_rules: ContactRules = field(default_factory=ContactRules)
    doubts: tuple[DoubtfulContact, ...] = ()
    ties: tuple[Tie, ...] = ()

    @property
    def n_blocks(self) -> int:
        """Number of blocks, held ones included."""
        return len(self.blocks)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the two blocks of every interface: "base|unit 1"."""
        return tuple(f"{self.blocks[i.block_a].name}|{self.blocks[i.block_b].name}" for i in self.interfaces)

    def joint_text(self, block_a: int, block_b: int) -> str:
        """The joint of two blocks, given by number, in a message by their names."""
        return f"the joint between {self.blocks[block_a].name!r} and {self.blocks[block_b].name!r}"

    @cached_property
    def _numbers(self) -> dict[str, int]:
        """Number of every block by its name."""
        return {b.name: i for i, b in enumerate(self.blocks)}

    def block_index(self, block: int | str) -> int:
        """Number of a block given by name or number.

        An unknown one is an error that lists near names.
        """
        if isinstance(block, str):
            if block not in self._numbers:
                # names that begin alike go first, then those about as long
                near = sorted(self._numbers, key=lambda n: (n[:3] != block[:3], abs(len(n) - len(block))))[:5]
                raise InputError(f"there is no block named {block!r}; names include {', '.join(near)}")
            return self._numbers[block]
        if not isinstance(block, int | np.integer) or isinstance(block, bool):
            raise InputError(f"one block is needed, by its name or number; got {block!r}")
        if not 0 <= int(block) < self.n_blocks:
            raise InputError(f"block number {block} is outside 0 .. {self.n_blocks - 1}")
        return int(block)

    def __repr__(self) -> str:
        size = " x ".join(f"{v:.4g}" for v in np.ptp(self.vertices[0], axis=0)) if self.n_blocks else "0"
        return (
            f"<{type(self).__name__} of {self.n_blocks} blocks ({int(self.fixed.sum())} fixed) and "
            f"{len(self.interfaces)} joints: {size} m; the others weigh {self.weights[~self.fixed].sum() / 1e3:.4g} kN>"
        )

    @cached_property
    def vertices(self) -> tuple[Array, Index]:
        """Vertices of all blocks in a row [m], shape (m, 3).

        And where those of each begin, shape (n_blocks + 1,).
        """
        own = [b.vertices for b in self.blocks]
        start = np.concatenate([[0], np.cumsum([len(v) for v in own], dtype=np.intp)]).astype(np.intp)
        return frozen((np.concatenate(own) if own else np.zeros((0, 3)), start))

    @cached_property
    def held(self) -> Flags:
        """Held degrees of freedom x, y, z, rx, ry, rz, shape (n_blocks, 6)."""
        flags = np.zeros((self.n_blocks, 6), dtype=bool)
        for support in self.supports:
            flags[self.block_index(support.block)] |= np.array(support.held)
        return frozen(flags)

    @cached_property
    def fixed(self) -> Flags:
        """Blocks held in all six degrees of freedom, shape (n_blocks,)."""
        return frozen(np.asarray(self.held.all(axis=1)))

    @cached_property
    def _mass_properties(self) -> tuple[Array, Array, Array]:
        """Volume, centroid and inertia per density of every block.

        They are summed over its convex parts.

        Returns
        -------
        volume : [m3], shape (n,)
        centroid : [m], shape (n, 3)
        inertia : about the centroid [m5], shape (n, 3, 3)
        """
        pieces = [part for block in self.blocks for part in block.parts]
        owner = np.repeat(np.arange(self.n_blocks), [len(b.parts) for b in self.blocks])
        part = mass_properties(pieces)
        volume = np.bincount(owner, part.volume, self.n_blocks).astype(float)
        centroid = np.stack(
            [np.bincount(owner, part.volume * part.centroid[:, k], self.n_blocks) / volume for k in range(3)], axis=1
        )
        arm = part.centroid - centroid[owner]  # by which the parallel axes theorem moves the inertia of each part
        inertia = np.zeros((self.n_blocks, 3, 3))
        np.add.at(inertia, owner, part.inertia + part.volume[:, None, None] * steiner(arm))
        return frozen((volume, centroid, inertia))

    @property
    def centroids(self) -> Array:
        """Block centroids [m], shape (n_blocks, 3)."""
        return self._mass_properties[1]

    @property
    def volumes(self) -> Array:
        """Block volumes [m3], shape (n_blocks,)."""
        return self._mass_properties[0]

    @cached_property
    def weights(self) -> Array:
        """Block weights, density times volume times g [N], shape (n_blocks,)."""
        return frozen(np.array([b.density for b in self.blocks]) * self.volumes * GRAVITY)

    @cached_property
    def arrays(self) -> AssemblyArrays:
        """Everything as contiguous arrays, made once."""
        volume, centroid, inertia = self._mass_properties
        density = np.array([b.density for b in self.blocks])
        k = len(self.interfaces)
        normal = np.array([i.normal for i in self.interfaces]).reshape(k, 3)
        t1, t2, centre, area, corners, start = face_arrays([i.polygon for i in self.interfaces], normal)
        # laws are few and interfaces many: each law is read once
        laws = {id(i.joint): i.joint for i in self.interfaces}
        table = {
            key: (
                j.tan_phi, j.tan_psi, j.cohesion, j.tensile_strength, j.compressive_strength,
                np.nan if j.normal_stiffness is None else j.normal_stiffness,
                np.nan if j.shear_stiffness is None else j.shear_stiffness,
            )
            for key, j in laws.items()
        }
        law = np.array([table[id(i.joint)] for i in self.interfaces], dtype=float).reshape(k, 7)
        return frozen(AssemblyArrays(
            centroid, volume, density * volume, density[:, None, None] * inertia, density * volume * GRAVITY, self.held,
            np.array([i.block_a for i in self.interfaces], dtype=np.intp),
            np.array([i.block_b for i in self.interfaces], dtype=np.intp),
            normal, t1, t2, centre, area, corners, start, *np.ascontiguousarray(law.T),
        ))

    @cached_property
    def fingerprint(self) -> Fingerprint:
        """What tells this model from another: blocks, joints, supports, ties, materials."""
        ends = [
            (self.block_index(t.block_a), -1 if t.block_b is None else self.block_index(t.block_b)) for t in self.ties
        ]
        return Fingerprint.of(self.blocks, self.held, self.interfaces, self.ties, np.array(ends), self.tolerance)

    def ground_for(self, what: str) -> int:
        """Number of the block that stands for the ground, the first wholly held one.

        ``what`` names in the error what asks for it.
        """
        held = np.flatnonzero(self.fixed)
        if not len(held):
            raise InputError(f"{what}: no block is wholly held, so there is no ground to tie to; name a block")
        return int(held[0])

    @cached_property
    def links(self) -> AssemblyArrays:
        """All that passes force between blocks.

        It is :attr:`arrays` with a row per tie after those of the interfaces.

        A tie reads as a point without friction that is pressed by T: its ``normal`` runs from end b to end a, its area
        is 1 m2 and its compressive strength the tie's in N. Without ties it is :attr:`arrays` itself.
        """
        if not self.ties:
            return self.arrays
        a = np.array([self.block_index(t.block_a) for t in self.ties], dtype=np.intp)
        b = [self.ground_for(str(t)) if t.block_b is None else self.block_index(t.block_b) for t in self.ties]
        return frozen(with_ties(
            self.arrays, a, np.array(b, dtype=np.intp), np.array([t.ends for t in self.ties]),
            np.array([t.strength for t in self.ties]), np.array([t.axial_stiffness for t in self.ties]),
        ))
