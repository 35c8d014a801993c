#!/usr/bin/env python3
"""Turns an image map into a map of line segments."""

import sys

from flatland.tools.map_to_lines import main

if __name__ == "__main__":
    sys.exit(main())
