"""A folder of files as a study: what it holds, what is planted in its example, and the command that takes it."""

import shutil

import pytest

from limitmason.cli import main
from limitmason.diagnosis import Cause, Study
from limitmason.diagnosis.study_from_folder import write_folder
from limitmason.errors import InputError


def test_a_folder_of_files_becomes_a_study_and_the_example_says_what_was_planted(tmp_path):
    folder = write_folder(tmp_path / "data")
    made = Study.from_folder(folder, shared=())
    assert (made.n, made.rows.kinds.count("deformation")) == (35, 11)  # one cell is blank
    assert made.rows.high is None
    assert {c.name for c in made.causes} == {"gain", "shift of batch B"}
    found = made.diagnose()
    assert (found.causes, found.identified) == (("gain",), True)
    assert found.estimates["gain"].low < 1.2 < found.estimates["gain"].high
    record = found.record()
    assert [k["kind"] for k in record["by kind"]] == ["force", "deformation", "vibration"]
    for name in ("specimens.csv", "measured.csv", "predicted.csv"):
        lines = [line for line in (folder / name).read_text().splitlines() if line.strip()]
        (tmp_path / name).write_text("\n".join([x for x in lines if "stack" not in x or x.startswith("stack 1,")]))
    shutil.copy(folder / "quantities.csv", tmp_path)
    one = Study.from_folder(tmp_path, shared=()).diagnose()  # what is peculiar to it changes force and stiffness alike
    assert (one.kind, one.identified) == ("behaves like", False)
    assert "one specimen alone was tested" in one.record()["headline"]
    (folder / "predicted.csv").unlink()
    with pytest.raises(InputError, match="lacks predicted.csv"):
        Study.from_folder(folder)
    ones = dict.fromkeys(("peak", "stiffness", "frequency 1"), 1.0)
    (folder / "curve.csv").write_text("specimen,load,displacement\n")
    with pytest.warns(UserWarning, match="not read: curve.csv; a folder holds specimens.csv"):
        Study.from_folder(folder, model=lambda s: ones)
    (folder / "curve.csv").unlink()
    soft = Cause("soft joints", "soft", 1.0, (0.4, 2.0), "joints softer than stated")
    other = Study.from_folder(folder, model=lambda s: ones, causes=[soft])
    assert other.baseline() == pytest.approx(1.0)
    text = (folder / "measured.csv").read_text()
    cell = f"{made.measured[0]:.4g}"
    (folder / "measured.csv").write_text(text.replace(cell, f"> {cell}", 1))
    assert Study.from_folder(folder, model=lambda s: ones).rows.high[0] == float(cell)
    text = (folder / "quantities.csv").read_text()
    (folder / "quantities.csv").write_text(text.replace("stiffness", "strength"))
    with pytest.raises(InputError, match="no column 'strength'"):
        Study.from_folder(folder, model=lambda s: ones)


def test_of_twelve_specimens_one_may_be_measured_so_far(tmp_path):
    """Groups that nobody gave were refused: "groups has the one label 0 ... or leave groups out"."""
    folder = write_folder(tmp_path / "data")
    lines = (folder / "measured.csv").read_text().splitlines()
    (folder / "measured.csv").write_text("\n".join([x for x in lines if "stack" not in x or x.startswith("stack 1,")]))
    made = Study.from_folder(folder)
    assert (made.n, made.groups) == (3, None)


@pytest.mark.slow
def test_the_command_takes_a_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["diagnose", "--template", "data"]) == 0
    assert main(["diagnose", "data", "--out", "out", "--no-checks", "--shared", "batch"]) == 0
    assert "identified by force and deformation" in (tmp_path / "out" / "report.txt").read_text()
    assert main(["diagnose", "data", "--noise", "0.1"]) == 2
    assert "with a folder" in capsys.readouterr().err
