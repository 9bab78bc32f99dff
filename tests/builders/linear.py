"""Linear statics: the solution of an assembled stiffness."""

from scipy import sparse
from scipy.sparse.linalg import splu


def solution(stiffness, right):
    """Displacements of a symmetric stiffness that holds, by pivots on its diagonal in the order that fills least."""
    matrix = sparse.csc_array(stiffness)
    solve = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}).solve
    u = solve(right)
    return u + solve(right - matrix @ u)
