"""An example or page run as shipped, from another folder: its checks, its text and pictures beside what is stored."""

import runpy
import sys
from pathlib import Path

import page_blocks
import stored_output
from PIL import Image
from site_sources import STORED

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LONG = (
    "axles_on_an_arch",
    "bnw_zoned_walls",
    "brick_panel",
    "corner_walls_out_of_plane",
    "diagnose_brick_panels",
    "diagnose_ferris_tin_loi",
    "diagnose_minho",
    "diagnose_murano",
    "dilatancy_and_block_size",
    "ferris_tin_loi_walls",
    "four_point_bending",
    "minho_cracking_stone",
    "minho_pushover",
    "minho_shear_walls",
    "murano_pushover",
    "own_cause",
    "rocking_column",
    "rondelet_contact_points",
    "three_theories_one_wall",
    "tilt_test",
    "u_wall_as_a_solid",
    "vaults_and_domes",
)
"""Examples of four seconds of processor time and more, which the lane of the pages runs."""

LONG_PAGES = ("5_a_diagnosis", "6_an_arch_bridge", "7_modes")
"""The same of tutorials."""


def run_example(name, check, tmp_path, monkeypatch, capsys):
    """Run one, check the names that it leaves, and compare text and pictures with the gallery's."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [f"{name}.py"])
    scope = runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    printed = capsys.readouterr().out
    check(scope)
    for figure in tmp_path.glob("*.png"):
        assert figure.stat().st_size > 5_000, figure.name
    stale = f"the gallery shows something else: python docs/site/store_gallery.py {name}"
    kept = STORED / name
    assert {p.name for p in tmp_path.glob("*.png")} == {p.name for p in kept.glob("*.png")}, stale
    if not stored_output.made_here():
        return
    differs = stored_output.differences(printed, (kept / "output.txt").read_text(encoding="utf-8"), name)
    assert not differs, "\n".join([stale, *differs])
    for figure in sorted(tmp_path.glob("*.png")):
        unlike = stored_output.unlikeness(stored_output.reduced(figure), Image.open(kept / figure.name))
        assert unlike < stored_output.ALIKE, (figure.name, unlike, stale)


def run_page(page, tmp_path, monkeypatch):
    """Run the code of a page, and compare what it prints and draws with what the page shows."""
    text = page.read_text(encoding="utf-8")
    monkeypatch.setattr(sys, "path", list(sys.path))
    printed = page_blocks.run(text, tmp_path)
    for block, out in zip(page_blocks.blocks(text), printed, strict=True):
        assert out == (block.shown or ""), block.code
    for picture in page_blocks.pictures(text):
        assert (tmp_path / picture).stat().st_size > 5_000
        kept = page.parent / "images" / picture
        assert kept.stat().st_size > 2_000
        if stored_output.made_here():
            assert stored_output.unlikeness(Image.open(tmp_path / picture), Image.open(kept)) < stored_output.ALIKE
