"""This package's own solver of the static theorem, for thousands of blocks."""
