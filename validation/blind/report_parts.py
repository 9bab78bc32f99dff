"""The report of the blind trials is made by several commands: each writes its own part, between markers."""


def put(path, part, begin, end):
    """Write a part, markers included, in its place, or at the end of the report."""
    whole = path.read_text(encoding="utf-8") if path.exists() else ""
    if begin in whole:
        before, rest = whole.split(begin, 1)
        whole = before + part + rest.split(end, 1)[1].removeprefix("\n")
    else:
        whole = whole.rstrip("\n") + "\n\n" + part
    path.write_text(whole, encoding="utf-8")
