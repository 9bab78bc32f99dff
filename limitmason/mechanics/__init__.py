"""What all methods share: the law of joints, contact points, equilibrium, and what a state violates."""

from limitmason.display.notebook import shows
from limitmason.mechanics.certificate import certify
from limitmason.mechanics.contact_points import ContactPoints
from limitmason.mechanics.equilibrium import equilibrium_matrix
from limitmason.mechanics.plane import Plane, find_plane

__all__ = ["ContactPoints", "Plane", "certify", "equilibrium_matrix", "find_plane"]

shows(__name__)
