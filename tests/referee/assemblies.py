"""Random assemblies as plain numbers: outlines, depths, densities, one law for all joints, and loads.

Nothing here is solved and nothing of ``limitmason`` is needed to make a case; only :meth:`Case.build` and
:meth:`Case.rebuilt` hand it to the package under test.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial.transform import Rotation

Array = np.ndarray
GRAVITY = 9.81


@dataclass(frozen=True)
class Law:
    """|T| <= c A + mu N, -ft A <= N <= fc A, pointwise [-], [Pa].

    ``lost`` is what breaking c and ft takes over the energy stored at them [-]: 0 for at once, infinite for never.
    """

    mu: float
    cohesion: float = 0.0
    tension: float = 0.0
    crushing: float = np.inf
    lost: float = np.inf

    @property
    def cut_off(self) -> float:
        """Tensile strength [Pa]; where ft > c / mu the apex of the Coulomb cone governs."""
        return self.tension if self.mu == 0 else min(self.tension, self.cohesion / self.mu)


@dataclass(frozen=True)
class Load:
    """One load. ``kind`` "body": weight of all free blocks along ``vector``; "point": force ``vector`` [N] at ``at``
    [m] on ``block``; "pressure": ``size`` [Pa] into all faces of ``block`` within 10 degrees of ``vector``."""

    kind: str
    vector: tuple[float, float, float]
    case: str = "live"
    block: int = -1
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    size: float = 0.0


@dataclass(frozen=True)
class Case:
    """Prisms over outlines in x-z between y0 and y1; counter-clockwise seen from -y, that is in (x, z) axes.

    Parameters
    ----------
    outlines : [m], shape (n, 2) each
    depth : (y0, y1) of every block [m]
    density : of every block [kg/m3]
    fixed : numbers of the held blocks
    tags : what kind of case it is: geometry, law, loads
    """

    seed: tuple[int, int]
    outlines: tuple[Array, ...]
    depth: tuple[tuple[float, float], ...]
    density: tuple[float, ...]
    fixed: frozenset[int]
    law: Law
    loads: tuple[Load, ...]
    plane: bool
    tags: dict[str, str] = field(default_factory=dict)

    @property
    def free(self) -> list[int]:
        """Numbers of the blocks that are not held."""
        return [i for i in range(len(self.outlines)) if i not in self.fixed]

    def solids(self) -> list[tuple[Array, list[tuple[int, ...]]]]:
        """Vertices [m] and faces, counter-clockwise from outside."""
        out = []
        for outline, (y0, y1) in zip(self.outlines, self.depth, strict=True):
            n = len(outline)
            front = np.column_stack([outline[:, 0], np.full(n, y0), outline[:, 1]])
            back = np.column_stack([outline[:, 0], np.full(n, y1), outline[:, 1]])
            sides = [(k, k + n, (k + 1) % n + n, (k + 1) % n) for k in range(n)]
            out.append((np.vstack([front, back]), [tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1)), *sides]))
        return out

    def without(self, block: int) -> "Case":
        """This case without one block and the loads on it."""
        keep = [i for i in range(len(self.outlines)) if i != block]
        new = {old: k for k, old in enumerate(keep)}
        return replace(
            self,
            outlines=tuple(self.outlines[i] for i in keep),
            depth=tuple(self.depth[i] for i in keep),
            density=tuple(self.density[i] for i in keep),
            fixed=frozenset(new[i] for i in self.fixed if i != block),
            loads=tuple(
                replace(f, block=new.get(f.block, -1)) for f in self.loads if f.kind == "body" or f.block != block
            ),
        )

    def build(self):
        """Assembly and loads of ``limitmason`` through the functions that a user calls."""
        import limitmason as lm

        joint = self._joint(lm)
        options = {"joint": joint, "density": list(self.density), "fixed": sorted(self.fixed)}
        if self.plane:
            assembly = lm.Assembly.from_polygons(self.outlines, thickness=self.depth[0][1], **options)
        else:
            assembly = lm.Assembly.from_polyhedra(self.solids(), **options)
        loads = lm.Loads.weight(assembly)
        for f in self.loads:
            if f.kind == "body":
                loads = loads.with_body_force(assembly, f.vector, blocks=self.free, case=f.case)
            elif f.kind == "point":
                loads = loads.with_point_load(assembly, f.block, f.vector, at=f.at, case=f.case)
            else:
                loads = loads.with_pressure(assembly, f.block, pressure=f.size, face=f.vector, case=f.case)
        return assembly, loads

    def rebuilt(self, turn: int, loads=None):
        """The same case turned in space, blocks renumbered, contacts found anew; ``loads``: of what it built."""
        import limitmason as lm

        random = np.random.default_rng([*self.seed, 77, turn])
        loads = self.build()[1] if loads is None else loads
        matrix = Rotation.from_quat(random.normal(size=4)).as_matrix()
        shift = random.normal(size=3) * np.ptp(np.vstack(self.outlines))
        order = random.permutation(len(self.outlines))
        solids = self.solids()
        moved = [(solids[i][0] @ matrix.T + shift, solids[i][1]) for i in order]
        fixed = [k for k, i in enumerate(order) if i in self.fixed]
        assembly = lm.Assembly.from_polyhedra(
            moved, joint=self._joint(lm), density=[self.density[i] for i in order], fixed=fixed
        )

        def turned(wrench: Array) -> Array:
            return np.hstack([wrench[order, :3] @ matrix.T, wrench[order, 3:] @ matrix.T])

        return assembly, lm.Loads(turned(loads.dead), turned(loads.live))

    def _joint(self, lm):
        law = self.law
        return lm.Joint.from_friction_coefficient(
            law.mu, cohesion=law.cohesion, tensile_strength=law.tension, compressive_strength=law.crushing
        )
