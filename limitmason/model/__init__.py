"""The nouns every method works on: blocks, joints, interfaces, supports, loads and their assembly.

All of them are frozen.
"""

from limitmason.display.notebook import shows
from limitmason.model.arrays import AssemblyArrays
from limitmason.model.assembly import Assembly, ContactError
from limitmason.model.block import Block
from limitmason.model.contact_warnings import ContactWarning
from limitmason.model.interface import Interface
from limitmason.model.joint import Joint, LostBy, Unloading
from limitmason.model.load import Loads
from limitmason.model.material import Material
from limitmason.model.plausibility import PlausibilityWarning
from limitmason.model.ring_beam import ring_beam
from limitmason.model.support import DEGREES_OF_FREEDOM, Support
from limitmason.model.support_motion import SupportMotion
from limitmason.model.tie import Tie

__all__ = [
    "DEGREES_OF_FREEDOM", "Assembly", "AssemblyArrays", "Block", "ContactError", "ContactWarning", "Interface", "Joint",
    "Loads", "LostBy", "Material", "PlausibilityWarning", "Support", "SupportMotion", "Tie", "Unloading", "ring_beam",
]

shows(__name__)
