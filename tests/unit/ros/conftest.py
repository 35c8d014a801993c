"""A ROS master in the process of the tests."""

from __future__ import annotations

from collections.abc import Iterator
from threading import Thread
from xmlrpc.server import SimpleXMLRPCServer

import pytest


class RosMaster:
    """The master of roscore, without its process.

    Attributes:
        uri: Its address, which is that of the next one as well.
    """

    def __init__(self) -> None:
        self._address = ("127.0.0.1", 0)
        self.start()
        self.uri = "http://{}:{}".format(*self._address)

    def start(self) -> None:
        """Starts a master without registrations and parameters."""
        from rosmaster.master_api import ROSMasterHandler

        self._server = SimpleXMLRPCServer(self._address, logRequests=False)
        self._address = self._server.server_address  # type: ignore[assignment]
        self._server.register_instance(ROSMasterHandler(1))
        self._server.register_multicall_functions()
        Thread(target=self._server.serve_forever, args=(0.01,), daemon=True).start()

    def stop(self) -> None:
        """Refuses connections from now on."""
        self._server.shutdown()
        self._server.server_close()


@pytest.fixture
def master(monkeypatch: pytest.MonkeyPatch) -> Iterator[RosMaster]:
    """A master that rospy uses."""
    client = pytest.importorskip("rospy.client", reason="ROS is not installed")
    master = RosMaster()
    monkeypatch.setenv("ROS_MASTER_URI", master.uri)
    for name in ("_master_proxy", "_param_server"):  # of another master
        monkeypatch.setattr(client, name, None)
    yield master
    master.stop()
