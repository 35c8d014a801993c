"""The viewer in the browser: a server that shows worlds live, see `docs/web_protocol.md`."""

from flatland.web.controller import WorldController
from flatland.web.viewer import WebViewer, WorldHandle

__all__ = ["WebViewer", "WorldController", "WorldHandle"]
