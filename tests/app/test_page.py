"""The page in headless Chromium: open, change the friction, solve, see the number; a wrong input shows its error."""

import json

import pytest
from application import served
from browser import CHROMIUM, Browser

import limitmason as lm

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine: apt-get install chromium"),
]
DRAWN = "document.querySelector('#stage img')"
SOLVE = "document.getElementById('solve').click()"


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    with served(tmp_path_factory.mktemp("page")) as client:
        yield client.server.url


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    opened = Browser(tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()


@pytest.fixture
def page(browser, address):
    browser.open("about:blank")
    browser.open(address)
    browser.until(DRAWN)
    yield browser
    browser.run("sessionStorage.clear()")


def shown(page):
    """The number in large letters."""
    return float(page.until("document.querySelector('#answer:not(.stale) .number')?.textContent"))


def test_open_change_the_friction_solve_and_see_the_number_of_the_call(page):
    page.run(SOLVE)
    joint = lm.Joint(33.0)
    window = [lm.build.Opening(x=0.8, z=0.6, width=0.8, height=0.8, lintel=0.2)]

    def expected(joint):
        wall = lm.build.wall(length=2.4, courses=9, unit=(0.4, 0.2, 0.2), joint=joint, openings=window)
        return lm.limit_analysis(wall, lm.Loads.horizontal(wall)).collapse_multiplier

    assert shown(page) == pytest.approx(expected(joint), rel=1e-5)
    page.type("[id='joint.friction_angle_deg']", "22")
    page.until("document.querySelector('#answer.stale')")  # the old number is not taken for the new one's
    page.run(SOLVE)
    assert shown(page) == pytest.approx(expected(lm.Joint(22.0)), rel=1e-5)
    assert "friction_angle_deg=22" in page.until("document.getElementById('script').textContent")
    tabs = page.run("[...document.querySelectorAll('#tabs button')].map(b => b.textContent)")
    assert tabs == ["Mechanism", "Forces", "Turn it", "Structure", "Text"]
    assert page.until("(i => i.complete && i.naturalWidth)(document.querySelector('#stage img'))") > 500
    page.run("[...document.querySelectorAll('#downloads button')].find(b => b.textContent === 'Make a report').click()")
    page.until("document.querySelector('iframe[src*=report]')")
    assert "Mechanism" in page.run("document.getElementById('tabs').innerText")
    assert page.run("document.querySelectorAll('#downloads a').length") == 4


def test_a_page_that_is_loaded_again_goes_on_where_it_was(page, address):
    page.type("[id='joint.friction_angle_deg']", "17")
    page.type("#structure-kind", "column")
    page.type("[id='structure.courses']", "5")
    page.run(SOLVE)
    number = shown(page)
    assert number == pytest.approx(0.3057, rel=1e-3)  # tan(17 degrees): it slides
    page.open(address)
    page.until("document.querySelector('#stage img') && document.getElementById('structure.courses').value === '5'")
    assert page.run("document.getElementById('joint.friction_angle_deg').value") == "17"
    assert shown(page) == number


def test_no_job_is_taken_for_done_before_the_server_has_told_of_one(page):
    # what a page hears first, when it was quick to ask for a drawing
    assert page.run("(() => { mine.add(1e9); state({}); return mine.delete(1e9) })()")


def test_a_wrong_input_shows_its_named_error_at_its_field_and_goes_when_it_is_mended(page):
    page.type("[id='joint.friction_angle_deg']", "95")
    words = page.until("document.getElementById('joint.friction_angle_deg!').textContent")
    with pytest.raises(lm.errors.InputError) as refused:
        lm.Joint(friction_angle_deg=95)
    assert words == str(refused.value)
    assert page.run("document.getElementById('problem-name').textContent") == "InputError"
    page.type("[id='joint.friction_angle_deg']", "33")
    page.until("document.getElementById('joint.friction_angle_deg!').textContent === ''")
    page.type("[id='structure.length']", "-2.4")
    assert "length must be positive" in page.until("document.getElementById('structure.length!').textContent")


def test_every_field_of_numbers_shows_its_unit(page):
    without = page.run(
        "[...document.querySelectorAll('.field')].filter(r => r.querySelector('input')?.inputMode === 'decimal' "
        "&& !r.querySelector('.unit').textContent).map(r => r.dataset.name)"
    )
    assert without == []


def test_a_hostile_name_is_shown_as_text(page, tmp_path):
    name = "<img src=x onerror=\"document.title='hacked'\">"
    outlines = [[(0, 0), (1, 0), (1, 0.2), (0, 0.2)], [(0, 0.2), (1, 0.2), (1, 0.6), (0, 0.6)]]
    wall = lm.Assembly.from_polygons(outlines, thickness=0.2, joint=lm.Joint(33.0), fixed=[0], names=["base", name])
    path = tmp_path / "hostile.json"
    lm.formats.write_json(path, wall, lm.Loads.horizontal(wall))
    page.type("#structure-kind", "file")
    page.until("document.getElementById('upload')")
    text = json.dumps(path.read_text())
    page.run(
        f"(() => {{ const t = new DataTransfer(); t.items.add(new File([{text}], 'hostile.json')); "
        "const u = document.getElementById('upload'); u.files = t.files; u.dispatchEvent(new Event('change')); })()"
    )
    page.until("document.getElementById('file').value === 'hostile.json'")
    page.until("[...document.querySelectorAll('#blocks option')].some(o => o.value.includes('onerror'))")
    page.run(SOLVE)
    assert shown(page) == pytest.approx(0.6494, rel=1e-3)  # tan(33 degrees): it slides
    page.run("[...document.querySelectorAll('#tabs button')].find(b => b.textContent === 'Text').click()")
    assert page.run("document.title") == "limitmason"
    assert page.run("document.querySelectorAll('img[onerror]').length") == 0


def test_the_page_fits_a_telephone(page):
    page.size(390, 844, mobile=True)
    try:
        assert page.until("document.documentElement.scrollWidth") <= 390
    finally:
        page.size(1300, 900)
