"""An example run as shipped, from another folder: its checks, what it prints and draws beside what is stored."""

import runpy
import sys
from pathlib import Path

import stored_output
from PIL import Image
from site_sources import STORED

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LONG = (
    "bnw_zoned_walls",
    "brick_panel",
    "corner_walls_out_of_plane",
    "diagnose_minho",
    "diagnose_murano",
    "dilatancy_and_block_size",
    "ferris_tin_loi_walls",
    "four_point_bending",
    "minho_cracking_stone",
    "minho_pushover",
    "murano_pushover",
    "own_cause",
    "rondelet_contact_points",
    "three_theories_one_wall",
    "tilt_test",
    "vaults_and_domes",
)
"""Examples of four seconds of processor time and more, which the lane of the pages runs."""


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
