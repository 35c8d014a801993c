"""The viewer in the browser: a server that shows running worlds; see `docs/web_protocol.md`."""

from flatland.extras import require

# Otherwise, a missing package results in a traceback without a remedy.
require("aiohttp", "the viewer needs")

from flatland.web.controller import WorldController
from flatland.web.viewer import WebViewer, WorldHandle

__all__ = ["WebViewer", "WorldController", "WorldHandle"]
