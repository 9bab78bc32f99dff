"""Equally strong bricks in a row under equal stress: which one cracks, where a step would crack them together."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.continuum.equilibrium import EquilibriumState, Solver
from limitmason.continuum.excess_crack_energy import ALONG, across_cracks
from limitmason.continuum.rotating_crack import tensor

_EQUAL = 2e-4  # of the strength: bricks this near to each other are equally near to it
_STRONGER = 1.05  # times the strength of the bricks that stay whole, until the crack beside them has softened
_SOFTENED = 0.9  # of its strength: below it a crack no longer lets equal bricks crack
_ACROSS = 1e-3  # cosine below which a direction counts as across a row: it then says nothing of front and back
_SAME_PLACE = 1e-6  # of the length of the solid along the row: bricks as near to its middle are equally near


class EqualBricks:
    """Rows of bricks that one step would crack together, and the one of each row that cracks.

    A row of equal bricks under equal stress has many states of equilibrium: any number of its bricks may crack. With
    one crack it takes the least energy, the fracture energy of its section. The brick that was nearest to its
    strength before cracks. Of equal ones it is that nearest to the middle of all that are tied, and of two of these
    the one behind as the control point moves. The others count 5 % stronger until it has softened by a tenth. A state
    found in this way counts where it is in equilibrium without that.

    Parameters
    ----------
    solver : of the path, whose curves it changes for steps that are tied

    Attributes
    ----------
    true : curves with the strengths as they are
    centre : middles of the bricks [m], shape (m, 3)
    towards, place : unit direction of the control displacement, and its point [m], shape (3,) each
    chosen : number of the brick that cracks in place of each brick, -1 for none, shape (m,)
    seen : bricks that crack together whatever is chosen, shape (m,)
    """

    def __init__(self, solver: Solver) -> None:
        """Take the middles of the bricks, and place and direction of the control displacement, from the solver."""
        mesh = solver.model.mesh
        self.solver, self.true = solver, solver.curves
        self.centre = mesh.corners.mean(axis=1)
        control = solver.control.reshape(-1, 3)
        self.towards = control.sum(axis=0)  # its shape functions add up to one: the unit direction of the control
        self.place = np.abs(control).sum(axis=1) @ mesh.nodes / np.abs(control).sum()
        self.chosen = np.full(len(mesh), -1)
        self.seen: Flags = np.zeros(len(mesh), dtype=np.bool_)

    def stepped(
        self, step: Callable[[], EquilibriumState | None], last: EquilibriumState
    ) -> EquilibriumState | None:
        """The next state by ``step``, with one crack in each row of equal bricks.

        Parameters
        ----------
        step : finds the next state with the strengths that the solver now has, None where there is none
        last : accepted state before
        """
        self._release(last)
        new = step()
        # a state found with some bricks made stronger counts only if it balances with their true strength
        if new is not None and (self.chosen >= 0).any():
            new = self._checked(new) or self._without_choice(step)
        if new is None or not (rows := self._rows(last, new)):
            return new
        # these bricks would crack together: all but one of each row are made stronger, and the step is done again
        before = self.chosen.copy()
        for row, winner in rows:
            self.chosen[row[row != winner]] = winner
        self._strengthen()
        other = step()
        other = None if other is None else self._checked(other)
        if other is not None and not self._rows(last, other):
            return other
        # no state with one crack is in equilibrium: these bricks crack together, and are not asked again
        for row, _ in rows:
            self.seen[row] = True
        self.chosen = before
        self._strengthen()
        return new

    def _without_choice(self, step: Callable[[], EquilibriumState | None]) -> EquilibriumState | None:
        """The state by a step where what was chosen before does not hold: those bricks are no longer asked."""
        self.seen |= self.chosen >= 0
        self.chosen[:] = -1
        self._strengthen()
        return step()

    def _strengthen(self) -> None:
        """Let the bricks that are to stay whole be stronger, the others as they are."""
        stronger = np.repeat(self.chosen >= 0, self.solver.d.per_brick)
        self.solver.curves = self.true._replace(tension=np.where(stronger, _STRONGER, 1.0) * self.true.tension)

    def _release(self, last: EquilibriumState) -> None:
        """Let bricks be as they are again where the crack in their stead has softened, in the state ``last``."""
        tied = self.chosen >= 0
        if not tied.any():
            return
        assert last.memory is not None
        strain = self._per_brick(np.asarray(np.linalg.eigvalsh(last.memory.tension)[:, -1])).max(axis=1)
        first = self._per_brick(self.true.tension / self.true.modulus)[:, 0]
        # bricks past the strain at which the exponential branch has fallen to that share of the strength
        soft = strain > first + np.log(1.0 / _SOFTENED) * self._per_brick(self.true.softening)[:, 0]
        self.chosen[tied & soft[self.chosen]] = -1
        self._strengthen()

    def _checked(self, new: EquilibriumState) -> EquilibriumState | None:
        """The state ``new`` where it is in equilibrium with the strengths as they are, else None."""
        assert new.memory is not None
        with_choice, self.solver.curves = self.solver.curves, self.true
        now = self.solver.answer(new.displacement, new.memory)
        off = float(np.linalg.norm(self.solver.unbalanced(now, new.multiplier))) / self.solver.size(new.multiplier)
        self.solver.curves = with_choice
        return new if off <= self.solver.tolerance else None

    def _rows(self, last: EquilibriumState, new: EquilibriumState) -> list[tuple[Index, int]]:
        """Bricks that begin to crack in one step as their neighbours across the crack do, and the one to crack.

        There is one entry per row. Bricks that a choice was made for, or that crack together whatever is chosen, are
        left out.

        Parameters
        ----------
        last, new : states before and after the step
        """
        assert last.memory is not None
        assert new.memory is not None
        assert new.crack is not None
        fresh = np.asarray((self._per_brick(last.memory.lost) <= 0.0).all(axis=1), dtype=np.bool_)
        begins = fresh & (self._per_brick(new.crack) > 0.0).any(axis=1) & ~self.seen & (self.chosen < 0)
        if not begins.any():
            return []
        # a brick cracks across the direction that its points, on the mean, have strained most in
        normal = np.linalg.eigh(new.memory.tension.reshape(len(self.chosen), -1, 3, 3).mean(axis=1))[1][:, :, -1]
        tied, label = across_cracks(self.solver.model.mesh.solid.f2t, self.centre, normal, begins)
        bricks = np.unique(tied)
        rows = [bricks[label[bricks] == k] for k in np.unique(label[bricks])]
        return [(row, self._first(row, bricks, normal, last)) for row in rows]

    def _first(self, row: Index, bricks: Index, normal: Array, last: EquilibriumState) -> int:
        """The brick of a row that cracks: of those nearest to their strength that in the middle of all tied bricks.

        Parameters
        ----------
        row : bricks of the row
        bricks : those of all rows that the step ties
        normal : unit normals of the cracks of all bricks, shape (m, 3)
        last : state before the step
        """
        assert last.stress is not None
        # the mean normal of the row, whatever the signs of each: the direction that holds most of them
        along = np.linalg.svd(normal[row])[2][0]
        # it points as the control point moves, or towards that point where it moves across the row
        for way in (self.towards, self.place - self.centre.mean(axis=0)):
            if abs(along @ way) > _ACROSS * np.linalg.norm(way):
                along = along * np.sign(along @ way)
                break
        strength = self._per_brick(self.true.tension)[row, 0]
        # normal stress across the crack, summed over the points of a brick: it only compares bricks
        stress = np.einsum("bcij,i,j->b", tensor(last.stress.reshape(len(self.chosen), -1, 6)[row]), along, along)
        for reached in (np.maximum(stress, 0.0) / strength, 1.0 / strength):  # the second where nothing was loaded yet
            most = row[reached >= (1.0 - _EQUAL) * reached.max()]
            if reached.max() > 0.0:
                break
        # the middle of all tied bricks that crack across the same direction; of equally near ones the furthest behind
        x, all_along = self.centre @ along, np.abs(normal[bricks] @ along) > ALONG
        off = np.abs(x[most] - x[bricks[all_along]].mean())
        near = most[off <= off.min() + _SAME_PLACE * max(float(np.ptp(x)), 1e-300)]
        return int(near[np.argmin(x[near])])

    def _per_brick(self, values: Array) -> Array:
        """Values of all points, shape (m q,), as rows of bricks, shape (m, q)."""
        return values.reshape(len(self.chosen), -1)
