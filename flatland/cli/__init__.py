"""The command `flatland`, one module for each of its commands."""

from flatland.cli.main import main

__all__ = ["main"]
