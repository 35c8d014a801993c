"""Clients that are killed, never read, send rubbish or open thousands of connections."""

from __future__ import annotations

import contextlib
import resource
import socket
import struct
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import pytest
import tcpros
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool, String
from std_srvs.srv import Empty, Trigger
from tcpros import ServiceClient, is_closed
from waiting import TIMEOUT, wait_until

from flatland.srv import DeleteModel

NODE = "/flatland_server"
CLIENTS = 20
CALLS = 20  # of each client
CONNECTIONS = 2000
MAX_FILES = 300  # of the node in the test with many connections


def count_files(pid: int) -> int:
    """Returns the number of open files of a process."""
    return sum(1 for _ in Path(f"/proc/{pid}/fd").iterdir())


class Node:
    """The node under test, its ports, and what the system says about its process."""

    def __init__(self, process: Any, master: Any) -> None:
        self.process = process
        self.master = master
        self.uri = tcpros.node_uri(master, NODE)
        self.xmlrpc = tcpros.xmlrpc_address(master, NODE)
        self.tcpros = tcpros.service_address(master, "/delete_model")
        self.pid = ServerProxy(self.uri).getPid("/test")[2]

    def status(self, field: str) -> int:
        """Returns a number of /proc/PID/status, as Threads."""
        for line in Path(f"/proc/{self.pid}/status").read_text().splitlines():
            if line.startswith(field + ":"):
                return int(line.split()[1])
        raise KeyError(field)

    def files(self) -> int:
        """Returns the number of open files."""
        return count_files(self.pid)

    def open_files(self) -> list[str]:
        """Returns what is open, for the message of a failure."""
        opened = []
        for path in Path(f"/proc/{self.pid}/fd").iterdir():
            with contextlib.suppress(FileNotFoundError):
                opened.append(str(path.readlink()))
        return opened

    def connections(self) -> str:
        """Returns the connections of all topics, with the names of the other nodes."""
        return str(ServerProxy(self.uri).getBusInfo("/test"))

    def settled(self) -> tuple[int, int]:
        """Returns the numbers of files and threads once they do not change any more."""
        last: list[tuple[int, int]] = []

        def is_settled() -> bool:
            last.append((self.files(), self.status("Threads")))
            return len(last) > 1 and last[-1] == last[-2]

        wait_until("settled numbers of files and threads", is_settled, poll_period=0.3)
        return last[-1]

    def delete(self, name: str) -> str:
        """Calls /delete_model over a new connection and returns the message."""
        client = ServiceClient(self.tcpros, "/delete_model", DeleteModel, persistent=False)
        return str(client.call(name).message)

    def assert_serves(self) -> None:
        """Asserts that new clients of services, topics and of XML-RPC are served."""
        assert 'model with name "nobody" does not exist' in self.delete("nobody")
        subscriber = tcpros.Subscriber(self.master, "/clock", Clock, node=NODE)
        assert len(tcpros.read_frame(subscriber.socket)) == 8
        subscriber.socket.close()
        assert ServerProxy(self.uri).getPid("/test") == [1, "", self.pid]
        assert self.process.running
        assert "Traceback" not in self.process.output
        assert "[ERROR]" not in self.process.output


@pytest.fixture(scope="module")
def node(module_launcher: Any, module_ros: Any, write_world: Callable[..., Path]) -> Node:
    world = write_world("[{name: robot, model: robot.model.yaml}]")
    return Node(module_launcher.server(world, update_rate=20), module_ros.master)


@pytest.fixture
def connections() -> Iterator[list[socket.socket]]:
    """Connections that are closed at the end of the test."""
    opened: list[socket.socket] = []
    yield opened
    for connection in opened:
        connection.close()


# -- calls ---------------------------------------------------------------------------------


def test_many_clients_are_answered_in_order(node: Node) -> None:
    start = threading.Barrier(CLIENTS)

    def call(client: int) -> list[str]:
        """Half of the clients send all requests at once, over one connection."""
        names = [f"{client}-{number}" for number in range(CALLS)]
        persistent = client % 2 == 0
        service = ServiceClient(node.tcpros, "/delete_model", DeleteModel, persistent=persistent)
        start.wait()
        if persistent:
            service.send([(name,) for name in names])
            messages = [service.receive().message for _ in names]
        else:
            messages = [service.call(name).message for name in names]
        service.close()
        return messages

    with ThreadPoolExecutor(CLIENTS) as pool:
        answers = list(pool.map(call, range(CLIENTS)))
    for client, messages in enumerate(answers):
        assert [message.split('"')[1] for message in messages] == [
            f"{client}-{number}" for number in range(CALLS)
        ]
    node.assert_serves()


# -- subscribers ---------------------------------------------------------------------------

STATE_TOPIC = (f"{NODE}/paused", Bool)
TOPICS = (("/clock", Clock), ("/scan", LaserScan), STATE_TOPIC)


def _lose_subscribers(node: Node, topics: tuple[tuple[str, type[Any]], ...]) -> None:
    """Connects to topics, and ends the connections as the system does for a process that ends."""
    subscribers = [
        tcpros.Subscriber(node.master, name, kind, node=NODE, callerid="/killed")
        for name, kind in topics
    ]
    wait_until("all connections", lambda: node.connections().count("/killed") == len(topics))
    for subscriber in subscribers:
        subscriber.socket.close()
    wait_until("their end", lambda: "/killed" not in node.connections())


@pytest.mark.parametrize("paused", [False, True])
def test_lost_subscribers_leave_nothing_behind(node: Node, ros: Any, paused: bool) -> None:
    topics = TOPICS
    if paused:
        ros.call("/pause", Empty)
        topics = (STATE_TOPIC,)  # the only one that sends messages
    try:
        # The first one has lasting effects: connections of XML-RPC that are kept for later calls.
        _lose_subscribers(node, topics)
        before = node.settled()
        for _ in range(5):
            _lose_subscribers(node, topics)

        def is_as_before() -> bool:
            # Calls at the same time may keep one connection more than before; a leak is five.
            assert node.files() <= before[0] + 1, node.open_files()
            assert node.status("Threads") <= before[1] + 1
            return True

        wait_until("files and threads as before", is_as_before)
    finally:
        ros.call("/resume", Empty)
    node.assert_serves()


# -- rubbish -------------------------------------------------------------------------------

RUBBISH = [
    b"\x00" * 64,
    b"\xff" * 64,
    b"GET / HTTP/1.1\r\n\r\n",
    b"\x10\x00\x00\x00\x00\x00\x00\x00" + b"a" * 12,
    b"\x08\x00\x00\x00\x04\x00\x00\x00\xff\xfe=\xfd",
    b"\x08\x00\x00\x00\xff\x00\x00\x00a=b!",
    tcpros.header({"hello": "world"}),
    tcpros.header({"topic": "/clock"}),
    tcpros.header({"service": "/delete_model"}),
    tcpros.header({"topic": "/nothing", "md5sum": "*", "callerid": "/rubbish", "type": "*"}),
    tcpros.header({"service": "/nothing", "md5sum": "*", "callerid": "/rubbish"}),
]


@pytest.mark.parametrize("data", RUBBISH, ids=range(len(RUBBISH)))
def test_rubbish_on_the_port_of_tcpros(
    node: Node, connections: list[socket.socket], data: bytes
) -> None:
    connections.append(tcpros.connect(node.tcpros))
    connections[0].sendall(data)
    assert is_closed(connections[0])
    node.assert_serves()


def test_half_headers_block_no_other_client(node: Node, connections: list[socket.socket]) -> None:
    header = tcpros.header({"topic": "/clock", "callerid": "/half"})
    for size in (0, 1, 4, 5, len(header) - 1):
        connections.append(tcpros.connect(node.tcpros))
        connections[-1].sendall(header[:size])
    request = b"POST / HTTP/1.1\r\nHost: node\r\nContent-Length: 1000\r\n\r\n<?xml"
    for size in (0, 1, 20, len(request)):
        connections.append(tcpros.connect(node.xmlrpc))
        connections[-1].sendall(request[:size])
    node.assert_serves()


@pytest.mark.parametrize(
    "data",
    [
        b"\x00\xff\x00\xff\r\n\r\n",
        b"GET / HTTP/1.1\r\n\r\n",
        b"POST / HTTP/1.0\r\nContent-Length: 7\r\n\r\nrubbish",
        b"POST / HTTP/1.0\r\nContent-Length: many\r\n\r\nrubbish",
        b"POST / HTTP/1.0\r\nContent-Length: 99999999999\r\n\r\nrubbish",
        b"POST / HTTP/1.0\r\n\r\n",
    ],
    ids=range(6),
)
def test_rubbish_on_the_port_of_xmlrpc(
    node: Node, connections: list[socket.socket], data: bytes
) -> None:
    connections.append(tcpros.connect(node.xmlrpc))
    connections[0].sendall(data)
    answer = connections[0].recv(4096)
    assert answer == b"" or answer.startswith((b"HTTP/1", b"<!DOCTYPE", b"<?xml"))
    connections[0].close()
    node.assert_serves()


EMPTY_REQUEST = b"\x00\x00\x00\x00"


@pytest.mark.parametrize(
    "data",
    [EMPTY_REQUEST, b"\x04\x00\x00\x00\xff\xff\xff\xff", b"\x02\x00\x00\x00ab"],
    ids=range(3),
)
def test_rubbish_request_of_a_service(
    node: Node, connections: list[socket.socket], data: bytes
) -> None:
    fields = {"callerid": "/rubbish", "service": "/delete_model", "md5sum": "*"}
    connections.append(tcpros.connect(node.tcpros))
    connections[0].sendall(tcpros.header(fields))
    tcpros.read_frame(connections[0])
    connections[0].sendall(data)
    assert is_closed(connections[0])
    if data == EMPTY_REQUEST:
        node.process.wait_for_line(r"\[WARN\].*closed the connection of a client: ")
    node.assert_serves()


@pytest.mark.parametrize("is_reset", [False, True])
@pytest.mark.parametrize("data", [b"", b"\x0a", b"\x0a\x00\x00\x00\x06\x00\x00\x00no"])
def test_a_client_that_ends_within_its_call_is_no_error(
    node: Node, data: bytes, is_reset: bool
) -> None:
    """As programs that only find out whether a service exists."""
    connection = tcpros.connect(node.tcpros)
    fields = {"callerid": "/brief", "service": "/delete_model", "md5sum": "*"}
    connection.sendall(tcpros.header(fields))
    tcpros.read_frame(connection)
    connection.sendall(data)
    if is_reset:
        linger = struct.pack("ii", 1, 0)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
    before = node.settled()
    connection.close()
    wait_until("the end of the thread", lambda: node.status("Threads") < before[1])
    node.assert_serves()


# -- wrong MD5 sums ------------------------------------------------------------------------


def test_wrong_md5_of_a_topic_is_refused(node: Node, ros: Any) -> None:
    subscriber = tcpros.Subscriber(ros.master, "/clock", String, callerid="/mistaken")
    assert (
        b"error=topic types do not match: [std_msgs/String] vs. [rosgraph_msgs/Clock]"
        in subscriber.response
    )
    assert is_closed(subscriber.socket)
    subscriber = tcpros.Subscriber(
        ros.master, "/clock", Clock, callerid="/mistaken", md5sum="0" * 32
    )
    assert b"error=Client [/mistaken] wants topic [/clock] to have" in subscriber.response
    assert is_closed(subscriber.socket)
    node.process.wait_for_line(r"\[WARN\].*refused a connection of /mistaken: Client \[/mistaken\]")
    node.assert_serves()


def test_wrong_md5_of_a_service_is_refused(node: Node, connections: list[socket.socket]) -> None:
    fields = {"callerid": "/mistaken", "service": "/delete_model", "md5sum": Trigger._md5sum}
    connections.append(tcpros.connect(node.tcpros))
    connections[0].sendall(tcpros.header(fields))
    assert b"error=request from [/mistaken]: md5sums do not match: " in tcpros.read_frame(
        connections[0]
    )
    assert is_closed(connections[0])
    node.assert_serves()


# -- many connections ----------------------------------------------------------------------


def test_many_connections_that_are_left_open(
    launcher: Any,
    server_path: str,
    ros: Any,
    write_world: Callable[..., Path],
    connections: list[socket.socket],
) -> None:
    """The node has no more than `MAX_FILES` files, and closes the oldest connections."""
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    process = launcher.program(
        "bash",
        "-c",
        f'ulimit -n {MAX_FILES}; exec "$0" "$@"',
        server_path,
        f"_world_path:={write_world()}",
        "__name:=crowded",
        "delete_model:=/crowded/delete_model",
        f"_shutdown_timeout:={TIMEOUT}",
    )
    process.wait_for_line("loaded")
    wait_until(
        "the node", lambda: ros.registered_now("/crowded")["services"] >= {"/crowded/delete_model"}
    )
    tcpros_address = tcpros.service_address(ros.master, "/crowded/delete_model")
    xmlrpc_address = tcpros.xmlrpc_address(ros.master, "/crowded")
    for number in range(CONNECTIONS):
        connections.append(tcpros.connect(tcpros_address if number % 10 else xmlrpc_address))
    client = ServiceClient(tcpros_address, "/crowded/delete_model", DeleteModel, persistent=False)
    assert 'model with name "nobody" does not exist' in client.call("nobody").message
    uri = tcpros.node_uri(ros.master, "/crowded")
    code, _, pid = ServerProxy(uri).getPid("/test")
    assert code == 1
    assert count_files(pid) <= MAX_FILES

    # So are those with a complete header.
    for connection in connections:
        connection.close()
    subscribers = [
        tcpros.Subscriber(ros.master, "/clock", Clock, node="/crowded", callerid=f"/client_{n}")
        for n in range(100)
    ]
    connections += [subscriber.socket for subscriber in subscribers]
    refused = [s for s in subscribers if b"the node has 75 connections already" in s.response]
    assert len(refused) >= 25
    assert process.output.count("connections already") < len(refused)
    for connection in connections:
        connection.close()
    client.close()

    def is_served() -> bool:
        client = ServiceClient(
            tcpros_address, "/crowded/delete_model", DeleteModel, persistent=False
        )
        # A refused connection ends before the request is read, which may reset it.
        with contextlib.suppress(ConnectionError):
            return 'model with name "nobody" does not exist' in client.call("nobody").message
        return False

    wait_until("a call", is_served)
    assert "Traceback" not in process.output
    assert process.stop() == 0
