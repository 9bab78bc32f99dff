"""The static theorem as a cone program: unknowns, scaling and cones."""
