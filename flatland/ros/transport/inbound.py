"""Connections of ROS clients to the node, accepted so that no client can block the others.

rospy accepts connections and reads the header of each in one thread without a time limit: one
client that sends half a header blocks all others, and the thread ends when the process has no file
descriptors left. The XML-RPC server of rospy has a thread for each connection, without any limit.
"""

from __future__ import annotations

import logging
import resource
import select
import socket
import struct
import threading
import time
import weakref
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, Final

import rosgraph.xmlrpc
import rospy.impl.tcpros_base
from rosgraph.network import (
    ROSHandshakeException,
    decode_ros_handshake_header,
    write_ros_handshake_header,
)

from flatland.runtime.client_limits import (
    ACCEPTED_AT_ONCE,
    EXHAUSTED,
    EXHAUSTED_PERIOD,
    LimitedLog,
    connection_limit,
)

_LOG = logging.getLogger("flatland")

HANDSHAKE_TIMEOUT: Final = 10.0  # s from the connection to its complete header
REQUEST_TIMEOUT: Final = 30.0  # s between two parts of a request of XML-RPC
MAX_CONNECTIONS: Final = 256  # with an incomplete header, and as many of XML-RPC
MAX_CLIENTS: Final = 16_384  # connections of subscribers and service clients
MAX_HEADER_SIZE: Final = 1 << 20  # bytes
MAX_REQUEST_SIZE: Final = 1 << 24  # bytes, of XML-RPC
_MAX_FILES: Final = 65_536  # file descriptors that are requested from the system
_BACKLOG: Final = 1024  # connections that wait to be accepted
_POLL_PERIOD: Final = 0.5  # s between two checks of the time limits
_CLOSE_PERIOD: Final = 0.005  # s, for a thread to close its connection
_SIZE: Final = struct.Struct("<I")


def install() -> None:
    """Makes rospy use the servers of this module; must be called before `rospy.init_node`.

    Raises the limit of open files as well, because some systems allow 1024 of them by default.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft != resource.RLIM_INFINITY:
        wanted = _MAX_FILES if hard == resource.RLIM_INFINITY else min(hard, _MAX_FILES)
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, wanted), hard))
    rospy.impl.tcpros_base.TCPServer = TcprosServer
    rosgraph.xmlrpc.ThreadingXMLRPCServer = XmlRpcServer


class _Handshake:
    """A connection whose header is incomplete.

    Attributes:
        socket: The connection, not blocking.
        address: Address of the client.
        deadline: Time at which the connection is closed (`time.monotonic`) [s].
    """

    def __init__(self, connection: socket.socket, address: tuple[Any, ...]) -> None:
        connection.setblocking(False)
        self.socket = connection
        self.address = address
        self.deadline = time.monotonic() + HANDSHAKE_TIMEOUT
        self._data = bytearray()

    def read(self) -> dict[str, str] | None:
        """Reads what has arrived of the header and nothing beyond it.

        Returns:
            The fields of the header, None if it is incomplete.

        Raises:
            ROSHandshakeException: The data is not a header.
            OSError: The connection is broken.
        """
        while True:
            missing = self._missing()
            if not missing:
                break
            try:
                part = self.socket.recv(missing)
            except BlockingIOError:
                return None
            if not part:
                raise ConnectionResetError("closed before its header was complete")
            self._data += part
        try:
            fields: dict[str, str] = decode_ros_handshake_header(bytes(self._data))
        except (struct.error, UnicodeDecodeError) as error:
            raise ROSHandshakeException(str(error)) from error
        return fields

    def _missing(self) -> int:
        """Returns the number of bytes to read next, 0 if the header is complete."""
        if len(self._data) < _SIZE.size:
            return _SIZE.size - len(self._data)
        (size,) = _SIZE.unpack_from(self._data)
        if size > MAX_HEADER_SIZE:
            raise ROSHandshakeException(f"header of {size} bytes")
        return int(size) + _SIZE.size - len(self._data)


class TcprosServer(rospy.impl.tcpros_base.TCPServer):  # type: ignore[misc]
    """Accepts connections of subscribers and service clients in one thread.

    Headers are read as they arrive. A connection is closed if its header is not complete within
    `HANDSHAKE_TIMEOUT`, or, as the oldest one, if more than `MAX_CONNECTIONS` headers are
    incomplete or no file descriptors are left. A connection with a complete header is refused if
    there are `MAX_CLIENTS` others.
    """

    def _create_server_sock(self) -> socket.socket:
        server: socket.socket = super()._create_server_sock()
        server.listen(_BACKLOG)
        server.setblocking(False)
        return server

    def run(self) -> None:
        """Accepts connections until the node ends; called by rospy in a separate thread."""
        self._warnings = LimitedLog()
        self._pending: dict[int, _Handshake] = {}  # by file descriptor, the oldest first
        self._max_pending = connection_limit(MAX_CONNECTIONS)
        self._clients: weakref.WeakSet[socket.socket] = weakref.WeakSet()
        self._max_clients = connection_limit(MAX_CLIENTS)
        self._poll = select.epoll()
        server = self.server_sock.fileno()
        self._poll.register(server, select.EPOLLIN)
        while not self.is_shutdown:
            try:
                self._serve(server)
            except Exception:
                if not self.is_shutdown:
                    _LOG.exception("cannot accept connections of ROS clients")
                    time.sleep(EXHAUSTED_PERIOD)

    def _serve(self, server: int) -> None:
        """Waits for events of the server and of incomplete connections, and handles them."""
        for number, _ in self._poll.poll(_POLL_PERIOD):
            if number == server:
                self._accept()
            elif number in self._pending:
                self._read(self._pending[number])
        now = time.monotonic()
        while self._pending and next(iter(self._pending.values())).deadline < now:
            self._drop_oldest()

    def _accept(self) -> None:
        for _ in range(ACCEPTED_AT_ONCE):
            try:
                handshake = _Handshake(*self.server_sock.accept())
            except BlockingIOError:
                return
            except OSError as error:
                if error.errno in EXHAUSTED:
                    self._warnings.warn(f"cannot accept connections of ROS clients: {error}")
                    if not self._drop_oldest():
                        time.sleep(EXHAUSTED_PERIOD)
                return
            if len(self._pending) >= self._max_pending:
                self._drop_oldest()
            number = handshake.socket.fileno()
            self._pending[number] = handshake
            self._poll.register(number, select.EPOLLIN)

    def _read(self, handshake: _Handshake) -> None:
        try:
            header = handshake.read()
            if header is None:
                return
        except OSError:
            self._forget(handshake)
            handshake.socket.close()
        except ROSHandshakeException as error:
            self._forget(handshake)
            handshake.socket.close()
            host = handshake.address[0]
            self._warnings.warn(f"closed a connection from {host}: not a header of TCPROS: {error}")
        else:
            self._forget(handshake)
            self._connect(handshake, header)

    def _connect(self, handshake: _Handshake, header: dict[str, str]) -> None:
        """Passes a connection to the topic or service that its header names."""
        connection, address = handshake.socket, handshake.address
        connection.setblocking(True)
        client = header.get("callerid", address[0])
        handlers = self.inbound_handler.__self__
        try:
            if self._is_full():
                refusal = f"the node has {self._max_clients} connections already"
                client = address[0]  # The log would not recognize the same warning for others.
            elif "topic" in header:
                refusal = handlers.topic_connection_handler(connection, address, header)
            elif "service" in header:
                refusal = handlers.service_connection_handler(connection, address, header)
            else:
                refusal = "no topic or service name detected"
            if refusal:
                if rospy.core.is_shutdown_requested():
                    refusal = "node shutting down"
                else:
                    self._warnings.warn(f"refused a connection of {client}: {refusal}")
                write_ros_handshake_header(connection, {"error": refusal})
                connection.close()
            else:
                self._clients.add(connection)
        except Exception as error:
            connection.close()
            if not rospy.core.is_shutdown_requested():
                self._warnings.warn(f"a connection from {address[0]} failed: {error}")

    def _is_full(self) -> bool:
        if len(self._clients) >= self._max_clients:
            is_open = [client for client in self._clients if client.fileno() >= 0]
            self._clients = weakref.WeakSet(is_open)
        return len(self._clients) >= self._max_clients

    def _forget(self, handshake: _Handshake) -> None:
        number = handshake.socket.fileno()
        del self._pending[number]
        self._poll.unregister(number)

    def _drop_oldest(self) -> bool:
        """Closes the oldest connection without a complete header; returns whether there is one."""
        if not self._pending:
            return False
        handshake = next(iter(self._pending.values()))
        self._forget(handshake)
        handshake.socket.close()
        host = handshake.address[0]
        self._warnings.warn(f"closed a connection from {host}: its header is not complete")
        return True


class _RequestHandler(rosgraph.xmlrpc.SilenceableXMLRPCRequestHandler):  # type: ignore[misc]
    """Handles the requests of one connection; closes one that sends nothing for some time."""

    timeout = REQUEST_TIMEOUT

    def do_POST(self) -> None:  # noqa: N802
        """Handles one request, unless it is too large."""
        with suppress(ValueError):
            if int(self.headers.get("content-length", 0)) > MAX_REQUEST_SIZE:
                self.send_error(413)  # also closes the connection
                return
        with self.server.handling(self.request):
            super().do_POST()


class XmlRpcServer(rosgraph.xmlrpc.ThreadingXMLRPCServer):  # type: ignore[misc]
    """Handles requests of other nodes and of the master, in a thread for each connection.

    If there are more than `MAX_CONNECTIONS`, or no file descriptors are left, the connection that
    has been without a request for the longest time is closed. Its client connects again when
    necessary.
    """

    def __init__(self, address: tuple[str, int], log_requests: int = 1) -> None:
        """Creates a server; called by rospy.

        Args:
            address: Address and port, 0 for any.
            log_requests: Whether to log each request.
        """
        self._warnings = LimitedLog()
        self._max_connections = connection_limit(MAX_CONNECTIONS)
        self._lock = threading.Lock()
        self._idle: dict[socket.socket, None] = {}  # the oldest first
        self._busy: set[socket.socket] = set()
        super().__init__(address, log_requests)
        self.RequestHandlerClass = _RequestHandler

    def get_request(self) -> tuple[socket.socket, Any]:
        """Accepts a connection.

        Raises:
            OSError: No connection can be accepted; the caller tries again.
        """
        try:
            accepted: tuple[socket.socket, Any] = super().get_request()
        except OSError as error:
            if error.errno in EXHAUSTED:
                self._warnings.warn(f"cannot accept connections of ROS clients: {error}")
                time.sleep(_CLOSE_PERIOD if self._drop_oldest() else EXHAUSTED_PERIOD)
            raise
        with self._lock:
            self._idle[accepted[0]] = None
            is_full = len(self._idle) + len(self._busy) > self._max_connections
        if is_full:
            self._drop_oldest()
        return accepted

    @contextmanager
    def handling(self, connection: socket.socket) -> Iterator[None]:
        """Protects a connection for the duration of a request."""
        with self._lock:
            self._idle.pop(connection, None)
            self._busy.add(connection)
        try:
            yield
        finally:
            with self._lock:
                self._busy.discard(connection)
                self._idle[connection] = None

    def close_request(self, request: socket.socket) -> None:
        """Closes a connection."""
        with self._lock:
            self._idle.pop(request, None)
            self._busy.discard(request)
        super().close_request(request)

    def _drop_oldest(self) -> bool:
        """Ends the connection without a request for the longest time; returns whether it exists.

        Its thread closes it.
        """
        with self._lock:
            connection = next(iter(self._idle), None)
            if connection is None:
                return False
            del self._idle[connection]
        with suppress(OSError):
            connection.shutdown(socket.SHUT_RDWR)
        return True
