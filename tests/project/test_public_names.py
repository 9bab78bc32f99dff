"""Public names: what the README names is there without an import of its own, and no module offers its own imports."""

import ast
import importlib
import inspect
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import limitmason as lm


def test_catalogue_of_causes_is_there_without_an_import_of_its_own():
    code = "import limitmason as lm; print(lm.causes.gain().name)"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out == "gain\n"


def test_type_checkers_see_every_module_and_name():
    tree = ast.parse(Path(lm.__file__).read_text(encoding="utf-8"))
    block = next(n for n in tree.body if isinstance(n, ast.If))
    seen = {a.name for n in block.body if isinstance(n, ast.ImportFrom) for a in n.names}
    assert seen == {*lm._MODULES, *lm._NAMES}


@pytest.mark.parametrize("name", lm._MODULES)
def test_public_modules_list_their_own_names_and_not_what_they_import(name):
    module = getattr(lm, name)
    assert not {"np", "NDArray", "Array", "Index", "Any", "Mapping"} & set(module.__all__)
    assert all(hasattr(module, n) for n in module.__all__)


def test_figures_offer_functions_alone_and_no_file_is_called_like_one():
    # `lm.figures.comparison(r)` was a module, "mechanism" a function here and a module there
    figures = lm.figures
    assert dir(figures) == sorted(figures.__all__)
    assert not [n for n in figures.__all__ if inspect.ismodule(getattr(figures, n))]
    with pytest.raises(AttributeError, match="comparison"):
        figures.comparison  # noqa: B018
    assert not {m.name for m in pkgutil.iter_modules(figures.__path__)} & set(figures.__all__)
    assert importlib.import_module("limitmason.figures.comparison")  # imports of files are as they were


def test_what_draws_takes_the_model_first_then_what_is_shown_then_the_file():
    order = ("model", "modes", "mac", "history", "prediction", "what", "report", "state", "values", "number", "path")
    for name in lm.figures.__all__:
        function = getattr(lm.figures, name)
        if inspect.isfunction(function):
            given = [p.name for p in inspect.signature(function).parameters.values() if p.kind is not p.KEYWORD_ONLY]
            known = [order.index(n) for n in given if n in order]
            assert known == sorted(known), (name, given)


def signatures(module):
    """Signatures of the public functions and classes of a module, and of their public methods, by name."""
    for name in module.__all__:
        thing = getattr(module, name)
        if inspect.isfunction(thing):
            yield name, inspect.signature(thing)
        if inspect.isclass(thing):
            for key, value in vars(thing).items():
                plain = value.__func__ if isinstance(value, (classmethod, staticmethod)) else value
                if inspect.isfunction(plain) and (key == "__init__" or not key.startswith("_")):
                    yield f"{name}.{key}", inspect.signature(plain)


ROOMS = ("model", "build", "answers", "mechanics", "vibration", "continuum", "study", "formats", "figures")


@pytest.mark.parametrize("name", ["limitmason", *(f"limitmason.{room}" for room in ROOMS), "dem", "mechanisms"])
def test_help_prints_short_names_of_arrays(name):
    module = importlib.import_module(name)
    expanded = [where for where, signature in signatures(module) if "numpy" in str(signature)]
    assert not expanded, "from __future__ import annotations keeps ArrayLike and Array as they are written"
