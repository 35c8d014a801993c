#!/usr/bin/env python3
"""Converts an image map to a map of line segments."""

import sys

from flatland.tools.map_to_lines import main

if __name__ == "__main__":
    sys.exit(main())
