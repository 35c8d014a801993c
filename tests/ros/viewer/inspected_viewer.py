"""The viewer with a socket for queries of its visible widgets: their areas, texts and states.

The path of the socket is the first argument. A query is one line with the name or the class of
widgets; the reply is one line of JSON. The viewer is controlled through the X server. Only its
frame rate is changed, since the processor draws the screen.
"""

from __future__ import annotations

import json
import socket
import sys
import threading
from pathlib import Path
from typing import Any

from PyQt5.QtCore import QObject, QPoint, pyqtSignal
from PyQt5.QtWidgets import QApplication, QWidget

from flatland.viewer import rviz_panel
from flatland.viewer.app import main

rviz_panel._CONFIG = rviz_panel._CONFIG.replace("Frame Rate: 30", "Frame Rate: 8")


class Inspector(QObject):
    """Replies to queries, in the window's thread."""

    query_received = pyqtSignal(str)

    def __init__(self) -> None:
        super().__init__()
        self.query_received.connect(self.reply)
        threading.Thread(target=self.listen, daemon=True).start()

    def listen(self) -> None:
        with socket.socket(socket.AF_UNIX) as server:
            # The viewer may have been started again after a crash.
            Path(sys.argv[1]).unlink(missing_ok=True)
            server.bind(sys.argv[1])
            server.listen()
            print("the window is up", flush=True)
            connection, _ = server.accept()
        # rospy sets a default timeout for sockets, but queries may be minutes apart.
        connection.settimeout(None)
        self.stream = connection.makefile("rw")
        for line in self.stream:
            self.query_received.emit(line.strip())

    def reply(self, name: str) -> None:
        print(json.dumps([describe(widget) for widget in find(name)]), file=self.stream, flush=True)


def find(name: str) -> list[QWidget]:
    """Returns the visible widgets with a name or a class."""
    return [
        widget
        for widget in QApplication.allWidgets()
        if widget.isVisible() and name in (widget.objectName(), widget.metaObject().className())
    ]


def describe(widget: Any) -> dict[str, Any]:
    corner = widget.mapToGlobal(QPoint(0, 0))
    return {
        "x": corner.x(),
        "y": corner.y(),
        "width": widget.width(),
        "height": widget.height(),
        "text": widget.text() if hasattr(widget, "text") else "",
        "value": widget.value() if hasattr(widget, "value") else None,
        "enabled": widget.isEnabled(),
        "checked": widget.isChecked() if hasattr(widget, "isChecked") else None,
        "title": widget.windowTitle(),
        # Keys go to the active window, and in it to the widget that has the focus.
        "active": widget.isActiveWindow(),
        "focus": widget.hasFocus(),
    }


class InspectedApplication(QApplication):
    """Starts the inspector with the event loop."""

    def exec_(self) -> int:
        self.inspector = Inspector()
        return int(super().exec_())


if __name__ == "__main__":
    import PyQt5.QtWidgets

    PyQt5.QtWidgets.QApplication = InspectedApplication
    sys.exit(main())
