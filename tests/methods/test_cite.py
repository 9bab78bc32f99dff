"""What an answer tells a reader to cite: declared by each method and experiment at home, carried by every answer."""

import pickle
from itertools import combinations

import pytest
from walls import running_bond

import limitmason as lm
from limitmason import experiments
from limitmason.answers.references import DATA, PROGRAM, ROLES, SOLVER, THEORY, Citation, Cited, Reference
from limitmason.errors import InputError
from limitmason.experiments.source_folder import read_source
from limitmason.limit.papers import papers_behind
from limitmason.methods import METHODS, get_method


def declared():
    """Every reference that a method or an experiment declares."""
    from limitmason.continuum.papers import PAPERS as SOLID

    of_methods = [c.reference for name in METHODS for c in get_method(name).references]
    of_data = [paper for source in experiments.sources() for paper in read_source(source).papers]
    return [*of_methods, *(c.reference for c in SOLID), *of_data]


@pytest.mark.parametrize("name", METHODS)
def test_every_method_has_papers(name):
    method = get_method(name)
    assert method.references
    assert {c.role for c in method.references} <= set(ROLES)
    assert method.cite().references[-1].key == "limitmason"


@pytest.mark.parametrize("source", experiments.sources())
def test_every_experiment_has_papers(source):
    test = experiments.load(source, experiments.specimens(source)[0])
    assert read_source(source).papers
    assert {c.role for c in test.cite()} == {DATA, PROGRAM}


def test_a_key_names_one_reference_and_a_reference_has_one_key():
    for a, b in combinations(declared(), 2):
        assert (a.key == b.key) == (a == b)
        assert (a.title == b.title) == (a == b)
        assert not a.doi or a.doi != b.doi or a == b


@pytest.mark.parametrize("reference", dict.fromkeys(declared()), ids=lambda r: r.key)
def test_bibtex_can_be_read(reference):
    text = reference.bibtex
    assert text.startswith(f"@{reference.kind}{{{reference.key},\n")
    depth = 0
    for i, c in enumerate(text):
        depth += (c == "{") - (c == "}")
        assert depth >= 0
        assert (depth == 0) == (i < text.index("{") or i == len(text) - 1), "one entry, closed at its last character"
    fields = dict(line.strip().rstrip(",").split(" = ", 1) for line in text.splitlines()[1:-1])
    assert "title" in fields
    assert reference.title.replace("_", r"\_") in fields["title"]
    for name in fields.keys() - {"doi", "url"}:
        for special in "&%#_$":
            assert fields[name].count(special) == fields[name].count("\\" + special)


@pytest.mark.parametrize("pages", ["12-20", "12--20", "12–20"])
def test_a_range_of_pages_has_one_dash_of_tex(pages):
    assert "pages = {12--20}" in Reference("key", "article", "Title", pages=pages).bibtex


def test_an_answer_names_the_solver_that_ran_and_the_data_it_was_built_from():
    test = experiments.load("ferris-tin-loi-2001", "wall-1")
    wall, loads = test.assembly(), test.loads()
    by_solver = {
        name: lm.limit_analysis(wall, loads, solver=name).cite() for name in ("clarabel", "interior-point", "cvxpy")
    }
    found = {name: {c.reference.key for c in cited if c.role == SOLVER} for name, cited in by_solver.items()}
    assert found == {
        "clarabel": {"goulart2024"}, "interior-point": {"mehrotra1992", "nesterov1997"}, "cvxpy": {"diamond2016"},
    }
    cited = by_solver["clarabel"]
    assert {c.reference for c in cited if c.role == DATA} == set(read_source("ferris-tin-loi-2001").papers)
    assert {c.reference.key for c in cited if c.role == THEORY} == {"livesley1978", "radenkovic1961"}
    assert cited[-1].role == PROGRAM


def test_a_structure_of_ones_own_adds_no_data_and_a_search_names_its_own():
    wall = running_bond(3, 3)
    loads = lm.Loads.horizontal(wall)
    upper = lm.limit_analysis(wall, loads)
    lowest = lm.predict(wall, loads, "non-associative", search="quick")
    assert not [c for c in upper.cite() if c.role == DATA]
    assert {"ferris2001", "gilbert2006"} <= set(lowest.cite().keys) - set(upper.cite().keys)
    assert "sherali1990" in papers_keys(lowest) if lowest.details["proof"] else "sherali1990" not in papers_keys(lowest)


def papers_keys(prediction):
    return {c.reference.key for c in papers_behind(prediction)}


def test_what_to_cite_survives_a_copy_a_file_and_the_way_it_was_asked_for(tmp_path):
    test = experiments.load("ferris-tin-loi-2001", "wall-2")
    direct = lm.limit_analysis(test.assembly(), test.loads())
    assert lm.predict(test.assembly(), test.loads()).cite().keys == direct.cite().keys
    assert pickle.loads(pickle.dumps(direct)).cite().keys == direct.cite().keys
    lm.formats.write_prediction(tmp_path / "answer.json", direct)
    again = lm.formats.read_prediction(tmp_path / "answer.json")
    assert again.references == direct.references
    assert again.cite().bibtex == direct.cite().bibtex


def test_compared_methods_and_curves_name_theirs():
    test = experiments.load("ferris-tin-loi-2001", "wall-1")
    beside = lm.compare(test.assembly(), test.loads(), ("associative", "mechanisms"))
    assert {"livesley1978", "dayala2003", "ferris2001", "goulart2024"} <= set(beside.cite().keys)
    curve = experiments.load("minho-dry-stone-2005-2009", "SW.100.1").curve()
    assert "lourenco2005" in curve.cite().keys
    path = lm.pushover(test.assembly(), test.loads(), stiffness=1e9, to=2e-4)
    assert {"haslinger1983", "goulart2024", "ferris2001"} <= set(path.cite().keys)


def test_a_diagnosis_names_the_series_and_the_method_that_predicts():
    study = lm.diagnosis.Study.from_experiments("pavia")
    assert "restrepo2014" in [c.reference.key for c in study.about.references]
    study = lm.diagnosis.Study.from_experiments("minho")
    assert {"vasconcelos2009", "livesley1978"} <= {c.reference.key for c in study.about.references}


def test_two_references_with_one_key_are_refused():
    a, b = (Reference("same2000", "misc", title) for title in ("One", "Other"))
    with pytest.raises(InputError, match="same2000"):
        Citation([Cited(DATA, a), Cited(THEORY, b)])
    assert len(Citation([Cited(DATA, a), Cited(DATA, a), Cited(THEORY, a)])) == 2
    with pytest.raises(InputError, match="cited for"):
        Citation([Cited("gossip", a)])
    for wrong in (("two words", "misc", "t"), ("k", "blog", "t"), ("k", "misc", "")):
        with pytest.raises(InputError):
            Reference(*wrong)
