"""Geometry on plain arrays: polygons, polyhedra, box tree and contact detection.

It knows no field terms.
"""

from limitmason.display.notebook import shows
from limitmason.geometry.contact import ContactPatches, ContactRules, find_contacts
from limitmason.geometry.polygon import clean_outline, convex_pieces, polar_mean_radius, polygon_area_centroid
from limitmason.geometry.polyhedron import Solid, box, mass_properties, prism

__all__ = [
    "ContactPatches", "ContactRules", "Solid", "box", "clean_outline", "convex_pieces", "find_contacts",
    "mass_properties", "polar_mean_radius", "polygon_area_centroid", "prism",
]

shows(__name__)
