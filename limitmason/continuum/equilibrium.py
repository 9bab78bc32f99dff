"""Equilibrium of a cracking solid at a control displacement: Newton with line search, then secants."""

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.continuum.factor import Factor, SingularStiffness
from limitmason.continuum.rotating_crack import Memory, PointResponse, respond, virgin
from limitmason.continuum.solid import Continuum
from limitmason.continuum.uniaxial_curves import Curves, curves_of

NEWTON = 14
"""Most Newton iterations of an ordinary step, before it is cut."""

_NEAR = 5e-3  # unbalanced force over the loads below which Newton may finish what secants began
_FINISH = 12  # secant iterations after which it is tried, and tried again
_LAST = 5  # most Newton iterations of such a try
_SHARES = (1.0, 0.5, 0.25, 0.1)  # of a step that the line search tries
_SPENT = 0.01  # of the largest load: what softening leaves below it is balanced to the same force
_UNLOADED = 1e-3  # of the live load: the least force that a residual is over, before a load is known
_LEAST = 0.05  # of the dead load: smallest part that Newton is tried with
_DEAD_BREAK = 200  # most secant iterations of a jump under the dead load
_HELD = 1e-6  # of the control displacement: how exactly it is met
_MICRO = 1e-12  # [m]: least displacement that this is a part of
_SAID = 20  # secant iterations from one line of progress to the next
_NO_SLOPE = 1e-9  # of the largest displacement by the live loads: those that move the control point by less, by
# rounding, do not drive it
_DIVERGED = 1e4  # residual from which an iteration is given up
_CHUNK = 20000  # points whose law is worked out at once: bounds the memory


class EquilibriumState(NamedTuple):
    """A state in equilibrium and how it was found.

    Memory, stress and crack strain are None where they were not kept.

    Parameters
    ----------
    displacement : of the nodes [m], shape (3 n,)
    multiplier : of the live loads [-]
    control : control displacement [m]
    residual : norm of the unbalanced nodal forces over that of the loads [-]
    iterations : that it took
    memory : of the points
    stress : of the points, tension positive [Pa], shape (m q, 6)
    crack : crack strain of the points [-], shape (m q,)
    stored, lost : elastic energy, and what cracking and crushing took [J]
    jump : whether Newton's method ended at no state, and secants broke on to this one
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

    Attributes
    ----------
    d : discretisation of the model
    curves : stress-strain curves of all integration points
    dead, live : nodal forces [N], shape (3 n,)
    factorisations : made so far
    largest : largest size of the multiplier on the path so far [-], set by the caller
    """

    def __init__(self, model: Continuum, control: Array, tolerance: float, band: float = 1.0) -> None:
        """Find the stress-strain curves of all integration points by the size of their bricks.

        Parameters
        ----------
        model, control, tolerance, band : see the class
        """
        self.model, self.control, self.tolerance, self.band = model, control, tolerance, band
        d = self.d = model.discretisation
        width = band * np.cbrt(d.volume.sum(axis=1))
        material = np.repeat(model.mesh.material, d.per_brick)
        self.curves: Curves = curves_of(model.materials, material, np.repeat(width, d.per_brick))
        self.dead, self.live = model.all_dead, model.live.ravel()
        self.factorisations = 0
        self.largest = 0.0

    @cached_property
    def row(self) -> Array:
        """Weights of the control displacement in the order of elimination, shape (r,).

        As the live loads in that order they are made when they are first asked for: the order takes long to find.
        """
        return self.control[self.d.order]

    @cached_property
    def live_row(self) -> Array:
        """Live nodal forces in the order of elimination [N], shape (r,)."""
        return self.live[self.d.order]

    def answer(self, displacement: Array, memory: Memory, *, secant: bool = False) -> PointResponse:
        """Stresses, tangents and new memory of all integration points at a displacement.

        Parameters
        ----------
        displacement : of the nodes [m], shape (3 n,)
        memory : of the last accepted state
        secant : give secants in place of tangents
        """
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
        """Norm of the loads on the free unknowns [N], with at least a hundredth of the largest live load on the path.

        Residuals are measured by it. At a multiplier of zero there is nothing else where no dead load acts.
        """
        dead, live = (float(np.linalg.norm(f[self.d.order])) for f in (self.dead, self.live))
        least = _SPENT * self.largest if self.largest > 0.0 else _UNLOADED
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

    def drives(self, last: EquilibriumState) -> bool:
        """Whether the live loads move the control point along its direction, as the solid is after a state."""
        assert last.memory is not None
        now = self.answer(last.displacement, last.memory)
        both = self._linear(now, self.unbalanced(now, last.multiplier))
        if both is None:
            return False
        return bool(abs(float(self.row @ both[:, 1])) > _NO_SLOPE * float(np.abs(both[:, 1]).max()))

    def dead_load(self, say: Callable[[str], None] = lambda _: None) -> EquilibriumState | None:
        """State under the dead load alone, put on in parts where it cracks or crushes, or None where none is found.

        Parameters
        ----------
        say : called with a line per part
        """
        n = len(self.curves.modulus)
        node = EquilibriumState(
            displacement=np.zeros(len(self.dead)), multiplier=0.0, control=0.0, residual=1.0, iterations=0,
            memory=virgin(n), stress=None, crack=None, stored=0.0, lost=0.0,
        )
        put_on, part = 0.0, 1.0  # shares of the dead load: carried so far, and added next
        whole = self.dead
        try:
            while put_on < 1.0:
                self.dead = min(put_on + part, 1.0) * whole
                new = self.solve(node, node.displacement, multiplier=0.0, target=None, most=NEWTON)
                # no smaller part helps: what breaks under this one breaks on, as under a load that stays
                if new is None and part <= _LEAST:
                    new = self.past_instability(node, target=None, most=_DEAD_BREAK, say=say)
                if new is None:
                    if part <= _LEAST:
                        return None
                    part *= 0.5
                    continue
                # what breaks under the dead load is no jump of the curve, which begins after it
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
        guess : displacements to start from [m], shape (3 n,)
        multiplier : to start from [-]
        target : control displacement [m], None to keep the multiplier instead
        most : largest number of iterations
        secant : iterate with secant stiffness

        Returns
        -------
        The state, or None where ``most`` iterations do not reach the tolerance
        """
        assert last.memory is not None
        u, factor = guess.copy(), multiplier  # displacements and multiplier of the iterate
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
                if not abs(slope) > _NO_SLOPE * float(np.abs(both[:, 1]).max()):
                    return None
                # change of the multiplier that brings the control displacement to its target
                more = (short - float(self.row @ both[:, 0])) / slope
                step = both[:, 0] + more * both[:, 1]
            if not np.isfinite(step).all():
                return None
            u, factor, now, r = self._line_search(u, factor, step, more, r, last.memory, secant)
            off = float(np.linalg.norm(r)) / self.size(factor)
            held = target is None or abs(target - float(self.control @ u)) <= _HELD * max(abs(target), _MICRO)
            if off <= self.tolerance and held:
                return self._node(u, factor, off, k, now)
            if not np.isfinite(off) or off > _DIVERGED:
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

        Parameters
        ----------
        last : accepted state before
        target : control displacement [m], or None
        most : largest number of iterations
        say : called with a line every twenty iterations
        """
        assert last.memory is not None
        # displacements, in the order of elimination, multiplier and memory of the iterate
        u, factor, memory = last.displacement[self.d.order], last.multiplier, last.memory
        patience = _FINISH  # iterations until Newton's method is tried
        for k in range(1, most + 1):
            full = self.d.spread(u)
            now = self.answer(full, memory, secant=True)
            memory = now.memory
            # column 0: step that removes the unbalanced force; column 1: step per unit of the multiplier
            both = self._linear(now, self.unbalanced(now, factor))
            if both is None:
                return None
            more = 0.0
            if target is not None:
                slope = float(self.row @ both[:, 1])
                if not abs(slope) > _NO_SLOPE * float(np.abs(both[:, 1]).max()):
                    return None
                # change of the multiplier that brings the control displacement to its target
                more = (target - float(self.row @ (u + both[:, 0]))) / slope
            factor += more
            off = float(np.linalg.norm(self.unbalanced(now, factor))) / self.size(factor)
            if not np.isfinite(off):
                return None
            arrived = target is None or abs(target - float(self.row @ u)) <= _HELD * max(abs(target), _MICRO)
            if off <= self.tolerance and arrived:
                return self._node(full, factor, off, k, now)._replace(jump=True)
            u = u + both[:, 0] + more * both[:, 1]
            patience -= 1
            if k % _SAID == 0:
                say(f"  breaking on: iteration {k}, load {factor:.4g}, unbalanced {off:.1e}")
            if off < _NEAR and patience <= 0:
                found = self.solve(last._replace(memory=memory), self.d.spread(u), factor, target, _LAST)
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
        step : change of the displacements in a whole step, in the order of elimination [m], shape (r,)
        more : change of the multiplier in a whole step [-]
        r : unbalanced force at ``u``, in that order [N], shape (r,)
        memory : of the last accepted state
        secant : secant stiffness: its step is taken whole, whatever it leaves

        Returns
        -------
        displacement, multiplier, response, unbalanced : behind the step, as ``u``, ``factor``, of the points, and ``r``
        """
        spread = self.d.spread(step)
        before = float(np.linalg.norm(r))
        best = None
        for share in _SHARES:
            v, f = u + share * spread, factor + share * more
            now = self.answer(v, memory, secant=secant)
            left = self.unbalanced(now, f)
            off = float(np.linalg.norm(left))
            if best is None or off < best[0]:
                best = (off, v, f, now, left)
            if off <= before or before == 0.0 or secant:
                break
        assert best is not None
        _, v, f, now, left = best
        return v, f, now, left

    def _node(self, u: Array, factor: float, off: float, iterations: int, now: PointResponse) -> EquilibriumState:
        """An accepted state, with the energy stored and lost [J].

        Parameters
        ----------
        u : displacements [m], shape (3 n,)
        factor : multiplier [-]
        off : residual [-]
        iterations : that it took
        now : answer of the points
        """
        volume = self.d.volume.ravel()
        strain = self.d.strains(u).reshape(-1, 6)
        stored = 0.5 * float(((now.stress * strain).sum(axis=1) * volume).sum())
        lost = float(now.memory.lost @ volume)
        control = float(self.control @ u)
        return EquilibriumState(
            displacement=u, multiplier=factor, control=control, residual=off, iterations=iterations, memory=now.memory,
            stress=now.stress, crack=now.crack, stored=stored, lost=lost,
        )
