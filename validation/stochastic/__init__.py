"""Random brick panels beside the paper: ``python -m validation.stochastic``."""
