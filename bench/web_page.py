"""The page of the browser viewer in a headless Chromium: time to load, also over a slow network,
and frames per second.

Chromium draws without a graphics card here (SwiftShader), on the processor that also runs the
simulation; with a graphics card, both figures are better.
"""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
from table import Row

from flatland import Twist, World
from flatland.simulation import Simulation
from flatland.web import WebViewer

ROBOTS = 100
BOXES = 12_500  # of four edges each
SIDE = 100.0  # m
LOADS = 5
STARTS = 3
# A network with a round trip of 150 ms and 2 Mbit/s in each direction.
SLOW = {"latency": 150, "downloadThroughput": 250_000, "uploadThroughput": 250_000}
OFFICE = Path(__file__).parents[1] / "worlds" / "office" / "world.yaml"
WINDOWS = 5
WINDOW = 2.0  # s

ROBOT = """
bodies:
  - {name: base, color: [0, 0.4, 1, 1], footprints: [{type: circle, radius: 0.4, density: 1}]}
plugins:
  - {type: DiffDrive, name: drive, body: base, pub_rate: 20}
  - {type: Laser, name: laser, body: base, range: 10, update_rate: 10,
     angle: {min: -3.14159, max: 3.14159, increment: 0.0174533}}
"""
# Sets `loadTime` [ms since the start of the navigation] when all walls and models were drawn.
WATCH_LOADING = """
(() => {
  const look = () => {
    const world = window.flatland?.state?.worlds?.[0];
    if (world && Object.keys(world.models).length === MODELS && world.edges === EDGES) {
      requestAnimationFrame(() => { window.loadTime = performance.now(); });
    } else requestAnimationFrame(look);
  };
  look();
})();
"""
# Pans the view by one pixel in each frame, so that each of them is drawn, and counts them.
PAN = """
const [seconds, done] = arguments;
const canvas = document.querySelector("#canvas");
const box = canvas.getBoundingClientRect();
const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
const send = (type, dx, buttons) => canvas.dispatchEvent(new PointerEvent(type, {
  bubbles: true, pointerId: 1, isPrimary: true, button: 0, buttons,
  clientX: x + dx, clientY: y, shiftKey: false,
}));
const start = performance.now(), first = flatland.frames;
let i = 0;
send("pointerdown", 0, 1);
const move = () => {
  const elapsed = (performance.now() - start) / 1000;
  if (elapsed >= seconds) {
    send("pointerup", 0, 0);
    done((flatland.frames - first) / elapsed);
    return;
  }
  send("pointermove", 5 + (i++ % 20), 1);
  requestAnimationFrame(move);
};
requestAnimationFrame(move);
"""


# An empty canvas of the same size: what the browser achieves on this machine.
EMPTY = """data:text/html,<canvas width=WIDTH height=HEIGHT></canvas><script>
const gl = document.querySelector("canvas").getContext("webgl2", {alpha: false, antialias: false});
window.frames_drawn = 0;
const draw = () => {
  gl.clearColor((frames_drawn++ & 63) / 64, 0, 0, 1);
  gl.clear(gl.COLOR_BUFFER_BIT);
  requestAnimationFrame(draw);
};
draw();
</script>"""
COUNT = """
const [seconds, done] = arguments;
const start = performance.now(), first = frames_drawn;
setTimeout(() => done((frames_drawn - first) / (performance.now() - start) * 1e3), 1e3 * seconds);
"""


def write_world(folder: Path) -> Path:
    """Writes a world with many small boxes as walls, and robots between them."""
    rng = np.random.default_rng(1)
    corners = rng.uniform(0, SIDE, (BOXES, 1, 2)) + 0.1 * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    edges = np.concatenate([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 4)
    np.savetxt(folder / "walls.dat", edges, fmt="%.3f")
    (folder / "map.yaml").write_text(
        "type: line_segments\ndata: walls.dat\nscale: 1.0\norigin: [0, 0, 0]\n"
    )
    (folder / "robot.model.yaml").write_text(ROBOT)
    side = int(np.sqrt(ROBOTS))
    models = [
        f"  - {{name: robot_{i}, namespace: robot_{i}, model: robot.model.yaml, "
        f"pose: [{(i % side + 0.5) * SIDE / side}, {(i // side + 0.5) * SIDE / side}, 0]}}"
        for i in range(ROBOTS)
    ]
    path = folder / "world.yaml"
    path.write_text(
        "properties: {}\nlayers: [{name: walls, map: map.yaml}]\nmodels:\n" + "\n".join(models)
    )
    return path


def watch_loading(browser: Any, world: World) -> None:
    """Lets each page that is loaded from now on set `loadTime`."""
    edges = sum(len(layer.edges) for layer in world.layers)
    script = WATCH_LOADING.replace("MODELS", str(len(world.models))).replace("EDGES", str(edges))
    browser.command("Page.addScriptToEvaluateOnNewDocument", source=script)
    browser.command("Network.enable")


def measure_starts(folder: Path) -> dict[str, float]:
    """Returns the least time to load the office over a slow network [s], cold and warm.

    A warm start finds the files of the page in the cache of the browser.
    """
    from chromium import Chromium

    times: dict[str, list[float]] = {"cold": [], "warm": []}
    with (
        World.from_yaml(OFFICE, seed=1) as world,
        WebViewer(port=0) as viewer,
        Chromium(folder, size=(1280, 800)) as browser,
    ):
        viewer.add_world(world, simulation=(simulation := Simulation(world, 200)))
        watch_loading(browser, world)
        thread = threading.Thread(target=simulation.run)
        thread.start()
        try:
            browser.command("Network.emulateNetworkConditions", offline=False, **SLOW)
            for _ in range(STARTS):
                browser.command("Network.clearBrowserCache")
                for start in times.values():
                    browser.open(viewer.url)
                    start.append(browser.until("window.loadTime") / 1e3)
        finally:
            simulation.stop()
            thread.join()
    return {kind: min(found) for kind, found in times.items()}


def measure(folder: Path) -> tuple[float, float, float, int]:
    """Returns the least time to load [s], the most frames per second, also of an empty canvas.

    The last value is the number of edges.
    """
    from chromium import Chromium

    with (
        World.from_yaml(write_world(folder), seed=1) as world,
        WebViewer(port=0) as viewer,
        Chromium(folder, size=(1280, 800)) as browser,
    ):
        for i in range(ROBOTS):
            world.command(f"/robot_{i}/cmd_vel").set(Twist(linear_x=0.3, angular_z=0.3))
        edges = len(world.layers[0].edges)
        simulation = Simulation(world, 200)
        viewer.add_world(world, simulation=simulation)
        watch_loading(browser, world)
        thread = threading.Thread(target=simulation.run)
        thread.start()
        try:
            browser.command("Network.setCacheDisabled", cacheDisabled=True)
            times = []
            for _ in range(LOADS):
                browser.open(viewer.url)
                times.append(browser.until("window.loadTime") / 1e3)
                time.sleep(0.5)  # between two loads, which otherwise overlap
            frames, empty = count_frames(browser)
        finally:
            simulation.stop()
            thread.join()
    return min(times), max(frames), max(empty), edges


def count_frames(browser: Any) -> tuple[list[float], list[float]]:
    """Returns the frames per second of the page, and in turn those of an empty canvas."""
    width, height = browser.evaluate(
        "((canvas) => [canvas.width, canvas.height])(document.querySelector('#canvas'))"
    )
    url = EMPTY.replace("WIDTH", str(width)).replace("HEIGHT", str(height)).replace("\n", "")
    frames, empty = [], []
    for _ in range(WINDOWS):
        with browser.new_tab(url):
            empty.append(browser.run_async(COUNT, WINDOW))
        browser.until("!document.hidden")
        browser.click("#fit")
        frames.append(browser.run_async(PAN, WINDOW))
    return frames, empty


def rows(_unit: float) -> list[Row]:
    """Measures how fast the page loads and draws."""
    # The harness of the tests, which also requires the extra `test`.
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))
    with tempfile.TemporaryDirectory() as folder:
        starts = measure_starts(Path(folder))
        loading, frames, empty, edges = measure(Path(folder))
    note = f"{edges} edges, {ROBOTS} robots; OpenGL without a graphics card"
    share = f"{note}; {frames / empty:.0%} of an empty canvas"
    network = "the office; round trips of 150 ms, 2 Mbit/s"
    return [
        Row("start of the page, slow network, empty cache", starts["cold"], "s", 4.0, note=network),
        Row("start of the page, slow network, again", starts["warm"], "s", 1.5, note=network),
        Row("loading of the page of the browser viewer", loading, "s", 1.0, note=note),
        Row("frames while the view pans", frames, "1/s", 30.0, at_least=True, note=share),
    ]
