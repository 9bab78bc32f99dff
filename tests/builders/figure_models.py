"""Assemblies and predictions that the tests of figures draw, and how they find what was drawn."""

import numpy as np

from limitmason import Assembly, Joint
from limitmason.answers.results import Mechanism, Prediction

JOINT = Joint(35.0)


GROUND = [[-1, -0.3], [4, -0.3], [4, 0], [-1, 0]]


def make_column(n=3, **options):
    """n blocks of 1 x 1 m, 0.5 m thick, on a ground slab."""
    outlines = [GROUND] + [[[0, k], [1, k], [1, k + 1], [0, k + 1]] for k in range(n)]
    return Assembly.from_polygons(
        [np.array(o, dtype=float) for o in outlines], thickness=0.5, joint=JOINT, fixed=[0], **options
    )


def make_portal():
    """A concave block, cut into convex pieces, with a lintel on it."""
    concave = [[0, 0], [1, 0], [1, 1], [2, 1], [2, 0], [3, 0], [3, 1.8], [0, 1.8]]
    top = [[0, 1.8], [3, 1.8], [3, 2.2], [0, 2.2]]
    return Assembly.from_polygons(
        [np.array(o, dtype=float) for o in (GROUND, concave, top)], thickness=0.6, joint=JOINT, fixed=[0]
    )


def rocking(assembly, blocks, toe=(1.0, 0.25, 0.0), axis=(0.0, 1.0, 0.0)):
    twists = np.zeros((assembly.n_blocks, 6))
    for b in blocks:
        twists[b] = [*np.cross(axis, assembly.centroids[b] - np.array(toe)), *axis]
    return make_prediction(assembly, twists)


def sliding(assembly, blocks, direction=(1.0, 0.0, 0.0)):
    twists = np.zeros((assembly.n_blocks, 6))
    twists[list(blocks), :3] = direction
    return make_prediction(assembly, twists)


def make_prediction(assembly, twists, resultants=None, status="solved"):
    none = np.zeros((0, 1))
    return Prediction(
        "limit analysis, associative", 0.3217, "exact for the associative law", status,
        None if twists is None else Mechanism(twists, none[:, 0], none), resultants,
    )


def artist(figure, gid):
    """The one artist that carries a label of ours."""
    found = [a for ax in figure.axes for a in ax.get_children() if a.get_gid() == gid]
    assert len(found) == 1, gid
    return found[0]


def has(figure, gid):
    return any(a.get_gid() == gid for ax in figure.axes for a in ax.get_children())


def texts(figure):
    return "\n".join(t.get_text() for t in figure.findobj(lambda a: hasattr(a, "get_text")))


def legend_labels(figure):
    legends = figure.legends + [ax.get_legend() for ax in figure.axes if ax.get_legend()]
    return [t.get_text() for legend in legends for t in legend.get_texts()]
