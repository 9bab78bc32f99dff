"""``python -m limitmason.cli``."""

from limitmason.cli import main

raise SystemExit(main())
