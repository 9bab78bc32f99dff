"""A group of held blocks that a stage drives as one, against statics: head joints between them do not lock it."""

import pytest

import dem
import limitmason as lm
from limitmason.geometry import box


@pytest.mark.slow
@pytest.mark.parametrize("cohesion", [0.0, 1e5])
def test_a_strip_that_sinks_bears_what_turning_about_the_rest_leaves(cohesion):
    """Three of four blocks under a beam of 4 m sink: it turns about the edge of the first, R (4 - 1) = W (2 - 1)."""
    solids = [*[box((k, 0, -1), (k + 1, 1, 0)) for k in range(4)], box((0, 0, 0), (4, 1, 0.5))]
    stiff = {"normal_stiffness": 1e9, "shear_stiffness": 1e9}
    glued = lm.Joint(30.0, cohesion=cohesion, tensile_strength=0.5 * cohesion, **stiff)
    heads = {(f"block-{k}", f"block-{k + 1}"): glued for k in range(3)}
    model = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(30.0, **stiff), fixed=range(4), joints=heads)
    moves = lm.SupportMotion((0.0, 0.0, -1e-3)).displacements(model, [1, 2, 3])
    drive = dem.Drive(moves, steps=4000)
    run = dem.simulate(model, [dem.Settle(), drive], contact_points=(2, 2), detect_every=None)
    assert run.reaction[-1, 1:4, 2].sum() == pytest.approx(model.weights[4] / 3.0, rel=3e-3)
