"""Solids that are not convex: parts against volumes and moments of the whole, and collapse against closed forms."""

import numpy as np
import pytest
from scipy.stats import special_ortho_group

import limitmason as lm
from limitmason.errors import InputError
from limitmason.geometry import Solid, box, mass_properties, prism
from limitmason.geometry.convex_parts import convex_parts, is_convex

L = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]
U = [[0, 0], [3, 0], [3, 2], [2, 2], [2, 1], [1, 1], [1, 2], [0, 2]]
T = [[1, 0], [2, 0], [2, 1], [3, 1], [3, 2], [0, 2], [0, 1], [1, 1]]
PORTAL = [[0, 0], [1, 0], [1, 1], [2, 1], [2, 0], [3, 0], [3, 2], [0, 2]]
HOOK = [[0, 0], [1, 0], [1, 1], [3, 1], [3, 2], [0, 2]]
TURN = special_ortho_group.rvs(3, random_state=np.random.default_rng(15))
UPRIGHT = np.eye(3)
GROUND = box((-2, -1, -1), (5, 2, 0))


def moved(solid, turn=TURN, scale=1.0, by=(0.0, 0.0, 0.0)):
    return Solid(scale * solid.vertices @ turn.T + np.array(by), solid.faces)


def shells(*boxes):
    """Surface of boxes, the later ones hollows of the first: (low, high) each."""
    vertices, faces = [], []
    for k, (low, high) in enumerate(boxes):
        one = box(low, high)
        faces += [tuple(i + 8 * k for i in (f if k == 0 else f[::-1])) for f in one.faces]
        vertices.append(one.vertices)
    return Solid(np.vstack(vertices), tuple(faces))


def ring():
    """A square frame 3 x 3 x 1 around an opening 1 x 1, of four-cornered faces."""
    flat = [[0, 0], [3, 0], [3, 3], [0, 3], [1, 1], [2, 1], [2, 2], [1, 2]]
    v = np.array([(x, y, z) for y in (0.0, 1.0) for x, z in flat])
    sides = [(i, (i + 1) % 4) for i in range(4)]
    front = [(i, j, j + 4, i + 4) for i, j in sides]
    back = [tuple(k + 8 for k in f[::-1]) for f in front]
    out = [(j, i, i + 8, j + 8) for i, j in sides] + [(i + 4, j + 4, j + 12, i + 12) for i, j in sides]
    return Solid(v, tuple(tuple(f) for f in (*front, *back, *out)))


SOLIDS = {
    "L": (prism(L, 0, 1), 2, 3.0), "U": (prism(U, 0, 1), 3, 5.0), "T": (prism(T, 0, 1), 2, 4.0),
    "ring": (ring(), 4, 8.0), "cavity": (shells(((0, 0, 0), (3, 3, 3)), ((1, 1, 1), (2, 2, 2))), 6, 26.0),
}


@pytest.mark.filterwarnings("ignore::limitmason.model.plausibility.PlausibilityWarning")
@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("scale, by", [(1.0, (0, 0, 0)), (1e-3, (0.5, 0, 0)), (1e3, (1e4, 2e4, 0))])
def test_parts_are_convex_and_have_volume_centroid_and_inertia_of_the_whole(name, scale, by):
    solid, number, volume = SOLIDS[name]
    for turn in (UPRIGHT, TURN):
        whole = moved(solid, turn, scale, by)
        size = scale * 3.0
        parts = convex_parts(whole, 1e-9 * size)
        assert len(parts) == number
        assert is_convex(parts, 1e-8 * size).all()
        assert mass_properties([whole]).volume[0] == pytest.approx(volume * scale**3, rel=1e-9)
        block = lm.Assembly.from_polyhedra([parts], joint=lm.Joint(30.0), tolerance=1e-6 * size).blocks[0]
        exact = mass_properties([whole])
        assert block.volume == pytest.approx(volume * scale**3, rel=1e-9)
        assert block.centroid == pytest.approx(exact.centroid[0], abs=1e-8 * size)
        assert block.inertia / block.density == pytest.approx(exact.inertia[0], abs=1e-8 * size**5)


def test_parts_do_not_depend_on_how_faces_are_divided_and_numbered():
    whole = prism(U, 0, 1)
    order = np.random.default_rng(0).permutation(len(whole.vertices))
    place = np.argsort(order)
    strips = {(0, 1, 4, 5), (1, 2, 3, 4), (5, 6, 7, 0)}  # of the U, counter-clockwise
    faces = [tuple(int(place[i]) for i in f) for f in whole.faces if len(f) == 4]
    faces += [tuple(int(place[i]) for i in f) for f in strips]
    faces += [tuple(int(place[i + 8]) for i in f[::-1]) for f in strips]
    again = convex_parts(Solid(whole.vertices[order], tuple(faces)), 1e-9)
    for parts in (convex_parts(whole, 1e-9), again):
        assert sorted(mass_properties(parts).volume) == pytest.approx([1.0, 2.0, 2.0])


def test_a_warped_solid_far_from_the_origin_is_divided_as_one_near_it():
    """Map coordinates: the size of a common face is that of its sides, not of its coordinates."""
    warped = prism(L, 0, 1).vertices + np.array([[3e-5, 0, 0]] + [[0, 0, 0]] * 11)
    for by in ((0, 0, 0), (5e5, 5e6, 0)):
        block = lm.Assembly.from_polyhedra([(warped + by, prism(L, 0, 1).faces)], joint=lm.Joint(30.0)).blocks[0]
        assert len(block.parts) == 2
        assert block.volume == pytest.approx(3.0, rel=1e-4)


def test_what_cannot_be_divided_is_refused_with_advice():
    two = shells(((0, 0, 0), (1, 1, 1)), ((3, 0, 0), (4, 1, 1)))
    outward = Solid(two.vertices, (*two.faces[:6], *(f[::-1] for f in two.faces[6:])))
    joint = lm.Joint(30.0)
    with pytest.raises(InputError, match="'block-0' is not convex, and it consists of bodies that are not joined"):
        lm.Assembly.from_polyhedra([outward], joint=joint)
    angle = np.linspace(0.0, 2.0 * np.pi, 240, endpoint=False)
    gear = np.column_stack([np.cos(angle), np.sin(angle)]) * np.where(np.arange(240) % 2, 1.0, 0.9)[:, None]
    with pytest.raises(InputError, match="more than 40 convex parts: .*fewer faces"):
        lm.Assembly.from_polyhedra([prism(gear, 0, 1)], joint=joint)


# ---- collapse: one rigid body, against closed forms ----------------------------------------------------------------


def overturning(outline, direction, *, friction=60.0, turn=UPRIGHT, others=(GROUND,), **options):
    """Multiplier of a block under its weight sideways, standing on what is fixed."""
    solids = [moved(s, turn) for s in (*others, prism(outline, 0, 1))]
    wall = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(friction), fixed=range(len(others)), **options)
    assert wall.n_blocks == len(others) + 1
    weight = turn @ [0.0, 0.0, -1.0]
    mass = np.array([b.mass for b in wall.blocks]) * ~wall.fixed
    dead, live = (np.hstack([9.81 * np.outer(mass, d), np.zeros((wall.n_blocks, 3))])
                  for d in (weight, turn @ np.array(direction, dtype=float)))
    return lm.limit_analysis(wall, lm.Loads(dead, live)).collapse_multiplier


@pytest.mark.parametrize(
    "outline, direction, exact",
    [
        (L, (1, 0, 0), (2 - 5 / 6) / (5 / 6)),  # centroid at 5/6, 5/6: about the toe at 2
        (L, (-1, 0, 0), 1.0),
        (T, (1, 0, 0), 0.5 / 1.25),  # on its stem alone
        (PORTAL, (1, 0, 0), 1.5 / 1.1),
        (PORTAL, (0, 1, 0), 0.5 / 1.1),
    ],
)
def test_a_block_of_several_parts_overturns_as_one(outline, direction, exact):
    assert overturning(outline, direction) == pytest.approx(exact, rel=1e-6)
    assert overturning(outline, direction, turn=TURN) == pytest.approx(exact, rel=1e-6)
    assert overturning(outline, direction, friction=10.0) == pytest.approx(np.tan(np.deg2rad(10.0)), rel=1e-6)


def test_a_hook_without_friction_holds_by_its_inner_face():
    # a slab 3 x 1 with a leg 1 x 1 hangs over a post 1 wide: the leg stops sliding and the hook turns about the post's
    # far corner (2, 1): alpha (z - 1) = 2 - x with the centroid x = z = 5/4
    post = box((1, 0, -1), (2, 1, 1))
    assert overturning(HOOK, (1, 0, 0), friction=0.0, others=(post,)) == pytest.approx(3.0, rel=1e-6)
    assert overturning(HOOK, (-1, 0, 0), friction=0.0, others=(post,)) == pytest.approx(0.0, abs=1e-7)


def test_parts_as_blocks_of_their_own_need_joints_that_cannot_fail():
    legs = [box((0, 0, 0), (1, 1, 1)), box((2, 0, 0), (3, 1, 1)), box((0, 0, 1), (3, 1, 2))]

    def multiplier(**between):
        wall = lm.Assembly.from_polyhedra([GROUND, *legs], joint=lm.Joint(60.0), fixed=[0], joints=between)
        return lm.limit_analysis(wall, lm.Loads.horizontal(wall, (1, 0, 0))).collapse_multiplier

    strong = lm.Joint(60.0, cohesion=1e9, tensile_strength=1e9)
    assert multiplier(bed=strong) == pytest.approx(1.5 / 1.1, rel=1e-6)
    assert multiplier() < 0.99 * 1.5 / 1.1


@pytest.mark.slow
def test_distinct_elements_and_mechanisms_take_it_as_one_body_too():
    # the hook over a post whose left part is 0.1 lower: its leg bears at 0.9, alpha (0.25 + 0.1) = 0.75
    stiff = lm.Joint(0.0, normal_stiffness=1e11, shear_stiffness=1e11)
    posts = [box((1, 0, -1), (1.2, 1, 0.9)), box((1.2, 0, -1), (2, 1, 1))]
    hook = lm.Assembly.from_polyhedra([*posts, prism(HOOK, 0, 1)], joint=stiff, fixed=[0, 1])
    loads = lm.Loads.horizontal(hook, (1, 0, 0))
    assert lm.limit_analysis(hook, loads).collapse_multiplier == pytest.approx(0.75 / 0.35, rel=1e-6)
    simulated = lm.predict(hook, loads, "dem", error_budget=(), contact_points=(4, 2))
    assert simulated.collapse_multiplier == pytest.approx(0.75 / 0.35, rel=5e-3)
    tee = lm.Assembly.from_polyhedra([GROUND, prism(T, 0, 1)], joint=lm.Joint(50.0), fixed=[0])
    answer = lm.predict(tee, lm.Loads.horizontal(tee, (1, 0, 0)), "mechanisms")
    assert answer.collapse_multiplier == pytest.approx(0.4, rel=1e-6)
