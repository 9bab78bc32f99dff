"""Pages of the site that are made from what the repository holds: theory, tables, gallery, API reference, citation.

They are written below ``made/``, ``gallery_source/`` and ``reference/`` at every build and are not kept.
"""

import ast
import functools
import importlib
import inspect
import itertools
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

SITE = Path(__file__).resolve().parent
ROOT = SITE.parents[1]

PACKAGES = {
    "limitmason": "Everything a script begins with.",
    "limitmason.model": "Blocks, joints, loads, supports and their assembly.",
    "limitmason.build": "Walls, arches and columns from a few numbers.",
    "limitmason.deformable": "Elasticity and shapes of blocks that deform.",
    "limitmason.geometry": "Polygons, polyhedra and contact detection on plain arrays.",
    "limitmason.limit": "Limit analysis: associative, non-associative, proven ranges, settlement.",
    "limitmason.stability_check": "Whether a structure stands, and how well.",
    "limitmason.capacity": "Capacity curves.",
    "limitmason.continuum": "Walls as a continuum.",
    "limitmason.vibration": "Modes, and modes identified from motion.",
    "dem": "Distinct elements.",
    "mechanisms": "Closed-form mechanisms.",
    "limitmason.methods": "Methods by name.",
    "limitmason.comparison": "Predicted beside measured.",
    "limitmason.experiments": "Packaged experiments.",
    "limitmason.study": "Sweeps, random joints, attribution of gaps.",
    "limitmason.calibration": "Parameters of a model from measured values.",
    "limitmason.diagnosis": "What a simulation gets wrong.",
    "limitmason.causes": "Physical extensions of a model.",
    "limitmason.codes": "Verdicts of codes of practice.",
    "limitmason.figures": "Figures and the interactive scene.",
    "limitmason.formats": "Files in and out.",
    "limitmason.answers": "Answers, bounds, curves, papers.",
    "limitmason.mechanics": "What all methods share: the law, contact points, equilibrium, certificates.",
    "limitmason.errors": "What is raised.",
}
"""Public packages and modules in the order of the reference."""

OURS = {name.partition(".")[0] for name in PACKAGES}

COPIED = {
    "theories.md": "docs/theories.md",
    "diagnosis.md": "docs/diagnosis.md",
    "predicted.md": "docs/predicted.md",
    "findings.md": "docs/findings.md",
    "limits.md": "docs/limits.md",
    "glossary.md": "docs/glossary.md",
    "laws.md": "docs/laws.md",
    "mechanisms.md": "docs/mechanisms.md",
    "methods.md": "docs/methods.md",
    "capacity.md": "docs/capacity.md",
    "papers.md": "docs/papers/index.md",
    "panels.md": "docs/papers/panels.md",
    "bnw.md": "docs/papers/bnw.md",
    "mcmaster.md": "docs/papers/mcmaster.md",
    "u_walls.md": "docs/papers/u-walls.md",
    "stochastic.md": "docs/papers/stochastic.md",
    "calibration.md": "docs/papers/calibration.md",
    "measured_walls.md": "docs/measured-walls.md",
    "measured_walls_diagnosis.md": "docs/measured-walls-diagnosis.md",
    "pavia.md": "docs/pavia.md",
    "history_capacity.md": "docs/history/capacity.md",
    "history_measured_walls.md": "docs/history/measured-walls.md",
    "history_u_walls.md": "docs/history/u-walls.md",
    "history_stochastic.md": "docs/history/stochastic.md",
    "blind_trials.md": "validation/blind/report.md",
    "two_codes.md": "validation/blind/two_codes.md",
    "kinds.md": "validation/blind/kinds.md",
    "places.md": "validation/blind/places.md",
    "contributing.md": "CONTRIBUTING.md",
    "changelog.md": "CHANGELOG.md",
}
"""Pages of the site that are documents of the repository, by their name in ``made/``."""

STORED = SITE / "gallery_stored"
"""What the examples printed and drew, one folder per example; see :mod:`store_gallery`."""


GALLERY = {
    "First steps": (
        "stack", "block_on_slope", "wall_with_opening", "two_mechanisms", "wall_flow_rules",
        "corner_walls_out_of_plane", "semicircular_arch", "modes_of_a_wall", "capacity_curve", "rocking_column",
    ),
    "Walls": (
        "traced_drawing", "tie_rods", "rubble_leaf", "three_theories_one_wall", "mechanisms_of_a_u_shaped_wall",
        "dilatancy_and_block_size", "gaps_in_a_corner_wall", "u_wall_as_a_solid",
    ),
    "Arches and vaults": ("axles_on_an_arch", "vaults_and_domes"),
    "Distinct elements": ("tilt_test", "rondelet_contact_points", "four_point_bending"),
    "Capacity curves": ("brick_panel", "minho_pushover", "murano_pushover", "bnw_zoned_walls"),
    "Diagnosis and calibration": (
        "own_cause", "calibrate_murano_stiffness", "calibrate_brick_panels", "diagnose_murano", "diagnose_pavia",
        "diagnose_brick_panels", "diagnose_ferris_tin_loi", "diagnose_minho",
    ),
    "Papers": ("ferris_tin_loi_walls", "minho_shear_walls", "minho_cracking_stone", "stochastic_panels"),
}
"""Groups of the gallery and their examples, both in the order shown; those of the first are read in a minute each."""


def examples() -> list[Path]:
    """The scripts of the gallery in its order."""
    return [ROOT / "examples" / f"{name}.py" for names in GALLERY.values() for name in names]


class GalleryOrder:
    """Sorts the scripts of a group of the gallery."""

    def __init__(self, folder: str) -> None:
        self.names = [p.name for p in examples()]

    def __call__(self, script: str) -> int:
        """Place of a script."""
        return self.names.index(Path(script).name)


def title_of(script: Path) -> tuple[str, str]:
    """Title of a script, what its docstring says up to the first colon or point, and the docstring's sentences."""
    words = inspect.cleandoc(re.match(r'"""(.*?)"""', script.read_text(encoding="utf-8"), flags=re.DOTALL)[1])
    title = re.split(r"[:.](?:\s|$)", " ".join(words.split()), maxsplit=1)[0]
    return title, "\n".join(readable(words.splitlines()))


def gallery_script(script: Path) -> str:
    """An example as sphinx-gallery reads it: title, code, and the stored output below."""
    title, rest = title_of(script)
    text = script.read_text(encoding="utf-8")
    code = text[re.match(r'""".*?"""\n', text, flags=re.DOTALL).end() :]
    head = f'r"""\n{title}\n{"=" * len(title)}\n\n{rest}\n"""\n'
    stored = STORED / script.stem
    lines = ["", "# %%"]
    if not (stored / "output.txt").exists():
        lines += [f"# Not stored here: run ``python examples/{script.name}``."]
        return head + code + "\n".join(lines) + "\n"
    lines += ["# What it printed:", "#", "# .. code-block:: text", "#"]
    lines += [f"#     {line}".rstrip() for line in (stored / "output.txt").read_text(encoding="utf-8").splitlines()]
    found = sorted(stored.glob("*.png"))
    for picture in found:
        lines += ["#", f"# .. image:: /gallery_stored/{script.stem}/{picture.name}", f"#    :alt: {title}"]
    if found:
        lines += ["", f"# sphinx_gallery_thumbnail_path = 'gallery_stored/{script.stem}/{found[0].name}'"]
    return head + code + "\n".join(lines) + "\n"


def write_gallery(folder: Path) -> None:
    """Write the examples as sphinx-gallery reads them, a folder for each group."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "GALLERY_HEADER.rst").write_text(
        "Gallery\n=======\n\nScripts with what they print and draw, each also a test. They stand in the folder "
        "``examples`` and write their figures where they are run.\n",
        encoding="utf-8",
    )
    for number, (group, names) in enumerate(GALLERY.items(), 1):
        part = folder / f"{number}_{group.lower().replace(' ', '_')}"
        part.mkdir()
        (part / "GALLERY_HEADER.rst").write_text(f"{group}\n{'-' * len(group)}\n", encoding="utf-8")
        for name in names:
            script = ROOT / "examples" / f"{name}.py"
            (part / script.name).write_text(gallery_script(script), encoding="utf-8")


def linked(text: str, origin: Path) -> str:
    """A document with its links turned to pages of the site; files that are no page are named instead.

    Parameters
    ----------
    text : of the document, in Markdown
    origin : where it lies in the repository
    """
    pages = {(ROOT / path).resolve(): name for name, path in COPIED.items()}

    def turned(match: re.Match[str]) -> str:
        mark, words, target = match[1], match[2], match[3]
        if re.match(r"[a-z]+:|#", target):
            return match[0]
        file = (origin.parent / target.partition("#")[0]).resolve()
        if mark:
            return f"![{words}](../../{file.relative_to(ROOT / 'docs').as_posix()})"
        if file in pages:
            return f"[{words}]({pages[file]})"
        return f"{words} (`{file.relative_to(ROOT).as_posix()}`)" if words.strip("`") not in target else f"`{target}`"

    return re.sub(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)", turned, text)


def citation() -> str:
    """How to cite, out of CITATION.cff."""
    said = dict(re.findall(r"^(\w[\w-]*): (.+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE))
    return (
        f"# How to cite\n\n{said['message']}\n\n> The limitmason developers: {said['title']}, version "
        f"{said['version']}. {said['abstract']}\n\n```bibtex\n@software{{limitmason,\n"
        f"  author  = {{{{The limitmason developers}}}},\n  title   = {{limitmason}},\n"
        f"  version = {{{said['version']}}},\n  note    = {{{said['abstract']}}}\n}}\n```\n\n"
        "Measured and published values that you use belong to their sources: `limitmason experiments show SOURCE "
        "SPECIMEN` names source and licence, every row of a packaged table its own.\n"
    )


def write_pages(folder: Path) -> None:
    """Write the pages that are documents of the repository, and the citation."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, path in COPIED.items():
        origin = ROOT / path
        (folder / name).write_text(linked(origin.read_text(encoding="utf-8"), origin), encoding="utf-8")
    (folder / "cite.md").write_text(citation(), encoding="utf-8")


def readable(lines: list[str]) -> list[str]:
    """A docstring as reStructuredText: equations set off by indentation become literal blocks, bars stay bars."""
    out: list[str] = []
    literal = False
    for number, line in enumerate(lines):
        indented = line.startswith("    ")
        if line.strip() and not indented:
            literal = False
        apart = number > 0 and not lines[number - 1].strip()
        if indented and apart and not literal and _opens_equation(out) and not line.lstrip().startswith((">>>", "- ")):
            out += ["::", ""]
            literal = True
        plain = literal or line.lstrip().startswith((">>>", "..."))
        out.append(line if plain else re.sub(r"(``.*?``)|\\?\|", lambda m: m[1] or r"\|", line))
    return out


def _opens_equation(out: list[str]) -> bool:
    """Whether an indented line may follow as an equation: the last text is not indented and opens no block itself."""
    last = next((x for x in reversed(out) if x.strip()), "    ")
    return not last.startswith("    ") and not last.endswith("::") and not set(last.strip()) <= {"-"}


def names_of(module: ModuleType) -> list[str]:
    """``__all__`` of a module, or what it defines where it has none."""
    own = (n for n, x in vars(module).items() if getattr(x, "__module__", "") == module.__name__ and n[0] != "_")
    return list(getattr(module, "__all__", None) or own)


def public_names(module: ModuleType) -> Iterator[tuple[str, object]]:
    """Public names of a module and their objects."""
    for name in names_of(module):
        yield name, getattr(module, name)


def home_of(name: str, thing: object, package: str) -> str | None:
    """Public package that documents a thing which this one only hands on; None where it is documented here.

    The last of ``PACKAGES`` that lists the very same object is its home, for the first ones gather from the others.
    """
    modules = {p: importlib.import_module(p) for p in PACKAGES}
    homes = [p for p, m in modules.items() if name in getattr(m, "__all__", ()) and getattr(m, name) is thing]
    return homes[-1] if homes and homes[-1] != package else None


@functools.cache
def listed_classes() -> set[type]:
    """Classes that the reference lists."""
    found = [thing for p in PACKAGES for _, thing in public_names(importlib.import_module(p))]
    return {thing for thing in found if inspect.isclass(thing)}


def words_of(package: str, name: str) -> str:
    """What the source says of a constant: the string below its assignment, wherever it was imported from."""
    tree = ast.parse(inspect.getsource(importlib.import_module(package)))
    for node, below in itertools.pairwise([*tree.body, ast.Pass()]):
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        if name in [getattr(t, "id", None) for t in targets]:
            said = isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant)
            return inspect.cleandoc(str(below.value.value)) if said else ""
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                if name == (alias.asname or alias.name):
                    return words_of(node.module, alias.name)
    return ""


def entry(package: str, name: str, thing: object) -> str:
    """The reference of one public name, in reStructuredText."""
    full = f"{package}.{name}"
    if inspect.ismodule(thing):
        listed = "\n   :no-index:" if thing.__name__ == full else ""  # its own page lists it
        return f".. py:attribute:: {name}{listed}\n\n   The package :doc:`{thing.__name__}`.\n"
    home = home_of(name, thing, package)
    if home is not None:
        return f".. py:data:: {name}\n   :no-index-entry:\n\n   The same as :py:obj:`{home}.{name}`.\n"
    if inspect.isclass(thing):
        # methods from a class of ours that has no page are methods of this one to a reader
        bases = [(b, b.__module__.partition(".")[0] in OURS and b not in listed_classes()) for b in thing.__mro__[1:]]
        others = ", ".join(b.__name__ for b, unlisted in bases if not unlisted)
        inherited = f"   :inherited-members: {others}\n" if any(unlisted for _, unlisted in bases) else ""
        return f".. autoclass:: {full}\n   :members:\n{inherited}"
    if inspect.isroutine(thing):
        return f".. autofunction:: {full}\n"
    if type(thing).__name__ == "Declared":
        lines = readable(inspect.cleandoc(thing.__doc__ or "").splitlines())
        words = "\n".join(f"   {line}".rstrip() for line in lines)
        said = thing.said
        return (
            f".. py:function:: {name}(bounds={thing.bounds!r})\n\n{words}\n\n"
            f"   Cause *{thing.name}*: parameter ``{said['parameter']}`` [{said['unit']}], nothing changes at "
            f"{thing.baseline:g}; {said['physics']}.\n"
        )
    words = "\n".join(f"   {line}".rstrip() for line in readable(words_of(package, name).splitlines()))
    shown = repr(thing)
    value = f"\n   :value: {shown}" if len(shown) < 400 and "\n" not in shown and " at 0x" not in shown else ""
    return f".. py:data:: {name}{value}\n\n{words}\n"


def reference_page(package: str) -> str:
    """The reference page of one public package."""
    module = importlib.import_module(package)
    what = [
        f".. _reference-{package}:\n", package, "=" * len(package), "", f"{PACKAGES[package]}\n",
        f".. py:module:: {package}\n",
    ]
    what += [f"{inspect.cleandoc(module.__doc__ or '')}\n"]
    return "\n".join([*what, *(entry(package, name, thing) for name, thing in public_names(module))])


def write_reference(folder: Path) -> None:
    """Write one page per public package, and their list."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    rows = "\n".join(f"   * - :doc:`{p}`\n     - {words}" for p, words in PACKAGES.items())
    tree = "\n".join(f"   {p}" for p in PACKAGES)
    (folder / "index.rst").write_text(
        f"API reference\n=============\n\n.. list-table::\n\n{rows}\n\n"
        f".. toctree::\n   :hidden:\n\n{tree}\n",
        encoding="utf-8",
    )
    for package in PACKAGES:
        (folder / f"{package}.rst").write_text(reference_page(package), encoding="utf-8")


def write_all(site: Path = SITE) -> None:
    """Write everything that is made."""
    write_pages(site / "made")
    write_gallery(site / "gallery_source")
    write_reference(site / "reference")
