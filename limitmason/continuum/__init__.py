"""Masonry as a continuum: solids of 20-node bricks from the outlines of block models, on scikit-fem."""

from limitmason.continuum.elastic import ElasticState, solve_elastic
from limitmason.continuum.material import Material
from limitmason.continuum.mesh import Box, Mesh, mesh_boxes
from limitmason.continuum.solid import Continuum

__all__ = ["Box", "Continuum", "ElasticState", "Material", "Mesh", "mesh_boxes", "solve_elastic"]
