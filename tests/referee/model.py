"""A structure as plain numbers, the frames in which it may be written down, and what an answer becomes in each.

Nothing of ``limitmason`` is needed but in :meth:`Model.build`. A :class:`Frame` turns, mirrors and renumbers a model,
changes its units, and multiplies its live load or its stiffness; :meth:`Frame.back` undoes that to an answer.
"""

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from .assemblies import Case, Law
from .space import wrenches

Array = np.ndarray


class Quantity(NamedTuple):
    """A value with its powers of length, mass, time, live load and stiffness, and how its rows transform.

    ``kind`` is "number", "ends" (of a range, which a reversed load exchanges) or "vectors" (a row for each block);
    ``size`` is what an error is measured by, the largest value where None. ``slack`` is its tolerance over the law's.
    """

    value: Array | float
    length: float = 0
    mass: float = 0
    time: float = 0
    live: float = 0
    stiff: float = 0
    kind: str = "number"
    size: float | None = None
    slack: float = 1.0


class Pull(NamedTuple):
    """A tie: block and point at both ends (block -1 is the ground), strength [N] and axial stiffness [N/m]."""

    a: int
    at: Array
    b: int
    to: Array
    strength: float
    stiffness: float

    @property
    def way(self) -> Array:
        """Unit vector from the first end to the second."""
        return (self.to - self.at) / np.linalg.norm(self.to - self.at)


@dataclass(frozen=True)
class Frame:
    """Axes, numbers and units in which a model is written, and factors of its live load and of its stiffness."""

    matrix: Array = field(default_factory=lambda: np.eye(3))
    shift: Array = field(default_factory=lambda: np.zeros(3))
    order: Array | None = None
    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0
    live: float = 1.0
    stiff: float = 1.0

    def unit(self, length: float = 0, mass: float = 0, time: float = 0, live: float = 0, stiff: float = 0) -> float:
        """Factor of a quantity with these powers."""
        out = self.length**length * self.mass**mass * self.time**time * self.stiff**stiff
        return out * (np.sign(self.live) ** (live % 2) * abs(self.live) ** live if live else 1.0)

    def back(self, q: Quantity) -> Array:
        """The value in the frame of the model itself."""
        value = np.asarray(q.value, dtype=float) / self.unit(*q[1:6])
        if q.kind == "ends":
            return value[::-1] if self.live < 0 else value
        if q.kind == "vectors":
            return (value if self.order is None else value[np.argsort(self.order)]) @ self.matrix
        return value


@dataclass(frozen=True, eq=False)
class Model:
    """Blocks, laws, stiffness, ties and loads; ``laws`` names the joints of a pair that differ from ``law``.

    ``dead`` and ``live`` are wrenches about the centroids [N, N m], ``groups`` blocks that settle together, ``down``
    the direction in which they do; ``driven`` is a block that is pushed ``along``.
    """

    solids: list
    density: Array
    fixed: frozenset[int]
    law: Law
    laws: dict[tuple[int, int], Law]
    stiffness: tuple[float, float]
    young: float
    poisson: float
    ties: tuple[Pull, ...]
    dead: Array
    live: Array
    plane: bool
    group: tuple[int, ...] = ()
    down: Array = field(default_factory=lambda: np.array([0.0, 0.0, -1.0]))
    along: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))
    driven: int = -1
    tags: dict = field(default_factory=dict)

    @classmethod
    def of(cls, case: Case, **options) -> "Model":
        """The model of a case."""
        solids = case.solids()
        _, _, dead, live = wrenches(case, solids)
        return cls(
            solids, np.array(case.density), case.fixed, case.law, options.pop("laws", {}), options.pop("stiffness"),
            options.pop("young", 0.0), options.pop("poisson", 0.0), options.pop("ties", ()), dead, live, case.plane,
            tags=case.tags, **options,
        )

    @property
    def free(self) -> list[int]:
        """Numbers of the blocks that are not held."""
        return [i for i in range(len(self.solids)) if i not in self.fixed]

    @property
    def length(self) -> float:
        """Largest extent [m]."""
        return float(np.ptp(np.vstack([v for v, _ in self.solids]), axis=0).max())

    @property
    def weight(self) -> float:
        """Sum of the dead forces of the free blocks [N]."""
        return float(np.linalg.norm(self.dead[self.free, :3], axis=1).sum())

    def law_of(self, a: int, b: int) -> Law:
        """The law of the joints between two blocks."""
        return self.laws.get((a, b), self.laws.get((b, a), self.law))

    def seen(self, f: Frame) -> "Model":
        """The same structure written down in another frame."""
        order = np.arange(len(self.solids)) if f.order is None else f.order
        new = {int(old): k for k, old in enumerate(order)} | {-1: -1}
        hand = np.linalg.det(f.matrix)
        force, stress = f.unit(1, 1, -2), f.unit(-1, 1, -2)

        def place(p: Array) -> Array:
            return f.length * (p @ f.matrix.T + f.shift)

        def turned(w: Array) -> Array:
            return force * np.hstack([w[order, :3] @ f.matrix.T, hand * f.length * w[order, 3:] @ f.matrix.T])

        def scaled(w: Law) -> Law:
            return Law(w.mu, stress * w.cohesion, stress * w.tension, stress * w.crushing, w.lost)

        faces = (lambda fs: [tuple(reversed(x)) for x in fs]) if hand < 0 else (lambda fs: fs)
        return replace(
            self, solids=[(place(self.solids[i][0]), faces(self.solids[i][1])) for i in order],
            density=self.density[order] * f.unit(-3, 1), fixed=frozenset(new[i] for i in self.fixed),
            law=scaled(self.law), laws={(new[a], new[b]): scaled(w) for (a, b), w in self.laws.items()},
            stiffness=tuple(k * f.unit(-2, 1, -2, 0, 1) for k in self.stiffness), young=self.young * stress * f.stiff,
            ties=tuple(Pull(new[t.a], place(t.at), new[t.b], place(t.to), t.strength * force,
                            t.stiffness * f.unit(0, 1, -2, 0, 1)) for t in self.ties),
            dead=turned(self.dead), live=turned(self.live) * f.live, group=tuple(new[i] for i in self.group),
            down=f.matrix @ self.down, along=f.matrix @ self.along, driven=new[self.driven],
        )

    def build(self):
        """Assembly and loads through the functions that a user calls."""
        import limitmason as lm

        kn, ks = self.stiffness

        def joint(w: Law):
            residual = {} if np.isinf(w.lost) else {"residual_cohesion": 0.0, "residual_tensile_strength": 0.0}
            for name, strength, k in (("shear", w.cohesion, ks), ("tension", w.tension, kn)):
                if strength and 0.0 < w.lost < np.inf:
                    residual[f"fracture_energy_{name}"] = w.lost * strength**2 / (2.0 * k)
            return lm.Joint.from_friction_coefficient(
                w.mu, cohesion=w.cohesion, tensile_strength=w.tension, compressive_strength=w.crushing,
                normal_stiffness=kn, shear_stiffness=ks, **residual,
            )

        names = [f"b{i}" for i in range(len(self.solids))]
        assembly = lm.Assembly.from_polyhedra(
            self.solids, joint=joint(self.law), density=list(self.density), fixed=sorted(self.fixed), names=names,
            joints={(names[a], names[b]): joint(w) for (a, b), w in self.laws.items()},
        )
        if self.young:
            free = [names[i] for i in self.free]
            assembly = assembly.with_material(
                lm.Material(young_modulus=self.young, poisson_ratio=self.poisson), blocks=free
            )
        if self.ties:
            assembly = assembly.with_ties([
                lm.Tie(t.a, t.at, None if t.b < 0 else t.b, t.to, yield_force=t.strength, stiffness=t.stiffness)
                for t in self.ties
            ])
        return assembly, lm.Loads(self.dead, self.live)
