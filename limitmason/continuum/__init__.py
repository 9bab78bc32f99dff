"""Masonry as a continuum: solids of 20-node bricks from the outlines of block models, on scikit-fem."""

from limitmason.continuum.elastic import ElasticState, solve_elastic
from limitmason.continuum.mesh import Box, Mesh, mesh_boxes
from limitmason.continuum.path import push
from limitmason.continuum.result import SolidCurve, load_curve
from limitmason.continuum.solid import Continuum
from limitmason.display.notebook import shows

__all__ = [
    "Box", "Continuum", "ElasticState", "Mesh", "SolidCurve", "load_curve", "mesh_boxes", "push", "solve_elastic",
]

shows(__name__)
