"""Counts the type errors that the configuration hides, and fails where a package has more than pyproject.toml allows.

``[tool.limitmason.type-debt]`` holds one number per package; ``python .ci/type_debt.py`` compares, ``--show PACKAGE``
prints that package's errors.
"""

import re
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def package_of(path: str) -> str:
    """Name under which a file is counted: the package or module directly below ``limitmason``, or the top package."""
    parts = Path(path).with_suffix("").parts
    return ".".join(parts[:2]) if parts[0] == "limitmason" else parts[0]


def errors(settings: dict) -> list[str]:
    """Lines of mypy for the whole library without overrides."""
    lines = ["[mypy]"]
    for key, value in settings.items():
        if key not in ("overrides", "packages"):
            lines.append(f"{key} = {','.join(value) if isinstance(value, list) else value}")
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "mypy.ini"
        config.write_text("\n".join(lines) + "\n", encoding="utf-8")
        command = [sys.executable, "-m", "mypy", "--config-file", str(config), "--no-error-summary"]
        for package in settings["packages"]:
            command += ["-p", package]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        raise SystemExit(done.stdout + done.stderr)
    return [line for line in done.stdout.splitlines() if re.match(r"[^:]+:\d+: error: ", line)]


def main(arguments: list[str]) -> int:
    """Compare, and say what is too much."""
    tool = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    allowed = tool["limitmason"]["type-debt"]
    found = errors(tool["mypy"])
    count = Counter(package_of(line.split(":")[0]) for line in found)
    if "--show" in arguments:
        wanted = arguments[arguments.index("--show") + 1]
        print("\n".join(line for line in found if package_of(line.split(":")[0]) == wanted))
    for package in sorted({*count, *allowed}):
        if count[package] < allowed.get(package, 0):
            print(f"{package}: {count[package]} type errors, {allowed[package]} allowed; lower the number")
    grown = [p for p in sorted(count) if count[p] > allowed.get(p, 0)]
    for package in grown:
        print(f"{package}: {count[package]} type errors, {allowed.get(package, 0)} allowed")
        print("\n".join(line for line in found if package_of(line.split(":")[0]) == package))
    print(f"type debt: {sum(count.values())} errors in {len(count)} packages, {sum(allowed.values())} allowed")
    return 1 if grown else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
