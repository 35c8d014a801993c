"""Runs the command `flatland` for `python3 -m flatland`."""

import sys

from flatland.cli import main

if __name__ == "__main__":
    sys.exit(main())
