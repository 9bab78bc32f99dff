"""``python -m limitmason``: the command line where its script is not on the path."""

from limitmason.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
