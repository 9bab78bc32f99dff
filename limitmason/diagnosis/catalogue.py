"""Old name of :mod:`limitmason.causes`, kept for one release."""

import warnings

from limitmason import causes

warnings.warn("limitmason.diagnosis.catalogue is now limitmason.causes", DeprecationWarning, stacklevel=2)

__all__ = list(causes.__all__)


def __getattr__(name: str) -> object:
    return getattr(causes, name)


def __dir__() -> list[str]:
    return sorted(__all__)
