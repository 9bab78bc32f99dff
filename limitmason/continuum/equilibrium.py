"""Equilibrium of a cracking solid at a control displacement: Newton with line search, then secants."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.continuum.factor import Factor, SingularStiffness
from limitmason.continuum.rotating_crack import Curves, Memory, PointResponse, curves_of, respond, virgin
from limitmason.continuum.solid import Continuum

_NEAR, _FINISH = 5e-3, 12  # unbalance below which Newton may finish, and after how many secant iterations it is tried
_SPENT = 0.01  # of the largest load: what softening leaves below it is balanced to the same force
_LEAST = 0.05  # of the dead load: smallest part that Newton is tried with
_CHUNK = 20000  # points whose law is worked out at once: bounds the memory


class EquilibriumState(NamedTuple):
    """A state in equilibrium: displacements [m], (3 n,), multiplier, memory, and how it was found.

    ``residual`` is the norm of the unbalanced nodal forces over that of the loads. ``stress`` [Pa] and ``crack`` (crack
    strain [-]) are those of the points, shapes (m q, 6) and (m q,); they and the memory are None where not kept.
    """

    displacement: Array
    multiplier: float
    control: float
    residual: float
    iterations: int
    memory: Memory | None
    stress: Array | None
    crack: Array | None
    stored: float
    lost: float
    jump: bool = False


class Solver:
    """One model under a control displacement.

    Parameters
    ----------
    model : the solid
    control : weights of the unknowns in the control displacement, shape (3 n,)
    tolerance : residual at which a state is accepted, over the norm of the loads [-]
    band : crack-band width over the cube root of a brick's volume [-]
    """

    def __init__(self, model: Continuum, control: Array, tolerance: float, band: float = 1.0) -> None:
        """Find the stress-strain curves of all integration points by the size of their bricks.

        ``control`` is the row of the control displacement over all unknowns, ``band`` the width of a crack band over
        the cube root of a brick's volume, ``tolerance`` the unbalanced force over the load [-].
        """
        self.model, self.control, self.tolerance, self.band = model, control, tolerance, band
        d = self.d = model.discretisation
        width = band * np.cbrt(d.volume.sum(axis=1))
        material = np.repeat(model.mesh.material, d.per_brick)
        self.curves: Curves = curves_of(model.materials, material, np.repeat(width, d.per_brick))
        self.dead, self.live = model.all_dead, model.live.ravel()
        self.row = control[d.order]
        self.live_row = self.live[d.order]
        self.factorisations = 0
        self.largest = 0.0  # multiplier on the path so far

    def answer(self, displacement: Array, memory: Memory, *, secant: bool = False) -> PointResponse:
        """Stresses, tangents and new memory of all integration points at a displacement."""
        strain = self.d.strains(displacement).reshape(-1, 6)
        parts = []
        for first in range(0, len(strain), _CHUNK):
            rows = np.arange(first, min(first + _CHUNK, len(strain)))
            parts.append(respond(self.curves.rows(rows), strain[rows], memory.rows(rows), secant=secant))
        if len(parts) == 1:
            return parts[0]
        joined = Memory(*(np.concatenate([p.memory[k] for p in parts]) for k in range(3)))
        names = ("stress", "tangent", "crack")
        stress, tangent, crack = (np.concatenate([getattr(p, name) for p in parts]) for name in names)
        return PointResponse(stress, joined, tangent, crack)

    def unbalanced(self, answer: PointResponse, multiplier: float) -> Array:
        """Loads less internal forces on the free unknowns, in the order of elimination [N]."""
        inner = self.d.forces(answer.stress.reshape(len(self.model.mesh), -1, 6))
        return np.asarray((self.dead + multiplier * self.live - inner)[self.d.order])

    def size(self, multiplier: float) -> float:
        """Norm of the loads on the free unknowns [N], at least a hundredth of the largest on the path."""
        dead, live = (float(np.linalg.norm(f[self.d.order])) for f in (self.dead, self.live))
        least = _SPENT * self.largest if self.largest > 0.0 else 1e-3
        return max(dead + abs(multiplier) * live, least * live, 1e-300)

    def factor(self, answer: PointResponse) -> Factor:
        """Factor of the stiffness from the tangents of an answer."""
        self.factorisations += 1
        return self.d.factor(self.d.stiffness(answer.tangent.reshape(len(self.model.mesh), -1, 6, 6)))

    def _linear(self, answer: PointResponse, unbalanced: Array) -> Array | None:
        """Displacements by the unbalanced forces and by the live loads, shape (r, 2), or None where nothing resists."""
        try:
            return self.factor(answer).solve(np.column_stack([unbalanced, self.live_row]))
        except SingularStiffness:
            return None

    def dead_load(self, say: Callable[[str], None] = lambda _: None) -> EquilibriumState | None:
        """State under the dead load alone, put on in parts where it cracks or crushes, or None where none is found."""
        n = len(self.curves.modulus)
        node = EquilibriumState(
            displacement=np.zeros(len(self.dead)), multiplier=0.0, control=0.0, residual=1.0, iterations=0,
            memory=virgin(n), stress=None, crack=None, stored=0.0, lost=0.0,
        )
        put_on, part = 0.0, 1.0
        whole = self.dead
        try:
            while put_on < 1.0:
                self.dead = min(put_on + part, 1.0) * whole
                new = self.solve(node, node.displacement, 0.0, None, 14)
                if new is None and part <= _LEAST:
                    new = self.past_instability(node, None, 200, say)
                if new is None:
                    if part <= _LEAST:
                        return None
                    part *= 0.5
                    continue
                node, put_on = new._replace(jump=False), min(put_on + part, 1.0)
                if part < 1.0:
                    say(f"dead load {put_on:.0%}, {new.iterations} iterations")
        finally:
            self.dead = whole
        return node

    def solve(
        self, last: EquilibriumState, guess: Array, multiplier: float, target: float | None, most: int, *,
        secant: bool = False,
    ) -> EquilibriumState | None:
        """Equilibrium at a control displacement, or at a fixed multiplier where ``target`` is None.

        Parameters
        ----------
        last : accepted state before, whose memory counts
        guess, multiplier : where to start
        target : control displacement [m]
        most : iterations
        secant : iterate with secant stiffness

        Returns
        -------
        Node, or None where ``most`` iterations do not reach the tolerance
        """
        assert last.memory is not None
        u, factor = guess.copy(), multiplier
        now = self.answer(u, last.memory, secant=secant)
        r = self.unbalanced(now, factor)
        for k in range(1, most + 1):
            # column 0: step that removes the unbalanced force; column 1: step per unit of the multiplier
            both = self._linear(now, r)
            if both is None:
                return None
            if target is None:
                step, more = both[:, 0], 0.0
            else:
                short = target - float(self.control @ u)
                slope = float(self.row @ both[:, 1])
                if not abs(slope) > 1e-30:
                    return None
                # change of the multiplier that brings the control displacement to its target
                more = (short - float(self.row @ both[:, 0])) / slope
                step = both[:, 0] + more * both[:, 1]
            if not np.isfinite(step).all():
                return None
            u, factor, now, r = self._line_search(u, factor, step, more, r, last.memory, secant)
            off = float(np.linalg.norm(r)) / self.size(factor)
            held = target is None or abs(target - float(self.control @ u)) <= 1e-6 * max(abs(target), 1e-12)
            if off <= self.tolerance and held:
                return self._node(u, factor, off, k, now)
            if not np.isfinite(off) or off > 1e4:
                return None
        return None

    def past_instability(
        self, last: EquilibriumState, target: float | None, most: int, say: Callable[[str], None] = lambda _: None
    ) -> EquilibriumState | None:
        """Equilibrium past an instability, by secant iterations whose damage stays.

        The control displacement is fixed. Without a ``target`` the loads are fixed instead.

        Every iteration is linear with the stiffness that cracks have left, and what it cracks more stays cracked: the
        load falls as it does while a crack runs through. That ends, since damage only grows, and where it ends is a
        state in equilibrium; what runs too far on the way is energy that the balance shows as lost.
        """
        assert last.memory is not None
        u, factor, memory = last.displacement[self.d.order], last.multiplier, last.memory
        patience = _FINISH
        for k in range(1, most + 1):
            full = self.d.spread(u)
            now = self.answer(full, memory, secant=True)
            memory = now.memory
            both = self._linear(now, self.unbalanced(now, factor))
            if both is None:
                return None
            slope = float(self.row @ both[:, 1])
            if not abs(slope) > 1e-30:
                return None
            more = 0.0 if target is None else (target - float(self.row @ (u + both[:, 0]))) / slope
            factor += more
            off = float(np.linalg.norm(self.unbalanced(now, factor))) / self.size(factor)
            if not np.isfinite(off):
                return None
            arrived = target is None or abs(target - float(self.row @ u)) <= 1e-6 * max(abs(target), 1e-12)
            if off <= self.tolerance and arrived:
                return self._node(full, factor, off, k, now)._replace(jump=True)
            u = u + both[:, 0] + more * both[:, 1]
            patience -= 1
            if k % 20 == 0:
                say(f"  breaking on: iteration {k}, load {factor:.4g}, unbalanced {off:.1e}")
            if off < _NEAR and patience <= 0:
                found = self.solve(last._replace(memory=memory), self.d.spread(u), factor, target, 5)
                if found is not None:
                    return found._replace(iterations=k + found.iterations, jump=True)
                patience = _FINISH
        return None

    def _line_search(
        self, u: Array, factor: float, step: Array, more: float, r: Array, memory: Memory, secant: bool
    ) -> tuple[Array, float, PointResponse, Array]:
        """Largest share of the step that leaves less unbalanced than before, else the best of four.

        Parameters
        ----------
        u : displacements before the step [m], shape (3 n,)
        factor : multiplier [-] before the step
        step, more : their changes in a whole step, displacements in the order of elimination [m], shape (r,)
        r : unbalanced force at ``u`` [N], shape (r,)

        Returns
        -------
        displacement, multiplier, response, unbalanced : behind the step, as ``u``, ``factor``, of the points, and ``r``
        """
        spread = self.d.spread(step)
        before = float(np.linalg.norm(r))
        best = None
        for share in (1.0, 0.5, 0.25, 0.1):
            v, f = u + share * spread, factor + share * more
            now = self.answer(v, memory, secant=secant)
            left = self.unbalanced(now, f)
            off = float(np.linalg.norm(left))
            if best is None or off < best[0]:
                best = (off, v, f, now, left)
            if off <= before or before == 0.0 or secant:
                break
        assert best is not None
        return best[1], best[2], best[3], best[4]

    def _node(self, u: Array, factor: float, off: float, iterations: int, now: PointResponse) -> EquilibriumState:
        """State of displacements u [m] and load ``factor``, with the energy stored and lost [J]."""
        volume = self.d.volume.ravel()
        strain = self.d.strains(u).reshape(-1, 6)
        stored = 0.5 * float(((now.stress * strain).sum(axis=1) * volume).sum())
        lost = float(now.memory.lost @ volume)
        control = float(self.control @ u)
        return EquilibriumState(
            displacement=u, multiplier=factor, control=control, residual=off, iterations=iterations, memory=now.memory,
            stress=now.stress, crack=now.crack, stored=stored, lost=lost,
        )
