"""Factors of a bordered tangent: front by front where it is large, with rows exchanged wherever that is called for."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import SuperLU

from limitmason.arrays import Array, Index
from limitmason.multifrontal.unsymmetric import UnsymmetricFronts

_LEFT = 1e-9
"""Part of a right side that a solution may leave over [-]: chosen, as Newton's method corrects what is left."""

ROUNDED = 1e-4
"""The same where corrections come no nearer [-]: chosen."""

_CORRECTIONS = 4
"""Solutions by fronts at most: chosen."""


class FrontFactors(NamedTuple):
    """Factors of a large matrix, front by front.

    What they do not solve is left to factors with all exchanges of rows.

    Parameters
    ----------
    value : entries of the bordered tangent in the order of its pattern, shape (nnz,)
    fronts : order and fronts of its pattern
    store, exchanged : its factors and exchanges of rows, of :meth:`UnsymmetricFronts.factors`
    pivoted : from entries to factors with any exchange of rows, which raise RuntimeError where it is singular
    """

    value: Array
    fronts: UnsymmetricFronts
    store: Array
    exchanged: Index
    pivoted: Callable[[Array], SuperLU]

    def solve(self, right: Array) -> Array:
        """The solution for a right side, shape (n,), nan where the matrix is singular."""
        found, left = self.corrected(right)
        if left <= ROUNDED * float(np.abs(right).max(initial=0.0)):
            return found
        try:
            return np.asarray(self.pivoted(self.value).solve(right))
        except RuntimeError:
            return np.full_like(right, np.nan)

    def corrected(self, right: Array) -> tuple[Array, float]:
        """The solution by fronts with iterative refinement, (n,), and the largest entry of b - A x that it leaves over.

        Parameters
        ----------
        right : right side b, shape (n,)
        """
        most, found, off, left = float(np.abs(right).max(initial=0.0)), np.zeros_like(right), right, np.inf
        for _ in range(_CORRECTIONS):
            found = found + self.fronts.solve(self.store, self.exchanged, off)
            off = right - self.fronts.product(self.value, found)
            before, left = left, float(np.abs(off).max(initial=0.0))
            # near enough, or no longer half of what it was
            if left <= _LEFT * most or left > 0.5 * before:
                break
        return found, left


def determinant_sign(factors: SuperLU) -> int:
    """Sign of the determinant of a factored matrix: that of U's diagonal, turned by every odd permutation."""
    signs = np.sign(factors.U.diagonal()).prod()
    return int(signs * _parity(factors.perm_r) * _parity(factors.perm_c))


def _parity(permutation: Index) -> int:
    """1 for an even permutation, -1 for an odd one: one of n numbers in k cycles takes n - k exchanges."""
    n = len(permutation)
    arrows = sparse.coo_array((np.ones(n), (np.arange(n), permutation)), shape=(n, n))
    cycles = connected_components(arrows, directed=False, return_labels=False)
    return 1 if (n - cycles) % 2 == 0 else -1
