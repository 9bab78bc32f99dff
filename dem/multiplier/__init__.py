"""Collapse multipliers: loads held, ramps, tilting tables."""
