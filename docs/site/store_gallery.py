"""Run examples and store what they print and draw for the gallery of the site.

    python docs/site/store_gallery.py NAME ... [--from FOLDER]

``all`` runs every example and page (a quarter of an hour). With ``--from`` no example is run: FOLDER holds one folder
per example with its ``output.txt`` and figures. The tests hold what is stored against what the examples print and draw.
With another drawing package, compiler or processor than those of the rest, all are stored anew or none.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import page_blocks
import stored_output
from site_sources import ROOT, STORED, examples


def store(name: str, folder: Path) -> None:
    """Keep output and figures of an example that has run in a folder."""
    kept = STORED / name
    kept.mkdir(parents=True, exist_ok=True)
    for old in kept.glob("*"):
        old.unlink()
    lines = (folder / "output.txt").read_text(encoding="utf-8").splitlines()
    (kept / "output.txt").write_text("\n".join(line.rstrip() for line in lines) + "\n", encoding="utf-8")
    for path in sorted(folder.glob("*.png")):
        stored_output.reduced(path).save(kept / path.name, optimize=True)


def run(name: str, folder: Path) -> None:
    """Run an example in a folder, which gets its output and figures."""
    script = ROOT / "examples" / f"{name}.py"
    out = subprocess.run([sys.executable, str(script)], cwd=folder, capture_output=True, text=True, check=True).stdout
    (folder / "output.txt").write_text(out, encoding="utf-8")


def main() -> None:
    """Run or take over the examples that are named."""
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("names", nargs="+", metavar="NAME")
    words.add_argument("--from", dest="source", type=Path)
    given = words.parse_args()
    if given.names == ["all"]:
        stored_output.STORED_WITH.write_text("\n".join(stored_output.made_with()) + "\n", encoding="utf-8")
    elif not stored_output.made_here():
        words.error(f"the rest was not made with {', '.join(stored_output.made_with())}: store all, or nothing")
    names = [p.stem for p in examples()] if given.names == ["all"] else given.names
    for name in names:
        if given.source is not None:
            store(name, given.source / name)
            continue
        with tempfile.TemporaryDirectory() as folder:
            run(name, Path(folder))
            store(name, Path(folder))
    if given.names == ["all"]:  # pictures of pages are of the same packages and processor
        site = ROOT / "docs" / "site"
        pages = sorted([*site.glob("*.md"), *(site / "tutorials").glob("*.md")])
        page_blocks.main([str(p) for p in pages if page_blocks.blocks(p.read_text(encoding="utf-8"))])


if __name__ == "__main__":
    main()
