"""A push-over of a solid: load against control displacement, with stresses, cracks, residuals and energy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from limitmason.answers.curve import Curve, Energy, Event
from limitmason.arrays import Array
from limitmason.checks import instance
from limitmason.continuum.equilibrium import EquilibriumState, Solver
from limitmason.continuum.excess_crack_energy import OPEN, CrackEnergy, crack_energy
from limitmason.continuum.mesh import CORNERS
from limitmason.continuum.papers import PAPERS
from limitmason.continuum.rotating_crack import Memory, strain_tensor, virgin
from limitmason.continuum.solid import Continuum, vibrating
from limitmason.errors import InputError
from limitmason.storage.files import read_archive, write_archive
from limitmason.vibration.system import VibratingSystem

_NO_RESULTANT = 1e-9  # of the sum of all live forces: a resultant that small is rounding
_MISSED = 0.02  # error of the energy balance from which a curve warns, chosen
_FLAT = 1.8  # longest over shortest edge of a brick from which a warning names it

REACHED, STOPPED, INTERRUPTED = "reached", "stopped", "interrupted"
"""How a path ended, or that it goes on after a checkpoint."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SolidCurve(Curve):
    """Load [N] against control displacement from the state under dead load [m].

    Sample 0 is that state. Live loads without resultant, a couple, leave the multiplier [-] in place of the load.

    Parameters
    ----------
    nodes : states; memory, stress and cracks are kept where the load was largest and at the end
    model : what was pushed
    control : point [m] and direction whose displacement was prescribed, shape (3,) each
    tolerance : norm of the unbalanced nodal forces over that of the loads, at most [-]
    band : crack-band width over the cube root of a brick's volume [-]
    energy : balance; what a jump sets free, and a real wall would throw off as motion, is part of its error
    """

    nodes: tuple[EquilibriumState, ...]
    model: Continuum
    control: tuple[Array, Array]
    tolerance: float
    band: float
    energy: Energy

    @property
    def residual(self) -> Array:
        """Unbalanced nodal forces over the loads per sample [-], shape (n,).

        Both are measured by their norms.
        """
        return np.array([n.residual for n in self.nodes])

    @property
    def multiplier(self) -> Array:
        """Of the live loads [-], shape (n,)."""
        return np.array([n.multiplier for n in self.nodes])

    @property
    def kept(self) -> tuple[int, ...]:
        """Samples at which stress, cracks and strain can be asked for."""
        return tuple(i for i, n in enumerate(self.nodes) if n.stress is not None)

    def displacements(self, sample: int = -1) -> Array:
        """Displacements of the nodes [m], shape (n_nodes, 3)."""
        return self._node(sample).displacement.reshape(-1, 3)

    def stress(self, sample: int = -1) -> Array:
        """Stresses at the integration points, tension positive [Pa], shape (m, q, 6).

        Their order is xx, yy, zz, xy, yz, zx.
        """
        stress = self._full(sample).stress
        assert stress is not None
        return self._by_brick(stress)

    def crack_width(self, sample: int = -1) -> Array:
        """Width of the cracks at every integration point [m], shape (m, q).

        It is the largest crack strain of the point times the crack band of its brick.
        """
        crack = self._full(sample).crack
        assert crack is not None
        width = self.band * np.cbrt(self.model.discretisation.volume.sum(axis=1))
        return np.asarray(self._by_brick(crack) * width[:, None])

    def crack_energy(self, sample: int = -1) -> CrackEnergy:
        """Energy that cracks have taken beside that of single cracks of the same opening and area [J]."""
        node = self._full(sample)
        assert node.memory is not None
        solver = self._solver
        return crack_energy(solver, solver.curves, node.memory)

    def strain(self, sample: int = -1) -> Array:
        """Largest principal strain at the integration points [-], shape (m, q)."""
        strain = self.model.discretisation.strains(self._node(sample).displacement)
        return np.asarray(np.linalg.eigvalsh(strain_tensor(strain))[..., -1], dtype=np.float64)

    def vibration(self, *, sample: int = -1) -> VibratingSystem:
        """Secant stiffness that cracks have left at a sample, for :func:`limitmason.modes`.

        Small motions unload and reload.
        """
        node = self._full(sample)
        assert node.memory is not None
        now = self._solver.answer(node.displacement, node.memory, secant=True)
        d = self.model.discretisation
        stiffness = d.stiffness(now.tangent.reshape(len(self.model.mesh), -1, 6, 6))
        travel = node.control - self.nodes[0].control  # [m], whatever the unit of the curve
        label = f"solid of {len(self.model.mesh)} bricks, cracked, at {1e3 * travel:.3g} mm"
        return vibrating(self.model, d.factor(stiffness), label)

    @property
    def _solver(self) -> Solver:
        """Solver by the settings of the path."""
        return Solver(self.model, self.model.functional(*self.control), self.tolerance, self.band)

    def _node(self, sample: int) -> EquilibriumState:
        """The state of a sample, refused where the curve has none of that number."""
        if not isinstance(sample, int | np.integer) or not -len(self) <= sample < len(self):
            raise InputError(f"the curve has samples 0 to {len(self) - 1}, got {sample!r}")
        return self.nodes[sample]

    def _full(self, sample: int) -> EquilibriumState:
        """The state of a sample whose memory, stress and cracks were kept, refused otherwise."""
        node = self._node(sample)
        if node.stress is None:
            raise InputError(f"stresses of sample {sample} were not kept; those of {self.kept} were")
        return node

    def _by_brick(self, values: Array) -> Array:
        """Values of all points, shape (m q, ...), by bricks, shape (m, q, ...)."""
        return values.reshape(len(self.model.mesh), self.model.discretisation.per_brick, *values.shape[1:])

    def save(self, path: str | Path) -> None:
        """Write the states to a numpy archive at a path; :func:`load_curve` reads them for the same model."""
        arrays: dict[str, Array] = {
            "displacement": np.array([n.displacement for n in self.nodes]),
            "scalars": np.array([[getattr(n, k) for k in _SCALARS] for n in self.nodes]),
            "point": self.control[0], "direction": self.control[1],
            "tolerance": np.array(self.tolerance), "band": np.array(self.band), "status": np.array(self.status),
        }
        for i in self.kept:
            node = self.nodes[i]
            assert node.memory is not None
            kept = node.memory._asdict() | {"stress": node.stress, "crack": node.crack}
            arrays |= {f"{i}/{k}": np.asarray(v) for k, v in kept.items()}
        write_archive(path, arrays, compressed=True)


def load_curve(path: str | Path, model: Continuum) -> SolidCurve:
    """Curve of a model from :meth:`SolidCurve.save`, to look at or to go on from.

    Parameters
    ----------
    path : of the archive
    model : the same solid with the same loads, which the archive does not hold

    Raises
    ------
    InputError
        When the file is of a model with other nodes.
    """
    instance("model", model, Continuum)
    file = read_archive(path)
    u = file["displacement"]
    if u.shape[1] != 3 * len(model.mesh.nodes):
        raise InputError(f"{path} is of a model with {u.shape[1] // 3} nodes, this one has {len(model.mesh.nodes)}")
    nodes = []
    for i, (row, x) in enumerate(zip(file["scalars"], u, strict=True)):
        scalars: dict[str, Any] = dict(zip(_SCALARS, row.tolist(), strict=True))
        scalars |= {"iterations": int(scalars["iterations"]), "jump": bool(scalars["jump"])}
        kept = file.group(str(i), "/")
        memory = Memory(*(kept[k] for k in Memory._fields)) if kept else None
        nodes.append(EquilibriumState(x, memory=memory, stress=kept.get("stress"), crack=kept.get("crack"), **scalars))
    control = file["point"], file["direction"]
    return curve_of(model, nodes, control, float(file["tolerance"]), str(file["status"]), float(file["band"]))


_SCALARS = ("multiplier", "control", "residual", "iterations", "stored", "lost", "jump")
"""Fields of a state that an archive keeps as one row of numbers."""


def _first_crack(solver: Solver, nodes: list[EquilibriumState]) -> int | None:
    """Number of the first state with a crack, or None.

    Crushing loses energy too, and is no crack. The crack strain of a state that has not kept it is that of its
    displacement by itself, as before any crack.
    """
    c = solver.curves
    for i, n in enumerate(nodes):
        if n.lost > 0.0:
            crack = solver.answer(n.displacement, virgin(len(c.modulus))).crack if n.crack is None else n.crack
            if (crack > OPEN * c.tension / c.modulus).any():
                return i
    return None


def _energy_of_cracks(solver: Solver, last: EquilibriumState) -> tuple[str, ...]:
    """Warning where the cracks of the last state have not taken the energy of their area."""
    assert last.memory is not None
    return crack_energy(solver, solver.curves, last.memory).warnings()


def _flat_bricks(model: Continuum) -> tuple[str, ...]:
    """Warning where bricks of a model that cracks are far from cubes: their crack band is a cube's edge."""
    # mean of the four edges along each direction of a brick, up to one factor, however the brick is turned
    edges = np.linalg.norm(np.einsum("nk,mni->mki", CORNERS - 0.5, model.mesh.corners), axis=2)
    aspect = float((edges.max(axis=1) / edges.min(axis=1)).max())
    if aspect < _FLAT or not any(m.fractures for m in model.materials):
        return ()
    return (f"bricks are up to {aspect:.2g} times as long as wide: a crack's energy depends on how it crosses them",)


def curve_of(
    model: Continuum, nodes: list[EquilibriumState], control: tuple[ArrayLike, ArrayLike], tolerance: float,
    status: str, band: float = 1.0,
) -> SolidCurve:
    """Curve of states in equilibrium: control displacement, load, energies, jumps, the first crack and warnings.

    Parameters
    ----------
    model : the solid
    nodes : its states, the first under the dead load alone
    control : point [m] and direction whose displacement is that of the curve, shape (3,) each
    tolerance, band : settings of the path, which the curve keeps
    status : how the path ended
    """
    live, dead = model.live.ravel(), model.all_dead
    point, direction = (np.asarray(v, dtype=float) for v in control)
    # 0 for a couple, up to rounding: the curve then holds multipliers, not forces
    size = float(np.linalg.norm(model.live.sum(axis=0)))
    size = size if size > _NO_RESULTANT * float(np.abs(model.live).sum()) else 0.0
    u, factor = np.array([n.displacement for n in nodes]), np.array([n.multiplier for n in nodes])
    travel = np.diff(u, axis=0)
    # work of the live load by the trapezoidal rule, as its multiplier changes within a step; the dead load is constant
    by_live = 0.5 * (factor[1:] + factor[:-1]) * (travel @ live)
    by_dead = travel @ dead
    work = [np.concatenate([[0.0], np.cumsum(w)]) for w in (by_live, by_dead)]
    stored, lost = (np.array([getattr(n, k) - getattr(nodes[0], k) for n in nodes]) for k in ("stored", "lost"))
    gross = np.concatenate([[0.0], np.cumsum(np.abs(by_live) + np.abs(by_dead))])
    # over all work done, whatever its sign: of a path that goes back and forth the net work may be nothing
    work_of_live, work_of_dead = work
    error = (work_of_live + work_of_dead - stored - lost) / np.maximum(gross, 1e-300)
    error[0] = 0.0
    energy = Energy(work_of_live, work_of_dead, stored, lost, error)
    events = [Event("jump", i) for i, n in enumerate(nodes) if n.jump]
    solver = Solver(model, model.functional(point, direction), tolerance, band)
    first = _first_crack(solver, nodes)
    if first is not None:
        events.append(Event("first crack", first))
    # all of these follow from the states, so that a curve that is read back from a file says what it said
    warnings = (*_flat_bricks(model), *_energy_of_cracks(solver, nodes[-1]))
    if status == STOPPED:
        end = 1e3 * (nodes[-1].control - nodes[0].control)
        warnings = (*warnings, f"the path stops at {end:.4g} mm: no state beyond was found")
    missed = float(np.abs(error).max())
    if missed > _MISSED:
        warnings = (*warnings, f"the energy balance is off by up to {missed:.1%} of the work: jumps, or steps too long")
    steps = tuple(i for i, n in enumerate(nodes) if n.jump)
    if steps:
        ran = f"{len(steps)} of {len(nodes) - 1} steps are jumps: no Newton iteration ended them"
        warnings = (*warnings, ran)
    return SolidCurve(
        displacement=np.array([n.control - nodes[0].control for n in nodes]), load=factor * (size or 1.0),
        load_unit="N" if size else "-", label="continuum", events=tuple(events),
        errors={"energy": error, "residual": np.array([n.residual for n in nodes])}, status=status, warnings=warnings,
        source="limitmason", references=PAPERS, nodes=tuple(nodes), model=model, control=(point, direction),
        tolerance=tolerance, band=band, energy=energy,
    )
