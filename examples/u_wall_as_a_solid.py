"""A U wall as a homogeneous solid and as blocks: stiffness, modes, and how alike their shapes are.

The mortared wall of Murano et al. (REGW). The solid needs no layout of stones; the blocks stand on the assumed bond.

    python examples/u_wall_as_a_solid.py [--push]
"""

import sys
from pathlib import Path

import limitmason as lm
from limitmason import experiments, figures
from limitmason.continuum import push, solve_elastic

sys.path.insert(0, str(Path(__file__).parents[1]))  # of the source tree, whose validation holds the models
from validation.murano_macro import control_point, macro_model, published

test = experiments.load("murano-u-walls", "REGW")
solid = macro_model(test, size=0.15)
point = control_point(test)

at_rest, loaded = (solve_elastic(solid, load).at(point)[0, 1] for load in (0.0, 1.0))
stiffness = 1e-3 / (at_rest - loaded)
print(f"elastic stiffness {stiffness:.2f} kN/mm, printed {float(published('REGW')['stiffness']):g}")

of_solid, of_blocks = lm.modes(solid, 3), lm.modes(test.assembly(), 3)
print(of_solid, of_blocks, sep="\n")
alike = lm.mac(of_solid, of_blocks)
print(alike)

if "--push" in sys.argv:  # some minutes
    curve = push(solid, control=(point, (0.0, -1.0, 0.0)), to=2e-3, first=2e-5, largest=1e-4, progress=print)
    print(curve)
figures.mode_shape(of_solid, 1).savefig("u_wall_mode_1.png")
figures.mac_matrix(alike, names=("solid", "blocks"), title="REGW").savefig("u_wall_mac.png")
