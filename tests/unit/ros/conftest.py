"""A ROS master in the process of the tests."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from threading import Thread
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from free_ports import free_port


class RosMaster:
    """The master of roscore, without its process.

    Attributes:
        uri: Its address, which is that of the next one as well.
    """

    def __init__(self) -> None:
        self._address = ("127.0.0.1", free_port())
        self.uri = "http://{}:{}".format(*self._address)
        self.start()

    def start(self) -> None:
        """Starts a master without registrations and parameters."""
        from rosmaster.master_api import ROSMasterHandler

        self._server = SimpleXMLRPCServer(self._address, logRequests=False)
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
    # Its messages would be among those that a test compares.
    monkeypatch.setattr(logging.getLogger("rosmaster.master"), "disabled", True)
    for name in ("_master_proxy", "_param_server"):  # of another master
        monkeypatch.setattr(client, name, None)
    yield master
    master.stop()
