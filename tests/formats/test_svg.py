"""SVG drawings: areas and places against closed forms, layers, copies, transformations, and what is refused."""

import numpy as np
import pytest

import limitmason as lm
from limitmason.cli import main
from limitmason.errors import InputError
from limitmason.formats import read_svg
from limitmason.geometry import polygon_area_centroid

HEAD = (
    '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
    'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" viewBox="0 0 300 200" width="300mm">'
)


def read(folder, text, **options):
    path = folder / "mur-été.svg"  # a name beyond ASCII
    path.write_text(HEAD + text + "</svg>", encoding="utf-8")
    return read_svg(path, **{"scale": 0.01, **options})


def area(outline):
    return abs(polygon_area_centroid(outline)[0])


@pytest.mark.parametrize(
    "shape",
    [
        '<rect x="10" y="20" width="40" height="30"/>',
        '<polygon points="10,20 50,20 50,50 10,50"/>',
        '<path d="M10,20 H50 V50 H10 Z"/>',
        '<path d="m10 20 40 0 0 30-40 0z"/>',  # relative, repeated, a minus for a space
        '<path d="M1e1 20L50,2.e1 50 50L10 50 10 20"/>',  # ends where it begins
        '<g transform="translate(10 20) scale(2)"><rect width="20" height="15"/></g>',
        '<rect width="30" height="40" transform="translate(50,20) rotate(90)"/>',
        '<rect x="10" y="-50" width="40" height="30" transform="matrix(1 0 0 -1 0 0)"/>',
        '<polyline points="10,20 50,20 50,50"/><line x1="50" y1="50" x2="10" y2="50"/><path d="M10 50V20"/>',
        '<defs><rect id="s" width="40" height="30"/></defs><use href="#s" x="10" y="20"/>',
        '<symbol id="s"><rect width="40" height="30"/></symbol><use xlink:href="#s" transform="translate(10,20)"/>',
        '<svg x="10" y="20" width="40" height="30" viewBox="0 0 80 60"><rect width="80" height="60"/></svg>',
        '<svg x="10" y="20" width="40" height="30"><rect width="40" height="30"/></svg>',
        '<svg x="10" y="10%" width="40" height="15%" viewBox="0 0 4 3"><rect width="4" height="3"/></svg>',
        # a box of another shape: the smaller scale, in the middle, or as it says
        '<svg x="0" y="20" width="60" height="30" viewBox="5 5 80 60"><rect x="5" y="5" width="80" height="60"/></svg>',
        '<svg x="10" y="20" width="60" height="30" viewBox="0 0 8 6" preserveAspectRatio="xMinYMax">'
        '<rect width="8" height="6"/></svg>',
        '<svg x="10" y="20" width="40" height="30" viewBox="0 0 2 9" preserveAspectRatio="none">'
        '<rect width="2" height="9"/></svg>',
        '<svg viewBox="0 0 150 100"><rect x="5" y="10" width="20" height="15"/></svg>',  # as large as the drawing
        '<symbol id="s" viewBox="0 0 4 3"><rect width="4" height="3"/></symbol>'
        '<use href="#s" x="10" y="20" width="40" height="30"/>',
    ],
)
def test_every_way_to_draw_a_rectangle_gives_it_in_metres_and_upright(tmp_path, shape):
    ground = '<rect x="0" y="50" width="60" height="10"/>'
    found = read(tmp_path, f'<g id="stones">{shape}</g><g id="base">{ground}</g>')
    assert found.layers == ["stones", "base"]
    assert found.names == ["stones-1", "base-1"]
    stone = found.outlines[0]
    assert area(stone) == pytest.approx(0.4 * 0.3)
    assert [stone.min(axis=0), stone.max(axis=0)] == [pytest.approx([0.1, 0.1]), pytest.approx([0.5, 0.4])]


@pytest.mark.parametrize(
    ("shape", "exact"),
    [
        ('<circle cx="50" cy="50" r="40"/>', np.pi * 0.16),
        ('<ellipse cx="50" cy="50" rx="40" ry="20"/>', np.pi * 0.08),
        ('<path d="M10 50 A40 40 0 0 1 90 50 Z"/>', np.pi * 0.08),
        ('<path d="M10 50 a40 40 0 0180 0 z"/>', np.pi * 0.08),  # flags without spaces
        ('<path d="M10 50 A40 40 0 1 0 50 10 Z"/>', 0.16 * (0.75 * np.pi + 0.5)),  # three quarters and its chord
        ('<path d="M10 50 A40 20 30 0 1 90 50 A40 20 30 0 1 10 50Z"/>', None),  # radii too small: they grow
        ('<path d="M0 0 Q50 100 100 0 Z"/>', 2 / 3 * 1.0 * 0.5),  # parabola: two thirds of base times height
        ('<path d="M0 0 C0 60 100 60 100 0 Z"/>', 0.6 * 0.75 * 0.8),
        ('<path d="M0 0 Q25 50 50 0 T100 0 V-60 H0 Z"/>', 0.6),  # a wave: its halves cancel
        ('<path d="M0 0 C10 30 40 30 50 0 S90 -30 100 0 V-60 H0 Z"/>', 0.6),
    ],
)
def test_areas_within_curves_are_those_of_closed_forms(tmp_path, shape, exact):
    coarse, fine = (read(tmp_path, shape, flatness=f).outlines[0] for f in (1e-2, 1e-6))
    if exact is None:
        # an ellipse 2:1 turned by 30 degrees through both points: a = 2b, (cos^2/a^2 + sin^2/b^2) 0.4^2 = 1
        b2 = 0.16 * (0.75 / 4 + 0.25)
        exact = np.pi * 2.0 * b2
    assert area(fine) == pytest.approx(exact, rel=2e-5)
    assert area(coarse) == pytest.approx(exact, abs=1e-2 * 3.0)
    assert len(coarse) < len(fine)


def test_layers_are_those_of_inkscape_or_the_outermost_named_group(tmp_path):
    text = (
        '<g inkscape:groupmode="layer" inkscape:label="Stones" id="layer1">'
        '<g id="g12"><rect width="9" height="9"/></g></g>'
        '<g id="openings"><g id="g13"><circle r="3"/></g></g><rect x="20" width="9" height="9"/>'
        '<g style="display:none" id="photo"><rect width="99" height="99"/></g><text>no stone</text>'
    )
    found = read(tmp_path, text)
    assert found.layers == ["Stones", "openings", "drawing"]
    assert read(tmp_path, text, layers=["stones"]).names == ["Stones-1"]
    with pytest.raises(InputError, match="there is no layer 'walls'; there are Stones, drawing, openings"):
        read(tmp_path, text, layers=["walls"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no outline; draw every block"),
        ('<path d="M0 0 L10"/>', "path data 'M0 0 L10' cannot be read: an odd number of coordinates"),
        ('<path d="10 10 L0 0"/>', "does not begin with M"),
        ('<path d="L10 10 0 0"/>', "does not begin with M"),
        ('<path id="p7" d="M0 0 K3"/>', "path p7: path data cannot be read at 'K3'"),
        ('<path d="M0 0 5 5 9"/>', "path data 'M0 0 5 5 9' cannot be read"),
        ('<path d="M0 0 5 5z9"/>', "path data 'M0 0 5 5z9' cannot be read"),
        ('<path d="M0 0 A 4 4 0 2 0 9 9"/>', "path data 'M0 0 A 4 4 0 2 0 9 9' cannot be read"),
        ('<polygon id="p" points="0,0 1,1 2"/>', "polygon p: path data 'M0,0 1,1 2z' cannot be read"),
        ('<rect width="3mm" height="3"/>', "'3mm' has a unit of its own"),
        ('<rect width="3" height="3" transform="spin(3)"/>', r"transform spin\(3\) cannot be read"),
        ('<use href="#lost"/>', "a copy of '#lost', which is not in the drawing"),
        ('<use id="u" href="#u"/>', "nested more than 50 deep"),
        ('<path id="ring" d="M0 0h9v9h-9z M3 3v3h3v-3z"/>', "path ring: it has a hole"),
        ('<line x2="9"/>', "1 lines and no closed outline"),
    ],
)
@pytest.mark.filterwarnings("ignore::limitmason.model.plausibility.PlausibilityWarning")
def test_what_is_wrong_is_named(tmp_path, text, message):
    with pytest.raises(InputError, match=message):
        read(tmp_path, text)


def test_a_path_of_two_blocks_beside_each_other_is_two_outlines(tmp_path):
    assert len(read(tmp_path, '<path d="M0 0h9v9h-9z M9 3v3h3v-3z"/>').outlines) == 2


def test_the_scale_is_asked_for_with_the_size_of_what_is_drawn(tmp_path):
    with pytest.raises(InputError, match=r"measures 240 x 100 units, 300mm wide on paper; give scale="):
        read(tmp_path, '<rect x="7" width="240" height="100"/>', scale=None)
    for wrong in (0.0, -1.0, np.nan, True, "1"):
        with pytest.raises(InputError, match="scale must be positive"):
            read(tmp_path, '<rect width="240" height="100"/>', scale=wrong)
    for text, message in (("", "no element found"), ("<html></html>", "outermost element is 'html'")):
        (tmp_path / "no.svg").write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=message):
            read_svg(tmp_path / "no.svg", scale=1.0)


def test_a_block_from_an_svg_falls_as_the_closed_form_says(tmp_path, capsys):
    path = tmp_path / "bloc.svg"
    path.write_text(
        HEAD + '<g id="support"><rect y="100" width="200" height="10"/></g>'
        '<g id="stones"><rect x="80" y="20" width="40" height="80"/></g>'
        '<g id="windows"><rect x="90" y="40" width="9" height="9"/></g></svg>', encoding="utf-8",
    )
    drawing = ["--thickness", "0.4", "--friction", "45", "--scale", "0.01"]
    assert main(["solve", str(path), *drawing]) == 0
    assert "0.5000" in capsys.readouterr().out  # b / h
    assert main(["solve", str(path), *drawing[:4]]) == 2
    assert "give scale=" in capsys.readouterr().err
    model = lm.formats.model_of_drawing(path, joint=lm.Joint(45.0), thickness=0.4, scale=0.01)
    assert [b.name for b in model.assembly.blocks] == ["support-1", "stones-1"]
    assert model.assembly.fixed.tolist() == [True, False]


@pytest.mark.parametrize(
    "shape",
    [
        '<path id="p" d="M0 0 A 1e200 1e-200 0 0 1 1 1 L 0 1 Z"/>',
        '<polygon id="p" points="1e999,0 1,0 1,1"/>',
        '<polygon id="p" points="0,0 1,0 1,1" transform="scale(1e300)"/>',
        '<rect id="p" width="1e200" height="1e200"/>',
        '<g transform="scale(1e29)"><g transform="scale(1e29)"><rect id="p" width="1" height="1"/></g></g>',
    ],
)
def test_numbers_beyond_all_measure_are_refused_by_the_name_of_the_shape(tmp_path, shape):
    with pytest.raises(InputError, match=r"mur-été.svg: \w+ p"):
        read(tmp_path, shape)


@pytest.mark.parametrize("box", ["0 0 0 5", "0 0 5", "0 0 -1 1"])
def test_viewbox_without_a_size_is_refused(tmp_path, box):
    with pytest.raises(InputError, match="viewBox"):
        read(tmp_path, f'<svg viewBox="{box}"><rect width="1" height="1"/></svg>')


STONE = '<rect width="20" height="10"/>'


@pytest.mark.parametrize(("sheet", "hidden"), [
    (".a, .b{display: none !important}", '<g class="x b">' + STONE + "</g>"),
    ("/* .c{} */ #old { fill:#000 ; visibility : hidden }", '<g id="old">' + STONE + "</g>"),
    ("polygon.x{display:none}", '<polygon class="x" points="0,0 20,0 20,10 0,10"/>'),
    ("polygon{display:none}", '<polygon points="0,0 20,0 20,10 0,10"/>'),
    ("", '<g style="display: none ;">' + STONE + "</g>"),
])
def test_what_the_style_sheet_hides_is_no_block(tmp_path, sheet, hidden):
    found = read(tmp_path, f"<defs><style>{sheet}</style></defs>{hidden}{STONE}")
    assert [area(o) for o in found.outlines] == pytest.approx([0.02])
    shown = hidden.replace("<g ", '<g style="display:inline;visibility:visible" ', 1)
    if sheet and shown != hidden:  # the own style of an element goes before the sheet, but for what is important
        both = read(tmp_path, f"<style>{sheet.replace('!important', '')}</style>{shown}{STONE}")
        assert len(both.outlines) == 2


def test_what_says_visible_within_something_hidden_is_a_block(tmp_path):
    shown = STONE.replace("<rect ", '<rect visibility="visible" ')
    group = f'<g style="visibility: hidden">{STONE}<g>{shown}{STONE}</g></g>'
    assert [area(o) for o in read(tmp_path, group).outlines] == pytest.approx([0.02])
    with pytest.raises(InputError, match="no outline"):
        read(tmp_path, f'<g visibility="collapse">{STONE}</g>')


@pytest.mark.parametrize(("shape", "message"), [
    ('<rect id="p" width="2,5" height="1"/>', "rect p: '2,5' is not one number"),  # not a width of 2
    ('<circle id="p" r="1 2"/>', "circle p: '1 2' is not one number"),
    ('<rect id="p" width="2" height="1" style="transform: scale(2)"/>', "rect p: it is moved by its style"),
    ('<rect id="p" width="5rem" height="1"/>', "rect p: '5rem' has a unit of its own"),
    ('<rect id="p" width="5.mm" height="1"/>', "rect p: '5.mm' has a unit of its own"),
    ('<g id="p" transform="translate(5mm, 3)"/>', r"g p: transform translate\(5mm, 3\) has a unit of its own"),
    ('<g id="p" transform="rotate(0.5rad)"/>', r"g p: transform rotate\(0.5rad\) has a unit of its own"),
    ('<style>.big{transform:scale(2)}</style><g id="p" class="big"/>', "g p: it is moved by its style"),
])
def test_what_would_be_drawn_in_another_size_is_refused(tmp_path, shape, message):
    with pytest.raises(InputError, match=message):
        read(tmp_path, shape)


@pytest.mark.parametrize("options, message", [
    ({"gap": -1.0}, "gap must not be negative, got -1.0"), ({"gap": "1mm"}, "gap must be a finite number, got '1mm'"),
    ({"flatness": float("nan")}, "flatness must be a finite number"), ({"flatness": -1.0}, "flatness must not be neg"),
])
def test_lengths_of_a_reader_are_numbers(tmp_path, options, message):
    (tmp_path / "a.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><circle cx="5" cy="5" r="3"/></svg>')
    with pytest.raises(ValueError, match=message):
        read_svg(tmp_path / "a.svg", scale=1.0, **options)


def test_mortar_of_nothing_is_refused_by_its_name(tmp_path):
    (tmp_path / "a.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><circle cx="5" cy="5" r="3"/></svg>')
    with pytest.raises(ValueError, match=r"mortar must be positive \[m\], got 0"):
        lm.formats.read_drawing(tmp_path / "a.svg", scale=1.0, mortar=0)
    with pytest.raises(ValueError, match=r"fixed must be a list of block names or numbers: for none"):
        lm.formats.model_of_drawing(tmp_path / "a.svg", scale=1.0, thickness=1.0, joint=lm.Joint(30.0), fixed=None)


@pytest.mark.parametrize("nothing", [
    '<polygon points=""/>', '<line x1="3" y1="3" x2="3" y2="3"/>', '<path d="M3 3L3 3"/>',
    '<use x="50"/>',  # a copy of nothing, not of what has no id
])
def test_what_has_no_length_draws_nothing(tmp_path, nothing):
    assert [area(o) for o in read(tmp_path, nothing + STONE).outlines] == pytest.approx([0.02])


def test_curves_without_flatness_have_the_most_chords(tmp_path):
    found = read(tmp_path, '<path d="M0 0C0 10 10 10 10 0z"/>', flatness=0.0)
    assert area(found.outlines[0]) == pytest.approx(60e-4, rel=1e-6)  # of the closed form, in cm
