"""Limit analysis of rigid-block assemblies as cone programs: associative, non-associative, and what bounds what."""

from limitmason.limit.analysis import limit_analysis

__all__ = ["limit_analysis"]
