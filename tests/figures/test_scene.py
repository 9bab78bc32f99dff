"""The interactive scene: what the file holds is the model and its motion, and a real browser shows it."""

import base64
import json
import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.image import imread

import limitmason as lm
from limitmason.display.text_table import markdown_line
from limitmason.errors import InputError
from limitmason.geometry import box
from limitmason.geometry.rotation import quaternions, rotation_matrices
from limitmason.mechanics.joint_forces import joint_forces
from limitmason.mechanics.rigid_motion import structure_size

JOINT = lm.Joint(friction_angle_deg=30.0)
BROWSER = next((b for b in ("chromium", "chromium-browser", "google-chrome") if shutil.which(b)), None)


@pytest.fixture(scope="module")
def column():
    # a slender column rocks about its lowest edge: lambda = b / h
    wall = lm.build.column(width=0.2, depth=0.3, height=1.0, courses=4, joint=lm.Joint(60.0))
    return wall, lm.limit_analysis(wall, lm.Loads.horizontal(wall))


def held(scene):
    """Data of a page, its numbers decoded."""
    text = re.search(r'<script id="data" type="application/json">(.*?)</script>', scene.html, re.S).group(1)
    data = json.loads(text)
    for key in ("vertices", "normals", "owner", "lines", "line_owner", "centroids", "motion"):
        data[key] = np.frombuffer(base64.b64decode(data[key]), dtype="<f4")
    return data


def test_volume_of_the_triangles_is_the_volume_of_the_blocks(column):
    wall, _ = column
    data = held(lm.view(wall))
    corners = data["vertices"].reshape(-1, 3, 3).astype(float)
    owner = data["owner"].reshape(-1, 3)[:, 0].astype(int)
    tetrahedra = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    assert np.bincount(owner, tetrahedra) == pytest.approx(wall.volumes, rel=1e-4)
    # normals point out of the blocks: the same triangles turned the other way would have the opposite sign
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", normal, data["normals"].reshape(-1, 3, 3)[:, 0]) > 0).all()


def test_a_structure_at_map_coordinates_is_drawn_as_one_at_the_origin(column):
    wall, _ = column
    place = np.array([5e5, 5.3e6, 200.0])  # in single precision blocks of .2 m would lie on one point
    moved = wall.transformed(np.eye(3), place)
    answer = lm.limit_analysis(moved, lm.Loads.horizontal(moved))
    here, far = held(lm.view(wall, column[1])), held(lm.view(moved, answer))
    size = here["size"]
    assert far["size"] == pytest.approx(size, rel=1e-6)
    middle = np.array(here["centre"]) - far["centre"]
    for key in ("vertices", "lines", "centroids"):
        assert here[key].reshape(-1, 3) - far[key].reshape(-1, 3) == pytest.approx(
            np.broadcast_to(middle, (len(here[key]) // 3, 3)), abs=1e-6 * size
        )
    rows, there = (
        np.frombuffer(base64.b64decode(d["forces"]["rows"]), dtype="<f4").reshape(-1, 8) for d in (here, far)
    )
    assert rows[:, :3] - there[:, :3] == pytest.approx(np.broadcast_to(middle, (len(rows), 3)), abs=1e-5 * size)
    joints, others = (
        np.frombuffer(base64.b64decode(d["joints"]["corners"]), dtype="<f4").reshape(-1, 3) for d in (here, far)
    )
    assert joints - others == pytest.approx(np.broadcast_to(middle, joints.shape), abs=1e-6 * size)
    assert np.array(here["push"][:3]) - far["push"][:3] == pytest.approx(middle, abs=1e-6 * size)
    assert np.array(here["low"]) - far["low"] == pytest.approx(middle, abs=1e-6 * size)


def test_last_frame_of_a_mechanism_keeps_the_toe_in_place(column):
    wall, found = column
    data = held(lm.view(wall, found))
    frames = data["motion"].reshape(len(data["captions"]), wall.n_blocks, 6)
    assert np.abs(frames[0, :, :3]).max() < 1e-6
    assert data["start"] == len(frames) - 1  # it moves when the page opens
    shift, rotation = frames[-1, -1, :3], rotation_matrices(frames[-1:, -1, 3:])[0]
    # all blocks but the ground turn together about the toe
    toe = np.array([0.5 * 0.2 * np.sign(shift[0]), 0.0, 0.0])
    centroid = wall.centroids[-1] - [wall.centroids[-1][0], wall.centroids[-1][1], 0.0]
    assert centroid + shift == pytest.approx(toe + rotation @ (centroid - toe), abs=1e-4)


def test_a_block_whose_name_is_markup_stays_text():
    blocks = lm.build.column(width=0.2, depth=0.2, height=0.4, courses=2, joint=JOINT)
    name = "</script><b>"
    wall = lm.Assembly([*blocks.blocks[:-1], replace(blocks.blocks[-1], name=name)], blocks.interfaces)
    data = held(lm.view(wall, title="<b>&"))
    assert data["names"][-1] == name


HOSTILE = (
    "<!--<script>", "</script><script>alert(1)</script>", "<!--", "{{script}}", "{{data}}", "]]>", "a\u2028b",
    "\\u003c/script>", "<img src=x onerror=alert(2)>", "| a | b",
)


class _Elements(HTMLParser):
    """Elements of a page, and the text of its script elements by the rules of HTML."""

    def __init__(self, page):
        super().__init__()
        self.names, self.data = [], ""
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.names.append(tag)
        self.inside = dict(attrs).get("id") == "data"

    def handle_data(self, data):
        self.data += data if getattr(self, "inside", False) else ""

    def handle_endtag(self, tag):
        self.inside = False


@pytest.mark.parametrize("name", HOSTILE)
def test_no_name_of_a_block_or_a_joint_changes_the_page(name):
    def wall(block, joint):
        return lm.Assembly.from_polyhedra(
            [box((-1, -1, -1), (2, 2, 0)), box((0, 0, 0), (1, 1, 1))], joint=lm.Joint(30.0, name=joint), fixed=[0],
            names=["ground", block],
        )

    def page(block):
        structure = wall(block, block)
        found = lm.limit_analysis(structure, lm.Loads.horizontal(structure))
        return lm.view(structure, found, title=block).html, structure._repr_html_(), found._repr_html_()

    for hostile, plain in zip(page(name), page("pier"), strict=True):
        assert _Elements(hostile).names == _Elements(plain).names
    raw = re.search(r'<script id="data"[^>]*>(.*?)</script>', page(name)[0], re.S).group(1)
    assert "<" not in raw  # neither an end nor a comment, in which an end would not count
    assert json.loads(raw)["names"][1] == name
    (row,) = [markdown_line([name, "1"])]
    assert len(re.findall(r"(?<!\\)\|", row)) == 3
    assert not re.search(r"<[A-Za-z/!?]", row)
    assert "\n" not in row


def test_bad_settings_and_answers_of_other_structures_are_refused(column):
    wall, found = column
    with pytest.raises(InputError, match="frames"):
        lm.view(wall, found, frames=0)
    for wrong in ((np.nan, 0.0), (30.0,)):
        with pytest.raises(InputError, match="viewpoint_deg"):
            lm.view(wall, found, viewpoint_deg=wrong)
    other = lm.build.column(width=0.2, depth=0.3, height=1.0, courses=5, joint=JOINT)
    with pytest.raises(InputError, match="do not"):
        lm.view(other, found)
    with pytest.raises(InputError, match="scale"):
        lm.view(wall, (np.zeros((wall.n_blocks, 3)), np.eye(4)[[0] * wall.n_blocks]), scale=-1.0)


def test_a_capacity_curve_is_shown_as_it_moved(column):
    wall, _ = column
    curve = lm.pushover(wall, lm.Loads.horizontal(wall), to=0.02)
    data = held(lm.view(wall, curve, frames=3))
    frames = data["motion"].reshape(len(data["captions"]), wall.n_blocks, 6)
    assert frames[-1, -1, :3] == pytest.approx(curve.displacement_of(wall.n_blocks - 1)[-1], abs=1e-6)
    # the peak is one of them; by then a rigid column has hardly moved: the end is shown first. Lengths are in mm
    assert f"λ = {curve.peak.load:.4g} at {1e3 * curve.peak.displacement:.3g} mm" in data["captions"]
    assert data["start"] == len(data["captions"]) - 1


def test_modes_swing_one_after_the_other(column):
    wall, _ = column
    modes = lm.modes(wall, 2)
    data = held(lm.view(wall, modes))
    frames = data["motion"].reshape(2, 24, wall.n_blocks, 6)
    assert data["captions"][0] == f"mode 1, {modes.frequency[0]:.4g} Hz"
    for k in range(2):
        assert np.abs(frames[k, 0]).max() == 0.0
        # at a quarter of the swing the shape itself, its largest displacement a part of the structure's size
        corners = [m[:3] + np.cross(m[3:], b.vertices - c)
                   for m, b, c in zip(modes.shape[k], wall.blocks, wall.centroids, strict=True)]
        largest = max(float(np.linalg.norm(u, axis=1).max()) for u in corners)
        own = modes.shape[k] * 0.12 * structure_size(wall) / largest
        np.testing.assert_allclose(frames[k, 6], own, atol=1e-5)
        np.testing.assert_allclose(frames[k, 18], -frames[k, 6], atol=1e-6)
    other = lm.build.column(width=0.2, depth=0.3, height=1.0, courses=7, joint=lm.Joint(60.0))
    with pytest.raises(InputError, match="do not belong to the"):
        lm.view(other, modes)


def test_two_structures_stand_side_by_side_and_move_as_each_does_alone(column):
    wall, found = column
    low = lm.build.column(width=0.2, depth=0.3, height=0.6, courses=3, joint=lm.Joint(60.0))
    below = lm.limit_analysis(low, lm.Loads.horizontal(low))
    data = held(lm.view([wall, low], [found, below]))
    n = wall.n_blocks
    frames = data["motion"].reshape(len(data["captions"]), n + low.n_blocks, 6)
    for model, answer, mine in ((wall, found, slice(None, n)), (low, below, slice(n, None))):
        alone = held(lm.view(model, answer))
        poses = alone["motion"].reshape(len(alone["captions"]), model.n_blocks, 6)
        np.testing.assert_allclose(frames[-1, mine], poses[-1], atol=1e-6)
        assert data["names"][mine] == [f"{1 + (mine.start is not None)}: {name}" for name in alone["names"]]
    centres = data["centroids"].reshape(-1, 3)
    sides = [np.vstack([b.bounds for b in m.blocks]) for m in (wall, low)]
    axis = int(np.argmax(np.ptp(sides[0], axis=0)[:2]))
    width = [float(np.ptp(s[:, axis])) for s in sides]
    assert centres[n:, axis].min() - centres[:n, axis].max() > 0.5 * sum(width) - max(width)
    assert f"λ = {found.collapse_multiplier:.4g}" in lm.view([wall, low], [found, below]).html
    assert len(held(lm.view([wall, low]))["captions"]) == 1
    with pytest.raises(InputError, match="a list of answers, one for each"):
        lm.view([wall, low], found)
    with pytest.raises(InputError, match=r"model\[1\] must be an Assembly"):
        lm.view([wall, found], [None, None])


def test_a_history_is_seen_from_the_ground_that_carries_it(column):
    wall, _ = column
    shift, turn = np.zeros((2, 3, wall.n_blocks, 3))
    shift[:, :, 0] = np.array([0.0, 0.4, -0.2])[:, None]
    shift[2, -1, 0] += 0.01
    quaternion = np.array([quaternions(t) for t in turn])
    loads = {"multiplier": np.zeros(3)}
    history = SimpleNamespace(shift=shift, quaternion=quaternion, scalars=loads, status="finished")
    data = held(lm.view(wall, history))
    frames = data["motion"].reshape(3, wall.n_blocks, 6)
    assert np.abs(frames[:, :-1]).max() < 1e-6
    assert frames[2, -1, 0] == pytest.approx(0.01, abs=1e-7)
    assert data["captions"] == ["sample 0", "sample 1", "sample 2"]  # a load that is nought is not told


def test_a_joint_force_lies_at_its_centre_of_pressure_and_the_load_where_it_acts(column):
    wall, found = column
    data = held(lm.view(wall, found))
    rows = np.frombuffer(base64.b64decode(data["forces"]["rows"]), dtype="<f4").reshape(-1, 8)
    forces = joint_forces(wall, found)
    assert 0.5 * (rows[:, :3] + rows[:, 3:6]) == pytest.approx(forces.centre[forces.carries], abs=1e-6)
    assert rows[:, 6].max() == pytest.approx(1.0)
    assert data["push"][3:] == pytest.approx([1.0, 0.0, 0.0])
    assert data["push"][2] == pytest.approx(0.5)  # half the height of equal blocks


def _shot(page, fragment):
    """Red, green and blue of the scene as a browser shows it from the front."""
    picture = page.with_suffix(".png")
    subprocess.run(
        [BROWSER, "--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader", "--window-size=800,600", "--virtual-time-budget=3000",
         f"--screenshot={picture}", f"{page.as_uri()}#azimuth=-90&elevation=0&{fragment}"],
        check=True, capture_output=True, timeout=90,
    )
    return np.moveaxis(imread(picture)[60:520, 150:, :3], -1, 0)  # beside the legend


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no headless browser is installed")
def test_a_browser_draws_the_blocks_and_the_slider_moves_them(column, tmp_path):
    wall, found = column
    page = lm.view(wall, found).save(tmp_path / "scene.html")

    def pixels(fragment):
        red, green, blue = _shot(page, fragment)
        return (red > 1.15 * green) & (green > 1.15 * blue)  # the colour of blocks that move

    first, last = pixels("frame=0"), pixels("frame=24")
    assert 0.5 < last.sum() / first.sum() < 1.5  # as large as before
    across = [np.mean(np.nonzero(p)[1]) for p in (first, last)]
    top = [np.nonzero(p[: p.shape[0] // 2])[1].mean() for p in (first, last)]
    sign = np.sign(found.mechanism.twists[-1, 0])
    assert sign * (across[1] - across[0]) > 5  # pixels, towards the side to which the column falls
    assert sign * (top[1] - top[0]) > sign * (across[1] - across[0])  # the top more than the middle


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no headless browser is installed")
def test_half_a_millimetre_is_seen_at_a_scale_and_the_crack_is_marked(column, tmp_path):
    wall, _ = column
    shift, turn = np.zeros((2, wall.n_blocks, 3))
    shift[2:, 0] = 0.5e-3  # all above the first unit slides
    page = lm.view(wall, (shift, quaternions(turn))).save(tmp_path / "scene.html")

    def seen(fragment):
        red, green, blue = _shot(page, fragment)
        moved = (red > 1.15 * green) & (green > 1.15 * blue) & (red > 0.5)
        return np.nonzero(moved)[1].mean(), ((blue > 0.5) & (red < 0.2)).sum()

    (true, _), (large, marked), (_, without) = seen("scale=1"), seen("scale=100"), seen("scale=100&cracks=0")
    assert abs(large - true) > 10.0  # pixels; 0.05 m of about 1.3 in 600
    assert marked > without + 50


def test_a_scene_frames_what_has_fallen_and_marks_joints_that_open_by_a_hundredth_of_the_structure():
    wall = lm.build.column(width=0.4, depth=0.4, height=1.0, courses=2, joint=lm.Joint(33.0))
    shift = np.zeros((2, 3, 3))
    shift[1, 2] = 4.0, 0.0, -0.9
    fallen = SimpleNamespace(
        shift=shift, quaternion=np.tile([1.0, 0.0, 0.0, 0.0], (2, 3, 1)), status="finished", scalars={},
    )
    before, after = held(lm.view(wall)), held(lm.view(wall, fallen))
    window = 0.54 * after["size"]
    for k in range(3):
        place = wall.centroids[k] + shift[1, k]
        assert np.all(np.abs(place - after["centre"]) < window)
    assert np.abs(wall.centroids[2] + shift[1, 2] - before["centre"]).max() > 0.54 * before["size"]
    assert 0.0 < after["crack"] < 0.02, "not a tenth of the 4 m that one has fallen"


def test_a_scene_frames_the_ground_as_far_as_it_does_not_dwarf_the_wall():
    joint = lm.Joint(33.0)
    tall = held(lm.view(lm.build.wall(length=0.8, courses=5, unit=(0.4, 0.2, 0.2), joint=joint)))
    corners = tall["vertices"].reshape(-1, 3)
    seen = np.ptp(corners, axis=0)  # the base reaches beyond the wall and below it: all of it is in the window
    assert np.linalg.norm(seen) == pytest.approx(tall["size"])
    assert tall["centre"] == pytest.approx(0.5 * (corners.min(axis=0) + corners.max(axis=0)))
    squares = [[(-20, -9), (20, -9), (20, 0), (-20, 0)], [(0, 0), (1, 0), (1, 2), (0, 2)]]
    wide = lm.Assembly.from_polygons(squares, thickness=1.0, joint=joint, fixed=[0])
    assert held(lm.view(wide))["size"] == pytest.approx(np.linalg.norm([1 + 2 * 0.5, 1.0, 2 + 0.5]))


def test_a_support_that_gives_way_is_shown_by_its_reaction():
    blocks = [box((0, 0, 0), (1, 1, 1)), box((2, 0, 0), (3, 1, 1)), box((0, 0, 1), (3, 1, 2))]
    beam = lm.Assembly.from_polyhedra(blocks, joint=JOINT, fixed=[0, 1])
    found = lm.settlement_analysis(beam, 1)
    page = lm.view(found.structure, found).html
    assert f"{found.method}: {found.answer} (solved)" in page
    assert "nan" not in page
