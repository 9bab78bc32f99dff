"""The user's own simulator: its errors keep type and traceback, and a parameter that it ignores is named."""

import inspect
import sys
import traceback
import warnings
from dataclasses import replace

import pytest

from limitmason import causes, cli
from limitmason.diagnosis import Cause, Measured, Noise, Observation, Study
from limitmason.diagnosis.simulate import collapse, several
from limitmason.diagnosis.simulator_calls import Job, Simulator
from limitmason.errors import InputError

SPECIMENS = [{"x": x} for x in (0.2, 0.3, 0.5, 0.7)]
BEND = Cause("bend", "bend", 0.0, (0.0, 1.0))


def deep_inside(x, bend):
    if bend > 0.4:
        raise LookupError("no stiffness for this bend")
    return 1.0 + x + bend


def failing(specimen, *, mu=0.7, bend=0.0):
    return mu * deep_inside(specimen["x"], bend)


def study(simulate, nuisance=None, **options):
    return Study(SPECIMENS, simulate, None, Noise(0.04), nuisance or {}, **options)


@pytest.mark.parametrize("n_jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_error_of_the_simulator_keeps_its_type_and_traceback_and_names_specimen_and_parameters(n_jobs):
    with pytest.raises(LookupError, match="no stiffness for this bend") as caught:
        study(failing, {"mu": Measured(0.7, 0.0)}, n_jobs=n_jobs).table(BEND)
    text = "".join(traceback.format_exception(caught.value))
    assert "deep_inside" in text  # the frame that failed
    assert 'raise LookupError("no stiffness for this bend")' in text
    assert "simulate failed for specimen" in text
    assert "mu=0.7, bend=" in text
    assert "{'x': 0." in text


def test_error_of_a_cause_names_cause_size_and_specimen():
    def apply(size, prediction, specimen):
        return prediction / (0.0 if size > 0.6 else 1.0)

    cause = Cause("reader", "reader", 0.0, (0.0, 1.0), acts_on="measurement", apply=apply)
    with pytest.raises(ZeroDivisionError) as caught:
        study(failing).table(cause)
    assert any("cause 'reader' of size 1 failed for specimen 0 ({'x': 0.2})" in n for n in caught.value.__notes__)


def test_a_keyword_that_is_taken_and_ignored_is_named():
    def ignoring(specimen, *, mu=0.7, bend=0.0):
        return 1.0 + specimen["x"]

    with pytest.warns(UserWarning, match="cause 'bend' changes no prediction .* from 0 to 1: .*'bend' and ignores it"):
        study(ignoring).table(BEND)
    with pytest.warns(UserWarning, match="measured input 'mu' changes no prediction .*'mu' and ignores it"):
        study(ignoring, {"mu": Measured(0.7, 0.03)}).baseline()


def test_a_parameter_that_one_specimen_feels_is_not_said_to_be_ignored():
    def felt(specimen, *, mu=0.7, bend=0.0):
        return 1.0 + (specimen["x"] > 0.6) * (bend + mu)

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        study(felt, {"mu": Measured(0.7, 0.03)}).table(BEND)


DATA = "specimen,measured,x\n-,-,m\na,1.2,0.2\nb,1.5,0.5\nc,1.7,0.7\nd,1.9,0.9\n"


@pytest.mark.parametrize("noise", [Noise(0.04), "replicates", "unknown"])
def test_degrees_of_freedom_beside_a_noise_that_has_its_own_or_none_are_refused(noise, tmp_path):
    path = tmp_path / "tests.csv"
    path.write_text(DATA)
    options = {"model": lambda specimen, bend=0.0: 1.0 + bend, "causes": [BEND], "covariates": ["x"]}
    with pytest.raises(InputError, match="dof"):
        Study.from_table(path, **options, noise=noise, dof=3.0)


MODEL = """
from limitmason.diagnosis import Cause

def inner(x):
    return {}["weight"]  # the line that fails

def simulate(specimen, bend=0.0):
    return inner(specimen["x"])

CAUSES = [Cause("bend", "bend", 0.0, (0.0, 1.0))]

def broken():
    raise ValueError("no list today")
"""


def diagnose(folder, capsys, name, model, *arguments):
    (folder / "data.csv").write_text(DATA)
    path = folder / f"{name}.py"
    path.write_text(model)
    command = ["diagnose", folder / "data.csv", "--model", f"{path}:simulate", "--out", folder / "out", *arguments]
    status = cli.main([str(c).replace("MODEL", str(path)) for c in command])
    return status, capsys.readouterr().err


def test_command_shows_the_traceback_of_the_users_function(tmp_path, capsys):
    status, err = diagnose(tmp_path, capsys, "own_one", MODEL, "--causes", "MODEL:CAUSES", "--noise", "0.04")
    assert status == 2
    for part in ("Traceback", 'own_one.py", line 5, in inner', "the line that fails", "KeyError: 'weight'",
                 "simulate failed for specimen 0 with no parameters"):
        assert part in err, part


@pytest.mark.parametrize(("line", "error"), [
    ("import numpyy_not_there", "ModuleNotFoundError"), ("size = 1 / 0", "ZeroDivisionError"),
])
def test_command_shows_the_traceback_of_a_module_that_fails_when_it_is_imported(line, error, tmp_path, capsys):
    name = f"own_{error.lower()}"
    status, err = diagnose(tmp_path, capsys, name, f"{line}\n{MODEL}", "--causes", "MODEL:CAUSES")
    assert status == 2
    assert error in err
    assert f'{name}.py", line 1' in err


def test_command_shows_the_traceback_of_a_function_of_causes(tmp_path, capsys):
    status, err = diagnose(tmp_path, capsys, "own_causes", MODEL, "--causes", "MODEL:broken")
    assert status == 2
    assert "in broken" in err
    assert "ValueError: no list today" in err


def test_a_module_that_is_not_there_is_one_line(tmp_path, capsys):
    (tmp_path / "data.csv").write_text(DATA)
    status = cli.main(["diagnose", str(tmp_path / "data.csv"), "--model", "no_such_module_here:simulate"])
    err = capsys.readouterr().err
    assert status == 2
    assert "Traceback" not in err
    assert "give module:name or file.py:name" in err


def test_a_file_that_is_called_as_another_module_is_not_taken_for_it(tmp_path, monkeypatch):
    from limitmason.cli.diagnosis import load_object

    monkeypatch.setattr(sys, "path", list(sys.path))
    path = tmp_path / "refused" / "json.py"  # imported long ago, from elsewhere
    path.parent.mkdir()
    path.write_text("def median(specimen):\n    return 1.0\n")
    with pytest.raises(InputError, match="another module is called json: give the file another name"):
        load_object(f"{path}:median", "--simulate")
    # else every process that starts from here on would take this file for json
    assert str(path.parent) not in sys.path
    own = tmp_path / "median_of_my_own.py"
    own.write_text(path.read_text())
    assert load_object(f"{own}:median", "--simulate")(None) == 1.0
    other = tmp_path / "other" / own.name
    other.parent.mkdir()
    other.write_text("def median(specimen):\n    return 2.0\n")
    assert [load_object(f"{f}:median", "--simulate")(None) for f in (other, own, other)] == [2.0, 1.0, 2.0]


def test_a_table_takes_empty_lists_at_their_word_and_refuses_what_its_model_does_not_use(tmp_path):
    path = tmp_path / "data.csv"
    path.write_text("specimen,measured,predicted,batch,x\n-,-,-,-,m\n"
                    "a,1.2,1.0,1,0.2\nb,1.5,1.1,2,0.5\nc,1.7,1.2,1,0.7\nd,1.9,1.4,2,0.9\n")
    made = Study.from_table(path, covariates=(), batches=(), causes="gain")
    assert (list(made.covariates), [c.name for c in made.causes]) == ([], ["gain"])
    assert not any(c.name.startswith("shift") for c in Study.from_table(path, batches=()).causes)
    for stated, message in (
        ({"levels": 0}, "levels must be"), ({"method": "dem"}, "^method is of a packaged series"),
        ({"settings": {"grid": 2}}, "^settings is of"), ({"spatial": True}, "^spatial is of"),
        ({"model": len, "predicted": "predicted", "causes": [BEND]}, "leave one of them out"),
        ({"model": len, "method": "dem", "causes": [BEND]}, "not of a function as the model"),
    ):
        with pytest.raises(InputError, match=message):
            Study.from_table(path, **stated)


def test_a_noise_to_plan_with_goes_before_the_one_that_is_stated():
    def bent(specimen, *, bend=0.0):
        return 1.0 + specimen["x"] * bend

    def seen_from(made, sd=None):
        """Smallest size of the cause that is seen."""
        return made.confusable(sd=sd).table()[0]["sizes"][0]

    planned = study(bent, causes=(BEND,))
    stated, own = seen_from(planned), seen_from(Study(SPECIMENS, bent, None, Noise(0.01), {}, causes=(BEND,)))
    assert seen_from(planned, 0.04) == stated
    assert own < 0.5 * stated
    assert seen_from(planned, 0.01) == pytest.approx(own, rel=0.1)  # tables of another noise have other nodes


def test_two_models_of_a_table_are_told_apart(tmp_path):
    (tmp_path / "t.csv").write_text(
        "specimen,measured,predicted,p-b,p b\n-,-,-,-,-\n" + "".join(f"{n},1,1,2,3\n" for n in "abcd"))
    with pytest.raises(InputError, match=r"columns 'p-b' and 'p b' differ by signs alone: rename one"):
        Study.from_table(tmp_path / "t.csv", towards=("p-b", "p b"), noise=0.05)  # both led to the last one


def test_what_a_ready_simulator_takes_is_what_it_passes_on():
    def build(specimen, /, friction=0.6, **more):
        raise AssertionError("nothing is built")

    taken = inspect.signature(collapse(build)).parameters
    assert {"friction", "torsion_limit", "parameters"} <= set(taken)  # "friction" was lost behind the slash
    # an option of a method goes to no builder: it was said to be taken
    assert list(inspect.signature(several(build, {"peak": "limit"})).parameters) == [
        "specimen", "extend", "friction", "parameters"]
    twist = causes.torsion_strength()
    bare = Study(SPECIMENS, several(lambda s: None, {"peak": "limit"}), None, Noise(0.04))
    with pytest.raises(InputError, match="simulate does not take the parameter 'torsion_limit'"):
        bare.table(twist)


def bent(specimen, *, mu=0.7, extend=None):
    """A model that a cause may extend."""
    return specimen["x"] * (extend(mu) if extend else mu)


def test_an_answer_on_disk_is_checked_by_the_study_that_takes_it(tmp_path):
    told = [{"x": x} for x in (-1.0, 1.0, 2.0, 3.0)]

    def drift(s):
        return s["x"]

    def asked(*quantities):
        rows = [Observation(i, q, 1.0, 0.1) for i in range(4) for q in quantities]
        return Study(told, drift, rows, cache=tmp_path / "kept.jsonl")

    assert asked("residual displacement").baseline() == pytest.approx([-1.0, 1.0, 2.0, 3.0])
    with pytest.raises(InputError, match=r"gave -1.0; a positive finite number is needed"):  # was NaN
        asked("peak").baseline()
    with pytest.raises(InputError, match=r"a mapping of peak, stiffness is needed"):  # was numpy's word on shapes
        asked("peak", "stiffness").baseline()


def test_columns_of_a_cause_are_given_as_a_list_or_as_one_name(tmp_path):
    """A list ended in a TypeError: tables and answers on disk go by causes."""
    told = [{"x": x, "batch": "a"} for x in (1.0, 2.0)]
    kept = []
    for _ in range(2):
        simulator = Simulator(bent, told, cache=tmp_path / "kept.jsonl")
        cause = replace(BEND, own=["batch"], apply=lambda mu, size: mu + size)
        kept.append(simulator.predict([Job(i, (), ((cause, 0.1),)) for i in range(2)]))
    assert simulator.calls == 0
    assert (kept[0] == kept[1]).all()
    assert replace(BEND, own="batch").own == cause.own == ("batch",)
