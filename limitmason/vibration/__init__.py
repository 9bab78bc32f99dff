"""Small vibrations: natural modes of blocks and solids, and how alike the shapes of two models are."""

from limitmason.display.notebook import shows
from limitmason.vibration.mac import Mac, mac
from limitmason.vibration.modal_test import ModalTest
from limitmason.vibration.modes import Modes, modes
from limitmason.vibration.system import VibratingSystem

__all__ = ["Mac", "ModalTest", "Modes", "VibratingSystem", "mac", "modes"]

shows(__name__)
