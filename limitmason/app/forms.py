"""Forms of the application, read from the signatures and docstrings of the public calls that they stand for."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any

import limitmason as lm
from limitmason.experiments import registry
from limitmason.methods import COMPARED_METHODS, available_methods

# how docstrings write units and words to choose from
_UNIT = re.compile(r"\[(m|deg|rad|kg|kg/m3|N|N/m3|Pa|Pa/m|J/m2|s|%|-)\]")
_QUOTED = re.compile(r'"([^"]+)"')


@dataclass(frozen=True)
class Field:
    """One argument of a call as a field of a form.

    Parameters
    ----------
    name : of the argument
    kind : "number", "numbers" (with commas), "word", "words" (with commas), "list" (the same, never one word alone),
        "lines" or "tick"
    unit : shown beside it; empty for words
    hint : what the docstring says of it
    value : that the form begins with; empty leaves the argument out
    default : what the call then takes
    choices : words to choose from; none where any word may stand
    first : whether it is shown at once; others are under "more"
    alone : of "numbers", whether one that is no whole number may stand there too: 1,5 is then no pair
    """

    name: str
    kind: str
    unit: str = ""
    hint: str = ""
    value: Any = ""
    default: str = ""
    choices: tuple[str, ...] = ()
    first: bool = False
    alone: bool = False


@dataclass(frozen=True)
class Call:
    """A public call with its form.

    Parameters
    ----------
    target : what it is assigned to and its name, such as "wall = lm.build.wall"
    title : what the page calls it
    fields : of the form
    before, after : source of arguments that the session gives, before and behind those of the form
    """

    target: str
    title: str
    fields: tuple[Field, ...] = ()
    before: tuple[str, ...] = ()
    after: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """What the page gets of it."""
        return {"title": self.title, "fields": [asdict(f) for f in self.fields]}


# every call by its name: title, and what the fields that are shown at once begin with, by argument
_BUILDERS: dict[str, tuple[str, dict[str, Any]]] = {
    "wall": ("Wall", {"length": "2.4", "courses": "9", "unit": "0.4, 0.2, 0.2", "density": "2000", "bond": ""}),
    "layout": ("Wall, row by row", {
        "rows": "1 1 1 1\n0.5 1 1 1 0.5\n1 -2 1\n0.5 -3 0.5\n0.25 3.5 0.25", "unit": "0.4, 0.2, 0.2",
        "density": "2000"}),
    "arch": ("Arch", {"radius": "2", "angle_deg": "180", "thickness": "0.4", "width": "1", "voussoirs": "21",
                      "pier_height": "", "pier_width": "", "density": "2000"}),
    "column": ("Column", {"width": "0.4", "depth": "0.4", "unit_height": "0.2", "courses": "8", "density": "2000"}),
    "dome": ("Dome", {"radius": "2", "thickness": "0.3", "courses": "5", "lunes": "12", "opening_deg": "20",
                      "density": "2000"}),
    "vault": ("Vault", {"shape": "barrel", "radius": "1.5", "length": "2", "thickness": "0.3", "voussoirs": "9",
                        "unit_length": "0.5", "density": "2000"}),
}
_JOINT = {"friction_angle_deg": "33", "dilatancy_angle_deg": "0", "cohesion": "0", "tensile_strength": "0"}
_BASE_LOADS: dict[str, tuple[str, dict[str, Any]]] = {
    "horizontal": ("Sideways: weight times λ", {"direction": "1, 0, 0"}),
    "weight": ("Own weight alone, dead load", {}),
}
_MORE_LOADS: dict[str, tuple[str, dict[str, Any]]] = {
    "with_point_load": ("Point load", {"block": "", "force": "0, 0, -1000", "at": "", "case": "dead"}),
    "with_pressure": ("Pressure on a face", {"block": "", "pressure": "1000", "face": "top", "case": "dead"}),
    "with_body_force": ("Weight of blocks sideways", {"direction": "0, 1, 0", "blocks": "", "case": "live"}),
    "with_precompression": ("Precompression of a beam", {"force": "10000", "block": "beam"}),
}
_ANALYSES: dict[str, tuple[str, dict[str, Any]]] = {
    "limit_analysis": ("Collapse multiplier", {"flow_rule": "associative", "contact_model": "", "grid": ""}),
    "pushover": ("Capacity curve", {"to": "", "stiffness": "", "blocks": "rigid"}),
    "stability": ("Can it stand, and how well", {"tilts": "+x, -x, +y, -y"}),
    "compare": ("Theories side by side", {"methods": ", ".join(COMPARED_METHODS)}),
}
_DRAWING = {"thickness": "0.2", "scale": "", "mortar": "", "gap": "", "density": "2000", "fixed": "", "tilt": "x"}
_CHOICES = {  # where the words in quotes of a docstring are not all, or not only, what may be chosen
    "plan": ("straight", "L", "T", "U", "box"), "corner": ("left", "right"), "base": ("slab", "course", "none"),
    "beam_over": ("facade", "returns", "all"), "column": ("left", "right"), "case": ("dead", "live"),
    "methods": tuple(dict.fromkeys((*COMPARED_METHODS, *sorted(available_methods())))),
}
_OPENING = {"x": "0.8", "z": "0.6", "width": "0.8", "height": "0.8", "lintel": "0.2"}


@cache
def calls() -> dict[str, dict[str, Call]]:
    """All calls by the part of the form they belong to, and by name."""
    # what the script calls the joint and the structure
    joint, wall = ("joint=joint",), ("wall",)
    drawing = _fields(lm.formats.model_of_drawing, _DRAWING)
    analyses = _group("answer = lm", lm, _ANALYSES, ("wall", "loads"), whole=True)
    # whether it can stand is asked of dead loads alone
    analyses["stability"] = replace(analyses["stability"], before=("wall", "loads.scaled(live=0.0)"))
    return {
        "joint": {"Joint": Call("joint = lm.Joint", "Joint", _fields(lm.Joint, _JOINT))},
        "structure": _group("wall = lm.build", lm.build, _BUILDERS, after=joint),
        "opening": {"Opening": Call("lm.build.Opening", "Opening", _fields(lm.build.Opening, _OPENING))},
        "drawing": {"drawing": Call("drawing = lm.formats.model_of_drawing", "Drawing", drawing, after=joint)},
        "loads": _group("loads = lm.Loads", lm.Loads, _BASE_LOADS, wall),
        "more": _group("loads = loads", lm.Loads, _MORE_LOADS, wall),
        "analysis": analyses,
    }


def _group(
    target: str, home: Any, table: dict[str, tuple[str, dict[str, Any]]], before: tuple[str, ...] = (),
    after: tuple[str, ...] = (), *, whole: bool = False,
) -> dict[str, Call]:
    """Calls of one home by name, from their titles and what their forms begin with.

    Parameters
    ----------
    target : name of the home in a script, with what is assigned
    home : the module or class that has the calls
    table : title and first fields of every call
    before, after : source of arguments that the script gives besides
    whole : whether the forms have no other fields
    """
    return {
        name: Call(f"{target}.{name}", title, _fields(getattr(home, name), start, whole=whole), before, after)
        for name, (title, start) in table.items()
    }


def experiment_fields(source: str, specimen: str) -> tuple[Field, ...]:
    """Options of a packaged experiment, by its source and specimen, as fields."""
    table = registry.load(source, specimen).option_table
    out = []
    for name, option in table.items():
        # without a default it is a number too: words have one, or choices
        number = not (isinstance(option.default, str) or option.choices)
        tick = any(choice is True for choice in option.choices)  # 1 equals True too
        out.append(Field(
            name, "tick" if tick else "number" if number else "word", option.unit if number else "", option.meaning,
            default=str(option.default), choices=() if tick else tuple(map(str, option.choices)), first=True,
        ))
    return tuple(out)


def _fields(function: Callable[..., Any], start: dict[str, Any], *, whole: bool = False) -> tuple[Field, ...]:
    """Fields of a function or class, one for every argument that a form can hold.

    Those to begin with come first, in their order.

    Parameters
    ----------
    start : values of the fields to begin with, by name
    whole : whether there are no others
    """
    # a class has the signature of its __init__, whose self has no field
    made = getattr(function, "__init__", function) if inspect.isclass(function) else function
    parameters = inspect.signature(made).parameters
    told = _documented(function.__doc__ or "")
    # "as in `wall`": a builder does not say again what another one says
    elsewhere = [_documented(f.__doc__ or "") for f in (lm.build.wall, lm.build.arch, lm.formats.read_drawing)]
    names = [*start, *(n for n in parameters if n not in start and not whole)]
    out = []
    for name in names:
        annotation = parameters[name].annotation
        if not isinstance(annotation, str):  # of a module without postponed annotations
            annotation = getattr(annotation, "__name__", "") or str(annotation)
        kind = _kind(name, annotation)
        if not kind:
            continue
        hint, unit = told.get(name, ("", ""))
        if annotation in ("int", "int | None"):  # a count
            unit = "-"
        elif not unit and kind.startswith("number"):
            more, unit = next((t[name] for t in elsewhere if name in t), ("", ""))
            hint = f"{hint} {more}".strip()
        default = parameters[name].default
        words = kind in ("word", "words", "list", "lines")
        found = tuple(dict.fromkeys(_QUOTED.findall(hint))) if words and kind != "lines" else ()
        choices = _CHOICES.get(name, found)
        out.append(Field(
            name=name, kind=kind, unit="" if words or kind == "tick" else unit or "-", hint=hint,
            value=start.get(name, ""), default=_shown(default), choices=choices, first=name in start,
            alone=kind == "numbers" and annotation.replace(" ", "").startswith("float|"),
        ))
    return tuple(out)


def _kind(name: str, annotation: str) -> str:
    """Kind of the field of an argument, by its name and annotation.

    It is empty where a form cannot hold the argument. The first that fits counts: a text in a tuple before a
    tuple of numbers, a row of stones before a text.
    """
    # what the session gives itself, and what it has no use for
    if name in ("self", "wall", "assembly", "loads", "name", "joint", "path", "tolerance"):
        return ""
    plain = annotation.replace(" ", "")
    if "Joint" in plain or plain.startswith("Mapping") or "Opening" in plain or "Steps" in plain:
        return ""
    if "Row" in plain:
        return "lines"
    if plain == "bool":
        return "tick"
    if plain.endswith("Sequence[str]|str"):  # a word alone may mean something else than a list of it
        return "words"
    if "Sequence[str]" in plain or "Iterable[int|str]" in plain:
        return "list"
    if "tuple[str" in plain:
        return "words"
    if plain in ("LostBy", "Unloading", "int|str") or plain.startswith("str"):
        return "word"
    if any(t in plain for t in ("tuple[", "ArrayLike", "Sequence[float]")):
        return "numbers"
    return "number" if plain.startswith(("float", "int")) else ""


def _shown(default: Any) -> str:
    """A default as the placeholder of its field; none and empty ones leave it empty."""
    return "" if default in (None, inspect.Parameter.empty, "", ()) else str(default)


def _documented(text: str) -> dict[str, tuple[str, str]]:
    """Hint and unit of every parameter in a docstring of numpy style, by name.

    ``text`` is the docstring. The unit is empty where it is none that is known.
    """
    text = inspect.cleandoc(text)
    body = re.search(r"^Parameters\n-+\n(.*?)(?=^\w[^\n]*\n-+\n|\Z)", text, re.DOTALL | re.MULTILINE)
    out: dict[str, tuple[str, str]] = {}
    if body is None:
        return out
    for entry in re.split(r"\n(?=\S)", body.group(1)):
        head, _, rest = entry.partition("\n")
        names, colon, first = head.partition(" : ")
        hint = " ".join(f"{first} {rest}".split()) if colon else " ".join(rest.split())
        listed = [n.strip() for n in names.split(",")]
        units = _UNIT.findall(hint)
        # names in one entry have a unit each where there are as many, else the first one that is no angle: the name of
        # an angle says its unit
        for i, name in enumerate(listed):
            if name.endswith("_deg"):
                unit = "deg"
            elif len(units) == len(listed):
                unit = units[i]
            else:
                unit = next((u for u in units if u != "deg"), "")
            out[name] = (hint, unit)
    return out
