"""Explicit discrete element method on the same assemblies; not in this release (see the README's table of methods)."""
