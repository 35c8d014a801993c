#!/usr/bin/env python3
"""Runs a table of worlds, seeds and controllers on the cores of one machine or of a Ray cluster.

See README.md in this folder, or `sweep.py --help`.
"""

from __future__ import annotations

import sys

from flatland_sweep.command_line import main

if __name__ == "__main__":
    sys.exit(main())
