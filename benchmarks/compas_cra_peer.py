"""The same walls in compas_cra: one equilibrium check there against a whole limit analysis here.

compas_cra (coupled rigid-block analysis, Kao and others 2022, doi.org/10.1016/j.cad.2022.103216) answers whether given
loads are in equilibrium; a multiplier takes a search over such checks. It needs its own environment, with limitmason
installed in it as well:

    python -m venv cra && cra/bin/pip install compas_cra && cra/bin/pip install -e .
    cra/bin/python benchmarks/compas_cra_peer.py

Versions before 0.6 also need IPOPT on the path (conda-forge: ipopt). Both programs get the same blocks and detect their
contacts themselves; the numbers of contact polygons are printed so that a difference shows.
"""

import argparse
import os
import sys
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import limitmason as lm

UNITS_AND_COURSES = {55: (5, 10), 210: (10, 20)}
FRICTION = 0.65


def wall(blocks):
    """Running bond of units 0.4 x 0.2 x 0.2 m on a slab."""
    units, courses = UNITS_AND_COURSES[blocks]
    joint = lm.Joint.from_friction_coefficient(FRICTION)
    return lm.build.wall(length=0.4 * units, courses=courses, unit=(0.4, 0.2, 0.2), joint=joint)


def peer_assembly(assembly):
    """The assembly as compas_cra keeps it, held blocks as supports, contacts found by compas_cra."""
    from compas_assembly.datastructures import Block
    from compas_cra.algorithms import assembly_interfaces_numpy
    from compas_cra.datastructures import CRA_Assembly

    other = CRA_Assembly()
    for number, block in enumerate(assembly.blocks):
        solid = block.parts[0]
        other.add_block(Block.from_vertices_and_faces(solid.vertices.tolist(), [list(f) for f in solid.faces]), number)
    other.set_boundary_conditions([int(i) for i in assembly.fixed.nonzero()[0]])
    assembly_interfaces_numpy(other, nmax=10, amin=1e-4, tmax=1e-4)
    return other


def compare(blocks):
    """One row: our contacts and seconds of a whole limit analysis, theirs of one equilibrium check."""
    from compas_cra.equilibrium import cra_solve

    assembly = wall(blocks)
    start = time.perf_counter()
    prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly), in_plane=False)
    ours = time.perf_counter() - start
    start = time.perf_counter()
    other = peer_assembly(assembly)
    detection = time.perf_counter() - start
    contacts = sum(len(other.graph.edge_attribute(edge, "interfaces")) for edge in other.graph.edges())
    start = time.perf_counter()
    try:
        cra_solve(other, mu=FRICTION, density=1.0)
        verdict = "stands"
    except ValueError as error:
        verdict = f"no equilibrium found ({error})"
    theirs = time.perf_counter() - start
    return (
        f"| {blocks} | {len(assembly.interfaces)} | {contacts} | {ours:.2f} "
        f"| {prediction.collapse_multiplier:.6f} (stands) | {detection:.2f} | {theirs:.2f} | {verdict} |"
    )


def main():
    """Print one row per wall, or what to install."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", choices=UNITS_AND_COURSES, default=[55, 210])
    options = parser.parse_args()
    try:
        import compas_cra  # noqa: F401
    except ImportError:
        print(
            "compas_cra is not installed. In an environment of its own: pip install compas_cra, then pip install -e ."
        )
        return 1
    print(
        "| blocks | our contacts | their contacts | limit analysis [s] | multiplier | their contacts [s] "
        "| their check, self weight [s] | verdict |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for blocks in options.sizes:
        print(compare(blocks), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
