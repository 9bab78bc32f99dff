"""This package's own solver of the static theorem, what it covers, and its kernels: made for thousands of blocks."""
