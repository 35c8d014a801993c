"""`World.view` in a notebook: the page in a frame of a page with another origin."""

from __future__ import annotations

import http.server
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from chromium import Chromium
from viewed_world import write_room

from flatland import World


@contextmanager
def notebook(html: str) -> Iterator[str]:
    """Serves a page that contains the result of a cell, and returns its address."""

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.end_headers()
            self.wfile.write(f"<!doctype html><title>notebook</title>{html}".encode())

        def log_message(self, *_: object) -> None:
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://localhost:{server.server_port}/"
        finally:
            server.shutdown()
            thread.join()


def test_a_cell_shows_the_world_while_the_program_steps_it(
    browser: Chromium, tmp_path: Path
) -> None:
    with World.from_yaml(write_room(tmp_path), seed=1) as world:
        view = world.view(height=400)
        with notebook(view._repr_html_()) as url:
            browser.console()
            browser.open(url)
            assert browser.evaluate("document.querySelector('iframe').offsetHeight") == 400
            with browser.frame():
                browser.until("window.flatland?.state.worlds[0]?.models.robot?.pose")
                world.step(100)
                browser.until("flatland.state.worlds[0].time > arguments[0]", world.time - 1e-6)
                world.move_model("robot", (3, 2, 0))
                browser.until("Math.abs(flatland.state.worlds[0].models.robot.pose[0] - 3) < 0.01")
                # The page acts on the world of the idle program.
                browser.until("document.querySelector('#pause').click() || true")
                browser.until("document.querySelector('#pause').innerText.includes('Resume')")
                assert world.paused
            assert browser.console() == []
            browser.open("about:blank")
