"""Builders: assemblies of masonry from a few numbers, with a recipe that says what was built.

>>> from limitmason import Joint, build
>>> joint = Joint(friction_angle_deg=33.0)
>>> wall = build.wall(length=2.0, courses=10, unit=(0.4, 0.2, 0.2), joint=joint)
>>> wall.n_blocks  # 55 units and the ground
56
"""

from limitmason.build.arch import arch, arch_from_curves
from limitmason.build.column import column
from limitmason.build.cracks import with_potential_cracks
from limitmason.build.dome import dome
from limitmason.build.floor import with_floor
from limitmason.build.layout import layout
from limitmason.build.opening import Opening
from limitmason.build.vault import vault
from limitmason.build.wall import wall
from limitmason.display.notebook import shows

__all__ = [
    "Opening", "arch", "arch_from_curves", "column", "dome", "layout", "vault",
    "wall", "with_floor", "with_potential_cracks",
]

shows(__name__)
