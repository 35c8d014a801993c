"""A live view of a world that a program steps, in a cell of a notebook or at an address."""

from __future__ import annotations

import html
import secrets
import sys
from typing import TYPE_CHECKING, Self

from flatland.checks import checked_count
from flatland.runtime.observer import WorldObserver
from flatland.uncopied import uncopied
from flatland.web.viewer import WebViewer

if TYPE_CHECKING:
    from flatland.world import World


@uncopied("World.view() opens a view of another world")
class LiveView(WorldObserver):
    """Shows a world in the browser until the view or the world is closed; see `World.view`.

    As the result of a cell, a notebook shows the page. The program continues; changes of the world
    are visible immediately, also between two steps.

    Attributes:
        world: The world.
    """

    def __init__(
        self,
        world: World,
        host: str,
        port: int,
        token: str | None,
        read_only: bool,
        height: int,
    ) -> None:
        """Starts a server that shows the world; `World.view` describes the arguments.

        Raises:
            FlatlandError: The world is closed, or the server cannot listen on the port.
            ValueError: An argument is out of range.
        """
        height = checked_count("height", height)
        world.check_open()
        self.world = world
        self._height = height
        # The page of a notebook has another origin. Only a token distinguishes its frame from the
        # frames of other sites.
        self._viewer = WebViewer(
            host,
            port,
            token=token or secrets.token_urlsafe(16),
            read_only=read_only,
            embeddable=True,
        )
        try:
            self._viewer.start()
            self._viewer.add_world(world)
        except BaseException:
            self._viewer.close()
            raise
        self._closed = False
        world.between_steps(lambda: world.add_observer(self))

    @property
    def url(self) -> str:
        """Address of the page, with the token."""
        return self._viewer.url

    @property
    def closed(self) -> bool:
        """Whether the view has ended."""
        return self._closed

    @property
    def is_watched(self) -> bool:
        """Whether a browser shows the world."""
        return self._viewer.is_watched

    def close(self) -> None:
        """Stops the server, not the world; further calls have no effect."""
        if self._closed:
            return
        self._closed = True
        self._viewer.close()
        if not self.world.closed:
            self.world.between_steps(lambda: self.world.remove_observer(self))

    def detached(self) -> None:
        """Stops the server when the world is closed."""
        self._closed = True
        self._viewer.close()

    def __enter__(self) -> Self:
        """Returns the view; the end of the block closes the view."""
        return self

    def __exit__(self, *error: object) -> None:
        """Closes the view."""
        self.close()

    def __repr__(self) -> str:
        """Returns the address."""
        return f"<LiveView {'closed' if self._closed else self.url}>"

    def _repr_html_(self) -> str:
        """Returns the page as a frame, for Jupyter."""
        if self._closed:
            return "<p>The view is closed.</p>"
        return (
            f'<iframe src="{html.escape(self.url)}" title="flatland" width="100%" '
            f'height="{self._height}" style="border: 0" allow="fullscreen; clipboard-write">'
            "</iframe>"
        )


def open_view(
    world: World, host: str, port: int, token: str | None, read_only: bool, height: int
) -> LiveView:
    """Opens a view of a world and closes the previous view of the world; see `World.view`.

    Raises:
        FlatlandError: The world is closed, or the server cannot listen on the port.
        ValueError: An argument is out of range.
    """
    if world._view is not None:
        world._view.close()
    view = world._view = LiveView(world, host, port, token, read_only, height)
    if not _in_notebook():
        print(f"flatland: {view.url}", file=sys.stderr, flush=True)
    return view


def _in_notebook() -> bool:
    """Returns whether the results of the program are displayed by Jupyter."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return shell is not None and hasattr(shell, "kernel")
