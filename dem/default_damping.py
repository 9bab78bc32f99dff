"""Damping of the DEM where the user names none: to settle, in a search, in stages, in a push, of zones.

Its coefficients and their ranges: ``limitmason.model.stages.Damping``.
"""

from limitmason.model.stages import Damping

SETTLING = Damping(local=0.8)
"""Damping while a structure comes to rest: it takes no part of an answer at rest, and sets how soon that is reached.

Nothing moves on while it settles: as much as is still stable brings it to rest soonest.
"""

SEARCHING = Damping(local=0.4, kinetic=True)
"""Damping while a load of a search is held: chosen, not derived."""

RAMPING = Damping(local=0.5)
"""Damping of a quasi-static stage that loads: as much as for settling would carry a part of the load."""

FREE = Damping()
"""None in a dynamic run, where damping is the user's to state."""

PUSHING = Damping(local=0.5, combined=True)
"""Damping of a driven run; local damping alone drags on what slides: 5 % of a plastic wall's load, 20 % of peaks."""

ZONES = 0.8
"""Local damping for which masses of zones are scaled: it can make a force 1.8 times as large."""
