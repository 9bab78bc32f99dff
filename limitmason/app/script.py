"""The Python of a session: what was filled in on the page becomes the lines that are run, shown and downloaded.

A session is what the page sends: ``{"joint": VALUES, "structure": {"kind", "values", ...}, "loads": {"kind", "values",
"more": [...]}, "analysis": {"kind", "values"}}``, where VALUES are texts by name of an argument.

``session`` is what the page holds as JSON, and ``tree`` a part of it; ``values`` are what was typed into fields, by
name.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from limitmason.app.folder import Folder
from limitmason.app.forms import Call, Field, calls, experiment_fields
from limitmason.errors import InputError
from limitmason.experiments import registry

_LONGEST = 118  # characters of a line of the script
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)  # as Python writes numbers
_ONE_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")
_DIGITS = 40  # characters that no number needs: longer ones stay texts, which the call refuses


class ScriptLine(NamedTuple):
    """A statement of the script.

    Parameters
    ----------
    text : source
    part : of the page, where an error in it is shown
    shows : whether it only shows or writes what was computed before
    """

    text: str
    part: str
    shows: bool = False


def statements(session: Mapping[str, Any], folder: Folder, *, kind: str = "solve") -> list[ScriptLine]:
    """Lines that do what a session says.

    Parameters
    ----------
    session : as the page sends it
    folder : whose files it may name
    kind : "solve"; "draw" for the structure and its loads alone; "report" for a page on them

    Returns
    -------
    The lines in their order; they leave ``wall``, ``loads`` and, but for "draw", ``answer``.

    Raises
    ------
    InputError
        For a session that names a call, a field or a file that there is not.
    """
    out = [ScriptLine("import limitmason as lm\n", "structure"), *_model(session, folder)]
    if kind == "draw":
        return [
            *out,
            ScriptLine('lm.figures.assembly(wall).savefig("wall.png", dpi=160)', "structure", shows=True),
            ScriptLine('lm.view(wall, path="scene.html")', "structure", shows=True),
            ScriptLine('lm.formats.write_json("model.json", wall, loads)', "structure", shows=True),
        ]
    analysis = _of(session, "analysis")
    name, values = _word(analysis, "kind"), _of(analysis, "values")
    if kind == "report":  # the page is on a comparison: it compares the one theory that was asked for
        rule = str(values.get("flow_rule") or "associative") if name == "limit_analysis" else "associative"
        name, values = "compare", {"methods": rule}
    out.append(ScriptLine(_analysis(name, values), "analysis"))
    out.append(ScriptLine("print(answer)", "analysis"))
    return [*out, *(ScriptLine(line, "analysis", shows=True) for line in _pictures(name, kind))]


def source(lines: Sequence[ScriptLine]) -> str:
    """The script of ``lines``: every statement on lines of its own."""
    return "\n".join(line.text for line in lines) + "\n"


def _analysis(name: str, values: Mapping[str, Any]) -> str:
    """Line that makes the answer, by the name of the analysis."""
    # the error budget of the DEM takes minutes: it is for a script that somebody leaves running
    quick = ('dem={"error_budget": ()}',) if name == "compare" and "dem" in str(values.get("methods")) else ()
    return _filled(_known("analysis", name), values, *quick)


def _pictures(name: str, kind: str) -> list[str]:
    """Lines that draw and write an answer.

    Parameters
    ----------
    name : of the analysis
    kind : "solve" or "report"
    """
    mechanism = [
        'lm.figures.mechanism(wall, {}).savefig("mechanism.png", dpi=160)',
        'lm.figures.contact_forces(wall, {}).savefig("forces.png", dpi=160)',
        'lm.view(wall, {}, "scene.html")',
        'lm.formats.write_prediction("answer.json", {}, assembly=wall)',
    ]
    report = 'lm.figures.structure_report(wall, loads, answer, "report.html")'
    model = 'lm.formats.write_json("model.json", wall, loads)'
    if kind == "report":
        return [report]
    if name == "compare":
        return ['lm.figures.side_by_side(answer).savefig("theories.png", dpi=160)', report, model]
    if name == "pushover":
        return [
            'lm.figures.load_displacement(answer).savefig("curve.png", dpi=160)', 'lm.view(wall, answer, "scene.html")',
            model,
        ]
    if name == "stability":  # what stands has forces, what falls has a motion
        falls, carries, *others = (line.format("answer.state") for line in mechanism)
        return [f"if answer.stands:\n    {carries}\nelse:\n    {falls}", *others, model]
    return [line.format("answer") for line in mechanism] + [model]


def _model(session: Mapping[str, Any], folder: Folder) -> list[ScriptLine]:
    """Lines that make joint, structure and loads.

    Parameters
    ----------
    session : as the page sends it; a structure of kind "file" names one of ``folder``
    """
    structure, loads = _of(session, "structure"), _of(session, "loads")
    kind, values = _word(structure, "kind"), _of(structure, "values")
    joint = ScriptLine(_filled(_known("joint", "Joint"), _of(session, "joint")), "joint")
    own = False  # whether the structure brings loads, and joints, of its own
    if kind in calls()["structure"]:
        out = [joint]
        openings = _rows(structure, "openings") if kind == "wall" else []
        if openings:
            each = [_filled(_known("opening", "Opening"), o) for o in openings]
            out.append(ScriptLine("openings = [\n" + "".join(f"    {o},\n" for o in each) + "]", "openings"))
        more = ("openings=openings",) if openings else ()
        out.append(ScriptLine(_filled(_known("structure", kind), values, *more), "structure"))
    elif kind == "experiment":
        out, own = _experiment(structure, values), True
    elif kind == "file":
        name, own = folder.known(_word(structure, "file")), True
        if name.lower().endswith(".json"):
            out = [ScriptLine(f"wall, loads = lm.formats.read_json({_quoted(name)})", "structure")]
        else:
            drawing = _filled(_known("drawing", "drawing"), values, before=(_quoted(name),))
            out = [joint, ScriptLine(drawing, "structure")]
            out.append(ScriptLine("wall, loads = drawing.assembly, drawing.loads", "structure"))
    else:
        known = ", ".join([*calls()["structure"], "experiment", "file"])
        raise InputError(f"structure: kind {kind!r} is none of {known}")
    # drawings have the joint of the form already; other structures keep theirs unless the page asks for this one
    if own and joint not in out and structure.get("other_joints"):
        out += [joint, ScriptLine("wall = wall.with_joints(joint)", "joint")]
    return out + _loads(loads, own)


def _experiment(structure: Mapping[str, Any], values: Mapping[str, Any]) -> list[ScriptLine]:
    """Lines that load a packaged experiment.

    Parameters
    ----------
    structure : source and specimen
    values : of its options, by name
    """
    at, specimen = _word(structure, "source"), _word(structure, "specimen")
    if at not in registry.sources() or specimen not in registry.specimens(at):
        raise InputError(f"there is no packaged experiment {at}/{specimen}")
    # "none" may be a value of an option, such as a residual strength; None is written as it is offered
    given = _arguments(experiment_fields(at, specimen), values, none="None")
    return [
        ScriptLine(f"test = lm.experiments.load({', '.join([_quoted(at), _quoted(specimen), *given])})", "structure"),
        ScriptLine("wall, loads = test.assembly(), test.loads()", "structure"),
    ]


def _loads(loads: Mapping[str, Any], own: bool) -> list[ScriptLine]:
    """Lines that make the loads: those of a kind, and those that come on top.

    Parameters
    ----------
    loads : part of the session: "kind" with its "values", and a list "more" of the same
    own : whether the structure brings loads of its own
    """
    kind = _word(loads, "kind")
    out = []
    if kind == "own":
        if not own:
            raise InputError("loads: this structure brings none of its own: choose others")
    else:
        out.append(ScriptLine(_filled(_known("loads", kind), _of(loads, "values")), "loads"))
    for i, more in enumerate(_rows(loads, "more")):
        call = _known("more", _word(more, "kind"))
        out.append(ScriptLine(_filled(call, _of(more, "values")), f"more.{i}"))
    return out


def _filled(call: Call, values: Mapping[str, Any], *more: str, before: Sequence[str] = ()) -> str:
    """The line of a call with its arguments, each on a line of its own where one line is too short.

    Parameters
    ----------
    before, more : source of arguments before all others, and behind them
    """
    given = [*before, *call.before, *_arguments(call.fields, values), *call.after, *more]
    line = f"{call.target}({', '.join(given)})"
    return line if len(line) <= _LONGEST else f"{call.target}(\n" + "".join(f"    {g},\n" for g in given) + ")"


def _arguments(fields: Sequence[Field], values: Mapping[str, Any], none: str | None = None) -> list[str]:
    """Keyword arguments of a call, from those of its ``fields`` that are filled in.

    ``values`` are what was typed, by name of the field; a name that no field has is refused. ``none`` is that of
    :func:`literal`.
    """
    unknown = set(values) - {f.name for f in fields}
    if unknown:
        raise InputError(f"the form has no field {sorted(unknown)[0]!r}")
    out = []
    for field in fields:
        value = values.get(field.name, "")
        if value is None or value is False or not str(value).strip():
            continue
        if field.alone and _ONE_COMMA.fullmatch(str(value).strip()):
            raise InputError(
                f"{field.name}: {value!r} may be one number or two: write a decimal point, or a blank behind the comma"
            )
        out.append(f"{field.name}={literal(value, field.kind, none)}")
    return out


def literal(value: Any, kind: str, none: str | None = None) -> str:
    """Source of what was typed into a field.

    What is no number stays a text, so that the call itself says what is wrong with it.

    Parameters
    ----------
    value : what was typed
    kind : of the field, as in :class:`~limitmason.app.forms.Field`
    none : the only word that is None; by default it is "none", in upper and lower case alike
    """
    if kind == "tick":
        return repr(bool(value))
    text = str(value).strip()
    if kind == "number":
        return _number(text)
    parts = [p.strip() for p in text.split(",") if p.strip()]
    if kind == "numbers":
        return _number(parts[0]) if len(parts) == 1 else f"({', '.join(map(_number, parts))})"
    if kind == "lines":
        return f"[{', '.join(_quoted(line.strip()) for line in text.splitlines() if line.strip())}]"
    if kind == "list" or (kind == "words" and len(parts) > 1):
        return f"({', '.join(map(_quoted, parts))}{',' if len(parts) == 1 else ''})"
    is_none = text.lower() == "none" if none is None else text == none
    return "None" if is_none else _quoted(text)


def _number(text: str) -> str:
    """Source of a number as it was typed, or else of the text."""
    if _NUMBER.fullmatch(text) and len(text) < _DIGITS:
        number = float(text)
        if math.isfinite(number):  # 1e999 is not
            # a whole number without zeros before it, which Python does not take
            return str(int(text)) if re.fullmatch(r"[-+]?\d+", text) else text.lstrip("+")
    if text.lower() in ("nan", "inf", "-inf", "+inf", "infinity"):
        return f'float("{float(text)}")'
    return _quoted(text)


def _quoted(text: str) -> str:
    """A text as source, in double quotes where it holds no quotes at all."""
    return repr(text) if "'" in text or '"' in text else f'"{repr(text)[1:-1]}"'


def _known(part: str, name: str) -> Call:
    """The call of a name among those of a part."""
    group = calls()[part]
    if name not in group:
        raise InputError(f"{part}: {name!r} is none of {', '.join(group)}")
    return group[name]


def _of(tree: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """The object under a key, empty where there is none."""
    value = tree.get(key, {})
    if not isinstance(value, dict):
        raise InputError(f"{key} must be an object, got {value!r}")
    return value


def _rows(tree: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    """The list of objects under a key, empty where there is none."""
    value = tree.get(key, [])
    if not isinstance(value, list) or not all(isinstance(v, dict) for v in value):
        raise InputError(f"{key} must be a list of objects, got {value!r}")
    return value


def _word(tree: Mapping[str, Any], key: str) -> str:
    """The text under a key, empty where there is none."""
    value = tree.get(key, "")
    if not isinstance(value, str):
        raise InputError(f"{key} must be a text, got {value!r}")
    return value
