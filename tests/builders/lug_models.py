"""A pier and a strut that meet at a lug: all that holds the pier up more than its own weight is that one contact."""

import numpy as np

import limitmason as lm

HEIGHT, TOP = 1.5, 1.4


def lug(deg, length=0.021, *, scale=1.0, turn=0.0, mirror=1.0, order=None, **options):
    """Ground, pier A and strut B, whose lug meets A's face at its lower end and opens upwards by an angle [deg].

    The joint at the lug is smooth, those on the ground cannot slide.
    """
    foot = TOP - length
    outlines = {
        "ground": [[-1, -0.3], [3, -0.3], [3, 0], [-1, 0]],
        "A": [[0, 0], [0.5, 0], [0.5, HEIGHT], [0, HEIGHT]],
        "B": [[0.6, 0], [1.1, 0], [1.1, HEIGHT], [0.6, HEIGHT], [0.6, TOP],
              [0.5 + length * np.tan(np.deg2rad(deg)), TOP], [0.5, foot], [0.6, foot]],
    }
    names = [list(outlines)[k] for k in order or (0, 1, 2)]
    c, s = np.cos(turn), np.sin(turn)
    m = scale * np.array([[c, -s], [s, c]]) @ np.diag([mirror, 1.0])
    return lm.Assembly.from_polygons(
        [np.array(outlines[n]) @ m.T for n in names], names=names, thickness=0.3 * scale, joint=lm.Joint(85.0),
        joints=options.pop("joints", {("A", "B"): lm.Joint(0.0)}), fixed=["ground"], **options,
    )


def push_on_pier(assembly):
    """Self weight, and the pier's own weight sideways as live load."""
    weight = lm.Loads.weight(assembly)
    live = np.zeros_like(weight.live)
    live[assembly.block_index("A"), 0] = assembly.weights[assembly.block_index("A")]
    return lm.Loads(weight.dead, live)


def closed_form(assembly, deg, along):
    """The multiplier at which A topples about its toe and takes B with it about B's.

    The push N acts along the mean of both normals, cos(t/2), -sin(t/2) on B, at a point of the plane midway between the
    faces, up to a distance ``along`` above the lug's foot [m]:
    N (z cos - (1.1 - x) sin) = W_B (1.1 - x_B), lambda W_A z_A = W_A (0.5 - x_A) + N ((x - 0.5) sin + z cos).
    """
    a, b = assembly.block_index("A"), assembly.block_index("B")
    c, w = assembly.centroids, assembly.weights
    cos, sin = np.cos(np.deg2rad(deg / 2)), np.sin(np.deg2rad(deg / 2))
    foot = assembly.blocks[b].vertices
    z0 = foot[np.abs(foot[:, 0] - 0.5) < 1e-9, 2].min()
    best = 0.0
    for s in (0.0, along):
        x, z = 0.5 + s * sin, z0 + s * cos
        push = w[b] * (1.1 - c[b, 0]) / (z * cos - (1.1 - x) * sin)
        best = max(best, (w[a] * (0.5 - c[a, 0]) + push * ((x - 0.5) * sin + z * cos)) / (w[a] * c[a, 2]))
    return best


def whole(deg, length):
    """Length of the common area, both faces projected on the plane midway between them [m]."""
    return length * np.cos(np.deg2rad(deg / 2)) / np.cos(np.deg2rad(deg))
