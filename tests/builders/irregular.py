"""Seeded irregular plane assemblies of a few blocks: convex cells of a Voronoi partition on a fixed floor."""

import numpy as np

import limitmason as lm


def _left_of(outline, point, normal):
    """Part of a convex outline where (x - point) . normal <= 0."""
    side = (outline - point) @ normal
    kept = []
    for k, (a, sa) in enumerate(zip(outline, side, strict=True)):
        b, sb = outline[(k + 1) % len(outline)], side[(k + 1) % len(outline)]
        if sa <= 0:
            kept.append(a)
        if sa * sb < 0:
            kept.append(a + (b - a) * sa / (sa - sb))
    return np.array(kept)


def cells(seeds, width, height):
    """Outlines of the Voronoi cells of seeds (n, 2) in a rectangle that stands on z = 0."""
    box = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    out = []
    for k, seed in enumerate(seeds):
        outline = box
        for j, other in enumerate(seeds):
            if j != k:
                outline = _left_of(outline, 0.5 * (seed + other), other - seed)
        out.append(outline)
    return out


def irregular(seed, *, blocks=4, joints=(5, 9), phi_deg=None, psi_share=0.0, cohesion=0.0, tensile_strength=0.0,
              size=1.0, density=2000.0):
    """Assembly of Voronoi cells with between so many joints, floor included, that carries its own weight.

    ``psi_share`` is tan(psi) over tan(phi); phi is drawn between 20 and 45 degrees where it is not given. Draws are
    repeated until joint lengths exceed a tenth of the mean and the structure stands without live load.
    """
    rng = np.random.default_rng([20, blocks, seed])
    while True:
        width, height = rng.uniform(0.6, 1.6, 2)
        outlines = cells(rng.uniform(0.0, 1.0, (blocks, 2)) * (width, height), width, height)
        phi = float(rng.uniform(20.0, 45.0)) if phi_deg is None else phi_deg
        edges = np.concatenate([np.linalg.norm(o - np.roll(o, 1, axis=0), axis=1) for o in outlines])
        if edges.min() < 0.1 * edges.mean():
            continue
        floor = np.array([[-0.5, -0.3], [width + 0.5, -0.3], [width + 0.5, 0.0], [-0.5, 0.0]])
        psi = float(np.degrees(np.arctan(psi_share * np.tan(np.radians(phi)))))
        joint = lm.Joint(phi, dilatancy_angle_deg=psi, cohesion=cohesion, tensile_strength=tensile_strength)
        assembly = lm.Assembly.from_polygons(
            [size * floor, *(size * o for o in outlines)], thickness=0.5 * size, joint=joint, density=density,
            fixed=[0], tolerance=1e-7 * size,
        )
        if not joints[0] <= len(assembly.interfaces) <= joints[1]:
            continue
        loads = lm.Loads.horizontal(assembly)
        if lm.limit_analysis(assembly, loads).status == "solved":
            return assembly, loads


def wedged(seed, *, blocks=4):
    """Voronoi cells of which any two are fixed, live load in any direction of the plane: often wedged."""
    rng = np.random.default_rng([7, seed])
    while True:
        width, height = rng.uniform(0.6, 1.6, 2)
        outlines = cells(rng.uniform(0.0, 1.0, (blocks, 2)) * (width, height), width, height)
        edges = np.concatenate([np.linalg.norm(o - np.roll(o, 1, axis=0), axis=1) for o in outlines])
        if edges.min() < 0.05 * edges.mean():
            continue
        joint = lm.Joint(float(rng.uniform(20.0, 45.0)))
        held = sorted(rng.choice(blocks, 2, replace=False).tolist())
        assembly = lm.Assembly.from_polygons(
            outlines, thickness=0.5, joint=joint, density=2000.0, fixed=held, tolerance=1e-7
        )
        angle = rng.uniform(0.0, 2.0 * np.pi)
        loads = lm.Loads.horizontal(assembly)
        live = np.zeros_like(loads.live)
        live[:, 0], live[:, 2] = assembly.weights * np.cos(angle), assembly.weights * np.sin(angle)
        return assembly, lm.Loads(loads.dead, live)
