"""Lowest eigenvalues of K u = x M u by block Krylov spaces, and the count which proves that none is left out."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import splu

from limitmason.arrays import Array
from limitmason.errors import NotApplicable, NotConverged
from limitmason.vibration.system import VibratingSystem

# these bounds are chosen, not derived: where pivots can be counted they prove the answer, whatever these are
_GUARD = 4  # vectors beside those wanted: the wanted ones converge by their distance to the first beyond the block
_DEPTH = 4  # times a block: vectors of the space between two restarts
_EXACT = 1e-11  # residual of an eigenvector under the inverse [-]; the error of its eigenvalue goes with its square
_GOOD = 1e-4  # the same, enough where rounding does not let it come nearer: eigenvalues are then right to about 1e-8
_RESTARTS = 60  # most restarts of a space
_IDLE = 4  # restarts without a residual half as large: rounding
_ROUNDS = 5  # how often a block grows by what was missed
_EQUAL = 1e-6  # of an eigenvalue: eigenvalues this near are equal
REST = 1e-14  # of the largest eigenvalue: below it nothing holds a motion, or rounding hides what does
_BALANCED = 1e-13  # of a solution times the largest entry: what a factor of symmetric pivots may leave
_DEPENDS = 1e-12  # of the largest: squared length below which what is left of a vector is rounding
_BELOW = 1e-6  # of a mean eigenvalue: how far below zero a system is shifted that nothing holds
_ITERATIONS = 3  # inverse iterations by which the lowest eigenvalue is told from zero
_NONE = 1e-300  # length or eigenvalue that a part is of, instead of 0


class Lowest(NamedTuple):
    """Lowest eigenvalues, and how many lie below a value just above the last of them.

    Parameters
    ----------
    value : eigenvalues x = (2 pi f)^2 [1/s2], ascending, shape (k,)
    vector : eigenvectors as columns, of unit modal mass, shape (n, k)
    below : eigenvalues below ``shift``; k, or more where the last is one of several equal ones; None where no count
        proves that none is missing
    shift : (2 pi f)^2 at which they were counted [1/s2]
    """

    value: Array
    vector: Array
    below: int | None
    shift: float


def lowest(system: VibratingSystem, count: int) -> Lowest:
    """Lowest eigenvalues with all their repetitions.

    The Krylov space of a block of at least ``count`` vectors holds repeated eigenvalues, that of one vector one copy
    of each. By Sylvester's law the negative pivots of K - x M are as many as eigenvalues lie below x. Where they are
    more than were found the block grows by the rest.

    Parameters
    ----------
    system : stiffness K and mass M of the free unknowns
    count : eigenvalues that are wanted

    Raises
    ------
    NotConverged
        When the iteration does not converge, or eigenvalues below the last one are counted that it does not find.

    References
    ----------
    Grimes, Lewis and Simon (1994), A shifted block Lanczos algorithm for sparse symmetric generalized eigenproblems.
    """
    n, largest = system.stiffness.shape[0], largest_of(system)
    if n <= 2 * (count + _GUARD):  # a block would be most of the space: dense matrices give all of it
        value, vector = eigh(system.stiffness.toarray(), system.mass.toarray())
        above = value[count - 1] + max(_EQUAL * abs(value[count - 1]), REST * largest)
        return Lowest(value[:count], vector[:, :count], int((value < above).sum()), float(above))
    solve, shift = _inverse(system, largest)
    block = np.random.default_rng(0).standard_normal((n, count + _GUARD))  # the same from run to run
    for _ in range(_ROUNDS):
        value, vector = _found(solve, shift, system, block, count)
        last = float(value[count - 1])
        margin = max(_EQUAL * abs(last), REST * largest)
        above = _eigenvalues_below(system, last + margin)
        if above == count:
            return Lowest(value[:count], vector[:, :count], above, last + margin)
        # more than asked for may be copies of the last: missed are only those that lie below it and its equals
        under = None if above is None or above < count else _eigenvalues_below(system, last - margin)
        if under is None:  # not counted, or fewer than have converged, which no right count gives
            return Lowest(value[:count], vector[:, :count], None, last + margin)
        missed = under - int((value < last - margin).sum())
        if missed <= 0:
            return Lowest(value[:count], vector[:, :count], above, last + margin)
        # random vectors have a part of every motion, those that were missed too
        more = np.random.default_rng(1).standard_normal((n, min(missed, n - vector.shape[1])))
        block = np.column_stack([vector, more])
    raise NotConverged(f"modes of {system.label}: {missed} eigenvalues below the last one found were not found")


def largest_of(system: VibratingSystem) -> float:
    """Estimate of the largest eigenvalue, max K_ii / M_ii [1/s2].

    It measures what rounding may leave of an eigenvalue; the largest itself may be some times higher.
    """
    k, m = system.stiffness.diagonal(), system.mass.diagonal()
    massive = m > 0.0  # a layer may have none
    return float((k[massive] / m[massive]).max())


def _inverse(system: VibratingSystem, largest: float) -> tuple[Callable[[Array], Array], float]:
    """Product with (K - shift M)^-1, and the shift [1/s2].

    It is 0, or below where nothing holds a motion.

    Parameters
    ----------
    system : stiffness K and mass M of the free unknowns
    largest : estimate of the largest eigenvalue [1/s2]

    Raises
    ------
    NotApplicable
        Without any stiffness.
    """
    k, m = system.stiffness, system.mass
    try:
        solve = _corrected(k) if system.solve is None else system.solve
        # inverse iterations: the growth tends to one over the lowest eigenvalue [s2]
        u, growth = np.random.default_rng(3).standard_normal(k.shape[0]), np.inf
        for _ in range(_ITERATIONS):
            u = u / np.sqrt(u @ (m @ u))
            u = solve(m @ u)
            growth = np.sqrt(u @ (m @ u))
        if growth * REST * largest < 1.0:  # the lowest eigenvalue is above REST times the largest
            return solve, 0.0
    except (RuntimeError, NotApplicable):  # singular
        pass
    # below zero K - shift M is positive definite
    shift = -_BELOW * float(k.diagonal().sum() / m.diagonal().sum())
    if not shift < 0.0:
        raise NotApplicable(f"{system.label} have no modes: no closed joint holds any of them, and nothing vibrates")
    return _corrected((k - shift * m).tocsc()), shift


def _corrected(matrix: sparse.csc_array) -> Callable[[Array], Array]:
    """Solver of a matrix by its factors with one step of iterative refinement.

    Between stiff joints and soft blocks rounding leaves few digits without it.
    """
    solve = splu(matrix).solve

    def corrected(right: Array) -> Array:
        """Solution of one or several right-hand sides, and of what it leaves of them."""
        x = solve(right)
        return np.asarray(x + solve(right - matrix @ x))

    return corrected


def _found(
    solve: Callable[[Array], Array], shift: float, system: VibratingSystem, block: Array, count: int
) -> tuple[Array, Array]:
    """As many eigenvalues as the block has, of which ``count`` have converged.

    Parameters
    ----------
    solve : product with (K - shift M)^-1
    shift : that shift [1/s2]
    system : stiffness K and mass M of the free unknowns
    block : vectors to begin with, shape (n, b)
    count : eigenvalues that must converge

    Returns
    -------
    tuple
        Eigenvalues [1/s2], nearest to the shift first, shape (k,), and their vectors as columns, shape (n, k).
    """
    m = system.mass
    x, best, idle = block, np.inf, 0  # vectors to restart from, least residual so far, restarts without a better one
    most = min(_DEPTH * block.shape[1], len(block))
    for _ in range(_RESTARTS):
        space = new = _orthonormal(x, m)
        image = solve(m @ new)  # the inverse times every vector of the space
        # after a restart a product brings few new vectors: counted by depth the space would shrink
        while space.shape[1] < most:
            new = image[:, -new.shape[1] :]
            for _ in range(2):  # Gram and Schmidt twice: once leaves what rounding cancelled
                new = new - space @ (space.T @ (m @ new))
            new = _orthonormal(new, m)[:, : most - space.shape[1]]
            if not new.shape[1]:
                break
            space, image = np.hstack([space, new]), np.hstack([image, solve(m @ new)])
        reduced = space.T @ (m @ image)
        # Rayleigh and Ritz: the largest eigenvalues of the inverse within the space
        inverse, mix = eigh(0.5 * (reduced + reduced.T))
        order = np.argsort(-inverse)[: max(block.shape[1], count)]
        x, inverse = space @ mix[:, order], inverse[order]
        # residual of every vector that is wanted, over the eigenvalue of the inverse, in lengths by mass
        off = image @ mix[:, order[:count]] - x[:, :count] * inverse[:count]
        size = np.sqrt(np.einsum("ik,ik->k", off, m @ off)) / np.abs(inverse[:count])
        worst = float(size.max())
        best, idle = (worst, 0) if worst < 0.5 * best else (best, idle + 1)
        if worst < _EXACT or (idle >= _IDLE and worst < _GOOD):
            # vectors multiplied once more by the inverse have less rounding than those of the space
            return shift + 1.0 / inverse, image @ mix[:, order] / inverse
    raise NotConverged(f"modes of {system.label}: not found to {_GOOD:g}, only to {worst:.1g}")


def _orthonormal(x: Array, mass: sparse.csc_array) -> Array:
    """Columns of unit mass, orthogonal by mass, that span those of x, (n, b).

    There are fewer where these depend on each other.

    Twice, as rounding of nearly dependent columns leaves the first answer not quite orthogonal.
    """
    x = x / np.maximum(np.sqrt(np.einsum("ik,ik->k", x, mass @ x)), _NONE)
    for _ in range(2):
        value, axes = eigh(x.T @ (mass @ x))
        kept = value > _DEPENDS * value.max(initial=_NONE)
        x = x @ (axes[:, kept] / np.sqrt(value[kept]))
    return x


def _eigenvalues_below(system: VibratingSystem, shift: float) -> int | None:
    """How many eigenvalues lie below a shift, or None where the factor is no proof.

    By Sylvester's law of inertia they are as many as the negative pivots of L D L^T = K - shift M. The factor is no
    proof where rows were exchanged without their columns, or where it does not solve an equation of its own.

    Parameters
    ----------
    system : stiffness K and mass M of the free unknowns
    shift : the value [1/s2]
    """
    if system.below is not None:
        return system.below(shift)
    matrix = (system.stiffness - shift * system.mass).tocsc()
    try:  # no exchanges of rows but with their columns: then L D L', whose D is U's diagonal
        factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:
        return None
    if (factor.perm_r != factor.perm_c).any():
        return None
    # an equation with any right-hand side: pivots that were not exchanged may have let rounding grow
    right = np.random.default_rng(2).standard_normal(len(factor.perm_r))
    x = factor.solve(right)
    size = float(abs(matrix).max()) * np.linalg.norm(x) + np.linalg.norm(right)
    if not np.linalg.norm(matrix @ x - right) <= _BALANCED * size:
        return None
    return int((factor.U.diagonal() < 0.0).sum())
