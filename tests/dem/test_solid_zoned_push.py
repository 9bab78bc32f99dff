"""Walls of zones in space that are driven out of their plane: the associative multiplier, resuming, what is refused."""

import numpy as np
import pytest

import dem
import limitmason as lm
from limitmason import figures
from limitmason.errors import InputError

STIFF = lm.Material(young_modulus=2e11, poisson_ratio=0.2, density=2000.0)


def corner(phi=35.0, psi=35.0, courses=2, **joint):
    """A corner of two walls in plan under a rigid beam on the facade; its last unit has no material and stays rigid."""
    law = lm.Joint(phi, dilatancy_angle_deg=psi, **({"normal_stiffness": 5e11, "shear_stiffness": 5e11} | joint))
    made = lm.build.wall(
        length=0.8, courses=courses, unit=(0.4, 0.2, 0.2), joint=law, density=2000.0, plan="L", return_length=0.8,
        top_beam=0.2, beam_density=20_000.0,
    )  # fmt: skip
    names = [b.name for b in made.blocks]
    return made.with_material(STIFF, blocks=[n for n in names if n not in ("beam", names[-2])])


def zoned(model, drive, **options):
    return dem.push(model, dem.Drive({"beam": drive}), **({"blocks": "zoned", "stress": "solid"} | options))


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["x", "y"])
def test_psi_equal_to_phi_carries_the_associative_multiplier_in_space(axis):
    model = corner(courses=3)
    loads = lm.Loads.weight(model)
    force = [float(axis == a) for a in "xyz"]
    live = loads.with_point_load(model, "beam", force, at=tuple(model.centroids[model.block_index("beam")]))
    exact = lm.limit_analysis(model, live, contact_model="grid", grid=(3, 3)).collapse_multiplier
    options = dict(to=2e-4, zone_size=0.2, contact_points=(3, 3), samples=40, rate_check=False)
    curve = zoned(model, {axis: 1.0}, steps=15_000, **options)
    assert curve.residual == pytest.approx(exact, rel=2e-3)
    assert curve.errors["energy"].max() < 6e-3  # falls as 1 / steps: joints that stick and slide
    assert sum(b.material is None for b in model.blocks) == 2
    cut = [b.volume for b, held in zip(model.blocks, model.fixed, strict=True) if b.material is not None and not held]
    assert len(curve.mesh.zones) * 0.2**3 == pytest.approx(sum(cut), rel=1e-9)
    assert "zones up to 200 mm, solid; elastic" in str(curve)


def test_a_push_of_one_zoned_brick_is_springs_in_series_and_settles_by_its_weight():
    e, kn, height = 1e9, 2e9, 0.1
    outlines = [[(0, z), (0.2, z), (0.2, z + height), (0, z + height)] for z in (-0.1, 0.0, 0.1)]
    smooth = lm.Joint(0.0, normal_stiffness=kn, shear_stiffness=1e4, cohesion=0.0, tensile_strength=1e6)
    stack = lm.Assembly.from_polygons(outlines, thickness=0.1, joint=smooth, fixed=[0])
    stack = stack.with_material(lm.Material(young_modulus=e, poisson_ratio=0.2, density=2000.0), blocks=[1])
    options = dict(blocks="zoned", stress="solid", zone_size=0.1, samples=20, steps=4000, rate_check=False)
    curve = dem.push(stack, dem.Drive({"block-2": {"z": -1.0}}), to=1e-5, **options)
    assert curve.spacing == pytest.approx(0.1)
    # the load is the mean of the last quarter of a sample: it lags behind by the same everywhere
    slope = (curve.load[-1] - curve.load[8]) / (curve.displacement[-1] - curve.displacement[8])
    assert slope == pytest.approx(0.02 / (2 / kn + height / e), rel=1e-4)
    weight = 2000.0 * 9.81 * 0.1  # of a block over its area; the lower joint carries two
    assert curve.settlement == pytest.approx(weight * (3.0 / kn + 1.5 * height / e), rel=1e-4)


@pytest.mark.slow
def test_a_stopped_push_goes_on_to_the_bits_of_the_whole_one(tmp_path):
    weak = dict(normal_stiffness=2e10, shear_stiffness=1e10, cohesion=5e3, tensile_strength=3e3, residual_cohesion=0.0)
    model = corner(40.0, 5.0, **weak)
    options = dict(to=(6e-4, 3e-4), zone_size=0.2, samples=30, steps=900)
    whole = zoned(model, {"y": 1.0}, **options)
    assert np.nanmax(whole.slip[-1]) > 1e-5  # or the file would have nothing to hold
    assert np.nanmax(whole.failed[-1]) > 0.1
    seen = []

    def stop(sample):
        seen.append(sample)
        return len(seen) == 40

    file = tmp_path / "cut.npz"
    cut = zoned(model, {"y": 1.0}, checkpoint=file, progress=stop, **options)
    assert cut.status == "interrupted"
    again = zoned(corner(40.0, 5.0, **weak), {"y": 1.0}, checkpoint=file, **options)
    for name in ("displacement", "load", "opening", "slip", "used", "failed"):
        assert np.array_equal(getattr(again, name), getattr(whole, name), equal_nan=True), name
    for mine, other in zip(again.states, whole.states, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(mine, other, strict=True))
    with pytest.raises(InputError, match="its zones"):
        zoned(model, {"y": 1.0}, checkpoint=file, **{**options, "zone_size": 0.1})


def test_what_a_push_of_zones_in_space_cannot_do_is_refused():
    model = corner()
    with pytest.raises(InputError, match="leaves the x-z plane, in which zoned blocks stay: .* stress='solid'"):
        zoned(model, {"y": 1.0}, to=1e-4, zone_size=0.2, stress="plane stress")
    with pytest.raises(InputError, match="larger than the shortest edge"):
        zoned(model, {"y": 1.0}, to=1e-4, zone_size=0.3)
    with pytest.raises(InputError, match="stress="):
        zoned(model, {"y": 1.0}, to=1e-4, zone_size=0.2, stress="solid state")
    curve = zoned(model, {"y": 1.0}, to=1e-6, zone_size=0.2, samples=10, steps=100, rate_check=False)
    assert curve.first_unit_crack(1e-9) is None
    with pytest.raises(InputError, match="elastic"):
        figures.plasticity(curve)
