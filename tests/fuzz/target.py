"""Runs one target with atheris: target.py NAME [OPTIONS OF LIBFUZZER] [CORPUS...]."""

from __future__ import annotations

import logging
import sys

import atheris

# Names of this package are found by their full names without instrumentation of other modules.
with atheris.instrument_imports(
    include=[
        "flatland.config",
        "flatland.maps",
        "flatland.plugin_api",
        "flatland.recording",
        "fuzz_targets",
    ]
):
    from fuzz_targets import TARGETS

    from flatland.maps import grey_image


def main() -> None:
    """Runs the target until the limit of time, or the first finding."""
    name, *options = sys.argv[1:]
    logging.disable()
    grey_image.MAX_PIXELS = 2**24  # A header of a few bytes can claim an image of 1 GB.
    atheris.Setup([sys.argv[0], *options], TARGETS[name])
    atheris.Fuzz()


main()
