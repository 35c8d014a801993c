"""A headless Chromium for tests and pictures of the browser viewer.

Input is sent through the DevTools protocol, and passes through the same code of the browser as that
of a mouse, a keyboard or a touch screen. All coordinates are CSS pixels of the page.
"""

from __future__ import annotations

import base64
import contextlib
import json
import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final
from urllib.parse import urldefrag

import cv2
import numpy as np
import numpy.typing as npt
from devtools import DevTools, DevToolsError
from waiting import wait_until

Image = npt.NDArray[np.uint8]
Point = tuple[float, float]

PHONE: Final = (390, 844)  # CSS pixels
# Without a user interface, Chromium takes three quarters of the processor time. The program of that
# name in /usr/bin is a shell script that starts it.
_BROWSER: Final = "/usr/lib/chromium/chromium-headless-shell"
_FLAGS: Final = (
    "--disable-background-networking",
    "--disable-hang-monitor",
    "--disable-popup-blocking",
    "--no-first-run",
    "--no-sandbox",  # the sandbox does not start for root
    "--disable-dev-shm-usage",  # /dev/shm of containers is small
    "--use-angle=swiftshader",  # OpenGL without a graphics card
    "--enable-unsafe-swiftshader",
    "--disable-gpu-watchdog",  # it ends the process that draws if other programs are busy
    "--disable-gpu-compositing",  # of the page around the canvas, which the processor draws faster
    "--hide-scrollbars",
    "--force-color-profile=srgb",
)
_HARMLESS: Final = (
    "Page entered Back-Forward Cache.",  # the connection of a page that was left for another one
    "GPU stall due to ReadPixels",  # without GPU compositing, the browser reads the canvas
    "this message will no longer repeat",
    "Blocked autofocusing",  # in a frame of another page, whose focus remains
)
_EXCEPTION: Final = "Runtime.exceptionThrown"
_NEW_CONTEXT: Final = "Runtime.executionContextCreated"
_EVENTS: Final = (
    "Log.entryAdded",
    "Network.requestWillBeSent",
    "Network.webSocketCreated",
    "Page.lifecycleEvent",
    "Runtime.consoleAPICalled",
    _EXCEPTION,
    _NEW_CONTEXT,
)
# Key: code and virtual key code, for keys that are not a single letter or digit.
_KEYS: Final = {
    "ArrowUp": ("ArrowUp", 38),
    "ArrowDown": ("ArrowDown", 40),
    "ArrowLeft": ("ArrowLeft", 37),
    "ArrowRight": ("ArrowRight", 39),
    "Enter": ("Enter", 13),
    "Escape": ("Escape", 27),
    "Tab": ("Tab", 9),
    "Delete": ("Delete", 46),
    "Backspace": ("Backspace", 8),
    "Home": ("Home", 36),
    "End": ("End", 35),
    "Shift": ("ShiftLeft", 16),
    " ": ("Space", 32),
    ".": ("Period", 190),
    "+": ("NumpadAdd", 107),
    "-": ("Minus", 189),
    "?": ("Slash", 191),
}
_TEXTS: Final = {"Enter": "\r", "Tab": ""}
SHIFT: Final = 8  # modifier of key and mouse events
# Passes the centre of an element that can be clicked to the callback after the next frame.
_CENTER: Final = """
const [selector, done] = arguments;
const find = () => {
  const element = document.querySelector(selector);
  if (!element || !element.checkVisibility({visibilityProperty: true})) return null;
  element.scrollIntoView({block: "nearest", inline: "nearest"});
  const box = element.getBoundingClientRect();
  const x = box.x + box.width / 2, y = box.y + box.height / 2;
  const top = document.elementFromPoint(x, y);
  const isHit = top && (element.contains(top) || top.closest("label")?.control === element);
  return isHit ? [x, y] : null;
};
requestAnimationFrame(() => done(find()));
"""


def missing_programs() -> list[str]:
    """Returns the required programs that are not installed."""
    return [] if shutil.which(_BROWSER) else [_BROWSER]


class JavaScriptError(Exception):
    """A script has thrown an exception."""


class Chromium:
    """A headless browser; methods concern its current tab.

    Attributes:
        downloads: Folder of downloaded files.
    """

    def __init__(
        self, downloads: Path, *, size: tuple[int, int] = (1200, 800), flags: Iterable[str] = ()
    ) -> None:
        """Starts the browser.

        Args:
            downloads: Folder of downloaded files.
            size: Width and height of the page [CSS pixels].
            flags: More flags of Chromium.
        """
        self.downloads = downloads
        self._events: list[tuple[str, Any]] = []
        profile = f"--user-data-dir={downloads / 'profile'}"
        command = (_BROWSER, *_FLAGS, profile, *flags, "about:blank")
        self._tools = DevTools(command, downloads / "chromium.log", self._add_event)
        self._tools.call(
            "Browser.setDownloadBehavior",
            behavior="allow",
            downloadPath=str(downloads),
            eventsEnabled=False,
        )
        self._context: dict[str, str] = {}
        pages = self._tools.call("Target.getTargets")["targetInfos"]
        self._session = self._attach_to(pages[0]["targetId"])
        self.resize(*size)

    def _add_event(self, message: Any) -> None:
        if message.get("method") in _EVENTS:
            self._events.append((message["method"], message["params"]))

    def _attach_to(self, target: str) -> str:
        """Returns a session for a page."""
        attached = self._tools.call("Target.attachToTarget", targetId=target, flatten=True)
        session = str(attached["sessionId"])
        for domain in ("Page", "Runtime", "Log"):
            self._tools.call(f"{domain}.enable", session)
        self._tools.call("Page.setLifecycleEventsEnabled", session, enabled=True)
        return session

    def __enter__(self) -> Chromium:
        """Returns the browser, which is closed at the end of the block."""
        return self

    def __exit__(self, *_: object) -> None:
        """Closes the browser."""
        self.close()

    def close(self) -> None:
        """Ends the browser."""
        self._tools.close()

    def command(self, method: str, **parameters: Any) -> Any:
        """Calls a method of the DevTools protocol and returns its result."""
        return self._tools.call(method, self._session, **parameters)

    # -- the page --------------------------------------------------------------------------

    def open(self, url: str) -> None:
        """Loads a page, also if the address differs from the current one only in its fragment."""
        # Only then: each navigation costs a process of the browser.
        if urldefrag(self.url).url == urldefrag(url).url:
            self._load("about:blank")
        self._load(url)

    def _load(self, url: str) -> None:
        """Loads a page and waits until it is complete."""
        self._forget("Page.lifecycleEvent")
        self._forget(_NEW_CONTEXT)
        answer = self.command("Page.navigate", url=url)
        assert "errorText" not in answer, f"{url}: {answer['errorText']}"
        loader = answer["loaderId"]
        self._tools.wait_for(
            lambda: any(
                event.get("loaderId") == loader and event["name"] == "load"
                for event in self._forget("Page.lifecycleEvent")
            )
        )

    @property
    def url(self) -> str:
        """The address of the current page."""
        return str(self.evaluate("location.href"))

    @contextlib.contextmanager
    def frame(self) -> Iterator[None]:
        """Runs scripts in the only frame of the page for the duration of the block."""
        (frame,) = self.command("Page.getFrameTree")["frameTree"]["childFrames"]
        contexts = [event["context"] for event in self._forget(_NEW_CONTEXT)]
        found = [each for each in contexts if each["auxData"]["frameId"] == frame["frame"]["id"]]
        self._context = {"uniqueContextId": found[-1]["uniqueId"]}
        try:
            yield
        finally:
            self._context = {}

    @contextlib.contextmanager
    def new_tab(self, url: str) -> Iterator[None]:
        """Opens a page in a new tab, which is the current one for the duration of the block."""
        session = self._session
        target = self._tools.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._attach_to(target)
        try:
            self._load(url)
            yield
        finally:
            self._tools.call("Target.closeTarget", targetId=target)
            self._session = session

    @contextlib.contextmanager
    def minimized(self) -> Iterator[None]:
        """Hides the page for the duration of the block, as behind another tab."""
        self._set_window_state("minimized")
        try:
            yield
        finally:
            self._set_window_state("normal")

    def _set_window_state(self, state: str) -> None:
        window = self.command("Browser.getWindowForTarget")["windowId"]
        self.command("Browser.setWindowBounds", windowId=window, bounds={"windowState": state})

    def evaluate(self, expression: str, *arguments: Any) -> Any:
        """Returns the value of an expression of JavaScript; the arguments are `arguments[0]`, …."""
        return self.run(f"return ({expression});", *arguments)

    def run(self, script: str, *arguments: Any) -> Any:
        """Runs the body of a function of JavaScript, whose arguments are `arguments[0]`, ….

        Returns:
            The value that it returns; the page waits for a promise.

        Raises:
            JavaScriptError: The script has thrown an exception.
        """
        answer = self.command(
            "Runtime.evaluate",
            expression=f"(function () {{ {script}\n}}).apply(null, {json.dumps(arguments)})",
            awaitPromise=True,
            returnByValue=True,
            userGesture=True,
            **self._context,
        )
        if "exceptionDetails" in answer:
            raise JavaScriptError(_text_of(answer["exceptionDetails"]))
        result = answer["result"]
        if "unserializableValue" in result:
            return float(result["unserializableValue"].replace("Infinity", "inf"))
        return result.get("value")

    def run_async(self, script: str, *arguments: Any) -> Any:
        """Runs the body of a function and returns what it passes to its last argument."""
        return self.run(
            f"return new Promise((done) => {{ (function () {{ {script}\n}})"
            ".apply(null, [...arguments, done]); });",
            *arguments,
        )

    def until(self, expression: str, *arguments: Any) -> Any:
        """Waits until an expression, not of an element, is true, and returns its value."""
        try:
            return wait_until(
                expression, lambda: self.evaluate(expression, *arguments), poll_period=0.02
            )
        except BaseException as error:
            path = self.downloads / "not_fulfilled.png"
            with contextlib.suppress(DevToolsError, RuntimeError):
                cv2.imwrite(str(path), self.picture()[:, :, ::-1])
                error.add_note(f"the page is {self.url}, see {path}")
            raise

    def resize(self, width: int, height: int, *, touch: bool = False) -> None:
        """Sets the size of the page [CSS pixels], and whether it has a touch screen."""
        self.command(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=touch,
        )
        self.command("Emulation.setTouchEmulationEnabled", enabled=touch)

    def prefer(self, **features: str) -> None:
        """Sets media features, such as `prefers_color_scheme="dark"`; without any, resets them."""
        named = [{"name": k.replace("_", "-"), "value": v} for k, v in features.items()]
        self.command("Emulation.setEmulatedMedia", features=named)

    # -- what the user sees ----------------------------------------------------------------

    def picture(self) -> Image:
        """Returns a screenshot of the page as RGB, shape (height, width, 3)."""
        data = self.command("Page.captureScreenshot", format="png", optimizeForSpeed=True)["data"]
        encoded = np.frombuffer(base64.b64decode(data), np.uint8)
        image = cv2.imdecode(encoded, cv2.IMREAD_COLOR)
        assert image is not None
        return np.ascontiguousarray(image[:, :, ::-1])

    def picture_until(self, what: str, accept: Callable[[Image], Any]) -> Image:
        """Takes screenshots until one is accepted, and returns it; the check may assert."""
        images: list[Image] = []

        def accepted() -> bool:
            images[:] = [self.picture()]
            return bool(accept(images[0]))

        path = self.downloads / "rejected.png"
        try:
            wait_until(f"{what} (see {path})", accepted, poll_period=0.02)
        except BaseException:
            if images:
                cv2.imwrite(str(path), images[0][:, :, ::-1])
            raise
        return images[0]

    # -- input -----------------------------------------------------------------------------

    def mouse(
        self, kind: str, at: Point, *, button: str = "none", held: int = 0, modifiers: int = 0
    ) -> None:
        """Sends an event of the mouse; `kind` is Moved, Pressed or Released."""
        self.command(
            "Input.dispatchMouseEvent",
            type=f"mouse{kind}",
            x=at[0],
            y=at[1],
            button=button,
            buttons=held,
            clickCount=int(kind != "Moved"),
            modifiers=modifiers,
        )

    def click(self, at: Point | str, *, modifiers: int = 0) -> None:
        """Clicks at a point, or in the centre of the element of a CSS selector."""
        if isinstance(at, str):
            at = self.center(at)
        self.mouse("Moved", at, modifiers=modifiers)
        self.mouse("Pressed", at, button="left", held=1, modifiers=modifiers)
        self.mouse("Released", at, button="left", modifiers=modifiers)

    def press(self, at: Point, *, modifiers: int = 0) -> None:
        """Presses the left button of the mouse."""
        self.mouse("Moved", at, modifiers=modifiers)
        self.mouse("Pressed", at, button="left", held=1, modifiers=modifiers)

    def drag_over(self, points: Sequence[Point], *, modifiers: int = 0) -> None:
        """Moves the mouse over points while its left button is held."""
        for point in points:
            self.mouse("Moved", point, button="left", held=1, modifiers=modifiers)

    def release(self, at: Point, *, modifiers: int = 0) -> None:
        """Releases the left button of the mouse."""
        self.mouse("Released", at, button="left", modifiers=modifiers)

    def drag(self, start: Point, end: Point, *, steps: int = 4, modifiers: int = 0) -> None:
        """Drags with the left button of the mouse."""
        self.press(start, modifiers=modifiers)
        self.drag_over(line(start, end, steps), modifiers=modifiers)
        self.release(end, modifiers=modifiers)

    def wheel(self, at: Point, delta: float) -> None:
        """Turns the wheel of the mouse; a negative delta is away from the user [CSS pixels]."""
        self.command(
            "Input.dispatchMouseEvent", type="mouseWheel", x=at[0], y=at[1], deltaX=0, deltaY=delta
        )

    def touch(self, kind: str, *points: Point) -> None:
        """Sends an event of the touch screen; `kind` is Start, Move, End or Cancel.

        Args:
            kind: The kind of event.
            points: All fingers that touch the screen after the event.
        """
        fingers = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(points)]
        self.command("Input.dispatchTouchEvent", type=f"touch{kind}", touchPoints=fingers)

    def key_down(self, key: str, *, modifiers: int = 0) -> None:
        """Presses a key, such as `a` or `ArrowUp`."""
        text = _TEXTS.get(key, key if len(key) == 1 else "")
        self.command(
            "Input.dispatchKeyEvent",
            type="keyDown",
            modifiers=modifiers,
            text=text,
            unmodifiedText=text,
            **_key(key),
        )

    def key_up(self, key: str) -> None:
        """Releases a key."""
        self.command("Input.dispatchKeyEvent", type="keyUp", **_key(key))

    def key(self, key: str, *, modifiers: int = 0) -> None:
        """Presses and releases a key."""
        self.key_down(key, modifiers=modifiers)
        self.key_up(key)

    def type(self, text: str) -> None:
        """Types a text into the element that has the focus."""
        for character in text:
            self.key(character)

    def fill(self, selector: str, text: str) -> None:
        """Replaces the text of a field, as with the mouse and the keyboard."""
        self.click(selector)
        self.evaluate("document.activeElement.select()")
        self.type(text)

    def center(self, selector: str) -> Point:
        """Scrolls to the element of a CSS selector and returns its centre.

        It waits until the element is visible, has stopped moving, and nothing is in front of it.
        """
        last: list[Any] = [None]

        def settled() -> Any:
            before, last[0] = last[0], self.run_async(_CENTER, selector)
            return last[0] if last[0] == before else None

        x, y = wait_until(f"{selector} can be clicked", settled, poll_period=0.0)
        return x, y

    # -- logs ------------------------------------------------------------------------------

    def _forget(self, method: str) -> list[Any]:
        """Returns the events of a kind since the last call."""
        found = [event for kind, event in self._events if kind == method]
        self._events = [(kind, event) for kind, event in self._events if kind != method]
        return found

    def console(self) -> list[str]:
        """Returns the warnings and errors of the console since the last call."""
        self.evaluate("null")  # the events before it have then been received
        logged = [event["entry"] for event in self._forget("Log.entryAdded")]
        texts = [
            *(_text_of(event["exceptionDetails"]) for event in self._forget(_EXCEPTION)),
            *(
                " ".join(str(each.get("value", each.get("description"))) for each in event["args"])
                for event in self._forget("Runtime.consoleAPICalled")
                if event["type"] in ("warning", "error", "assert")
            ),
            *(
                f"{entry['text']} {entry.get('url', '')}"
                for entry in logged
                if entry["level"] in ("warning", "error")
            ),
        ]
        return [text for text in texts if not any(harmless in text for harmless in _HARMLESS)]

    @contextlib.contextmanager
    def requests(self) -> Iterator[list[str]]:
        """Yields a list that contains, after the block, the addresses of its requests."""
        urls: list[str] = []
        self.command("Network.enable")
        yield urls
        self.command("Network.disable")
        urls += [event["request"]["url"] for event in self._forget("Network.requestWillBeSent")]
        urls += [event["url"] for event in self._forget("Network.webSocketCreated")]

    def downloaded(self, pattern: str) -> Path:
        """Waits for a complete download whose name matches a pattern, and returns its path."""

        def found() -> Path | None:
            # The browser reserves the name with an empty file.
            return next(
                (path for path in self.downloads.glob(pattern) if path.stat().st_size), None
            )

        return Path(wait_until(f"a download {pattern}", found))


def line(start: Point, end: Point, steps: int) -> list[Point]:
    """Returns points from `start` (exclusive) to `end` (inclusive)."""
    fractions = [i / steps for i in range(1, steps + 1)]
    return [
        (start[0] + f * (end[0] - start[0]), start[1] + f * (end[1] - start[1])) for f in fractions
    ]


def _text_of(details: Any) -> str:
    """Returns the text of an exception of JavaScript."""
    return str(details.get("exception", {}).get("description") or details["text"])


def _key(key: str) -> dict[str, Any]:
    code, number = _KEYS.get(key) or (
        f"{'Digit' if key.isdigit() else 'Key'}{key.upper()}" if key.isalnum() else "",
        ord(key.upper()),
    )
    return {"key": key, "code": code, "windowsVirtualKeyCode": number}


# -- pixels --------------------------------------------------------------------------------


def mask(image: Image, color: Sequence[int], tolerance: float = 0.15) -> npt.NDArray[np.bool_]:
    """Returns which pixels have the hue of a colour; lines and areas may blend with the background.

    Args:
        image: RGB image, shape (height, width, 3).
        color: Red, green and blue, 0 to 255, not grey.
        tolerance: Maximum difference of a component of the hue, whose components are 0 to 1.
    """
    wanted, _ = _hue(np.array(color, float))
    found, strength = _hue(image.astype(float))
    return (strength > 60) & (np.abs(found - wanted).max(axis=-1) < tolerance)


def _hue(colors: npt.NDArray[np.float64]) -> tuple[Any, Any]:
    """Returns the hue of each colour, and its strength relative to grey."""
    colored = colors - colors.min(axis=-1, keepdims=True)
    strength = colored.max(axis=-1)
    return colored / np.maximum(strength, 1.0)[..., None], strength


def centroid(image: Image, color: Sequence[int], *, least: int = 30) -> Point:
    """Returns the mean position of the pixels of a colour.

    Raises:
        AssertionError: There are less than `least` such pixels.
    """
    rows, columns = np.nonzero(mask(image, color))
    assert len(rows) >= least, f"{len(rows)} pixels have the colour {tuple(color)}"
    return float(columns.mean()) + 0.5, float(rows.mean()) + 0.5


@contextlib.contextmanager
def keys_held(browser: Chromium, *keys: str) -> Iterator[None]:
    """Holds keys for the duration of the block."""
    for key in keys:
        browser.key_down(key)
    try:
        yield
    finally:
        for key in reversed(keys):
            browser.key_up(key)
