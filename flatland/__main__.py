"""`python3 -m flatland` is the command `flatland`."""

import sys

from flatland.cli import main

if __name__ == "__main__":
    sys.exit(main())
