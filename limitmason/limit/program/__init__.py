"""The static theorem as a cone program: unknowns, scaling and cones, solved by Clarabel or written out in cvxpy."""
