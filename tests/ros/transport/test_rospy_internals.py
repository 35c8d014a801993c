"""The internals of rospy that flatland depends on.

A test that fails here shows what a new version of rospy changed; docs/architecture.md
lists the modules that are affected.
"""

from __future__ import annotations

import inspect
import socket
import struct
import sys
from collections.abc import Callable, Iterator
from io import BytesIO
from typing import Any

import pytest
import rosgraph.xmlrpc
import rospy
import rospy.impl.rosout
from geometry_msgs.msg import PointStamped
from programs import run_program
from rospy.impl import registration, tcpros_base
from rospy.impl.paramserver import ParamServerCache
from rospy.impl.tcpros_base import TCPROSTransport
from rospy.impl.tcpros_pubsub import TCPROSHandler, TCPROSPub
from rospy.msg import serialize_message
from rospy.topics import _PublisherImpl, _SubscriberImpl, _TopicImpl, _TopicManager
from std_msgs.msg import Header, String


@pytest.fixture
def publisher() -> Any:
    """The implementation of a publisher, not registered with a master."""
    return _PublisherImpl("/pinned", String)


@pytest.fixture
def connect() -> Iterator[Callable[[], tuple[TCPROSTransport, list[bytes]]]]:
    """Creates connections; returns each with the list of what is written to it."""
    ends: list[socket.socket] = []

    def create() -> tuple[TCPROSTransport, list[bytes]]:
        near, far = socket.socketpair()
        ends.extend((near, far))
        transport = TCPROSTransport(TCPROSPub("/pinned", String), "pinned")
        transport.set_socket(near, "http://localhost:1/")
        written: list[bytes] = []
        transport.write_data = written.append
        return transport, written

    yield create
    for end in ends:
        end.close()


# flatland.ros.clock: the time of the node is set without a subscription to /clock.
RUN_CLOCK = """
import threading
import rospy
from rospy import rostime

rostime.set_rostime_initialized(True)
rostime._rostime_current = rospy.Time(3, 500)
assert rospy.get_rostime() == rospy.Time(3, 500), rospy.get_rostime()
waiting = threading.Event()
woken = threading.Event()


def wait():
    with rostime.get_rostime_cond() as condition:
        waiting.set()
        rostime.get_rostime_cond().wait(60)
    woken.set()


threading.Thread(target=wait, daemon=True).start()
assert waiting.wait(60)
with rostime.get_rostime_cond():
    rostime.get_rostime_cond().notify_all()
assert woken.wait(60)
"""


def test_ros_time_is_a_variable_with_a_condition() -> None:
    # In a process of its own, since the time belongs to the process.
    command = [sys.executable, "-c", RUN_CLOCK]
    done = run_program(command)
    assert done.returncode == 0, done.stderr


def test_publishers_call_add_connection_of_the_instance() -> None:
    """`Publisher` replaces `add_connection` of one publisher to give each connection an outbox."""
    source = inspect.getsource(TCPROSHandler.topic_connection_handler)
    source += inspect.getsource(sys.modules[TCPROSHandler.__module__])
    assert "topic.add_connection(transport)" in source


def test_messages_are_written_by_write_data_of_the_connection(publisher: Any, connect: Any) -> None:
    """`Outbox` replaces `write_data` of a connection."""
    connection, written = connect()
    publisher.set_queue_size(None)
    assert not publisher.has_connections()
    assert publisher.add_connection(connection)
    assert publisher.has_connections()
    publisher.acquire()
    try:
        publisher.publish(String("pinned"))
    finally:
        publisher.release()
    assert b"pinned" in b"".join(written)


def test_serialized_messages_can_be_sent_without_a_message_object(
    publisher: Any, connect: Any
) -> None:
    """`Publisher` writes serialized messages to the connections in the place of rospy."""
    connection, written = connect()
    publisher.set_queue_size(None)
    assert (publisher.closed, publisher.seq, publisher.is_latch) == (False, 0, False)
    assert not publisher.connections
    publisher.add_connection(connection)
    assert publisher.connections == [connection]
    with publisher.publock:
        publisher.publish(Header(frame_id="map"))
        publisher.publish(String("pinned"))
    # The size of the message, then the message; `seq` counts the messages of a topic.
    assert publisher.seq == 2
    assert written[1] == struct.pack("<II", 10, 6) + b"pinned"
    assert publisher.message_data_sent == sum(map(len, written))
    publisher.close()
    assert publisher.publock is None


def test_the_sequence_number_is_set_in_messages_with_a_header() -> None:
    buffer = BytesIO()
    serialize_message(buffer, 77, PointStamped())
    assert PointStamped._has_header
    assert not String._has_header
    assert struct.unpack_from("<II", buffer.getvalue()) == (len(buffer.getvalue()) - 4, 77)


def test_a_stored_message_is_serialized_for_late_subscribers(publisher: Any, connect: Any) -> None:
    """`Publisher` stores a serialized message on a latched topic."""

    class Stored:
        def serialize(self, buffer: BytesIO) -> None:
            buffer.write(b"stored")

    publisher.enable_latch()
    publisher.set_queue_size(None)
    publisher.latch = Stored()
    late, written = connect()
    publisher.add_connection(late)
    assert written == [struct.pack("<I", 6) + b"stored"]


def test_subscriber_listeners_are_notified_and_can_be_removed(publisher: Any, connect: Any) -> None:
    """`Publisher` and `StateTopic` use the list of listeners."""
    events: list[str] = []

    class Listener(rospy.SubscribeListener):  # type: ignore[misc]
        def peer_subscribe(self, topic: str, publish: Any, publish_single: Any) -> None:
            events.append(topic)
            publish_single(String("to one"))

    listener, (connection, written) = Listener(), connect()
    publisher.add_subscriber_listener(listener)
    assert listener in publisher.subscriber_listeners
    publisher.add_connection(connection)
    assert events == ["/pinned"]
    assert b"to one" in b"".join(written)
    publisher.subscriber_listeners.remove(listener)
    publisher.add_connection(connect()[0])
    assert len(events) == 1


def test_a_topic_can_be_latched_without_storing_a_message(publisher: Any, connect: Any) -> None:
    """`StateTopic` announces a latched topic and creates its messages itself."""
    publisher.add_headers({"latching": "1"})
    publisher.is_latch = False
    publisher.set_queue_size(None)
    publisher.acquire()
    try:
        publisher.publish(String("outdated"))
    finally:
        publisher.release()
    late, written = connect()
    publisher.add_connection(late)
    assert written == []
    assert publisher.headers["latching"] == "1"


def test_publishers_of_one_topic_share_their_implementation() -> None:
    assert "impl" in inspect.getsource(rospy.Publisher.__init__) + inspect.getsource(
        rospy.topics.Topic.__init__
    )
    assert "rmap" in inspect.getsource(_TopicManager.acquire_impl)


def test_connections_have_the_attributes_that_an_outbox_uses(connect: Any) -> None:
    transport, _ = connect()
    closed = []
    transport.set_cleanup_callback(closed.append)
    assert (transport.done, transport.stat_bytes, transport.stat_num_msg) == (False, 0, 0)
    assert (transport.name, transport.endpoint_id) == ("pinned", "http://localhost:1/")
    assert transport.fileno() == transport.socket.fileno() >= 0
    transport.close()
    assert transport.done
    assert closed == [transport]


@pytest.mark.parametrize("impl_type", [_PublisherImpl, _SubscriberImpl])
def test_a_closed_topic_adds_no_connection_to_its_poller(impl_type: Any, connect: Any) -> None:
    """`unregister` closes the poller with the lock that `add_connection` holds."""
    impl = impl_type("/pinned", String)
    with impl.c_lock:
        assert impl.connection_poll.poller.fileno() >= 0
    impl.close()
    impl.connection_poll.poller.close()
    transport, _ = connect()
    assert _TopicImpl.add_connection(impl, transport) is False
    _TopicImpl.remove_connection(impl, transport)


def test_shutdown_can_be_queried() -> None:
    assert rospy.core.is_shutdown_requested() is False


def test_servers_are_created_by_names_of_their_modules() -> None:
    """`inbound.install` replaces both classes."""
    assert "TCPServer(self._tcp_server_callback, self.port)" in inspect.getsource(
        tcpros_base.TCPROSServer.start_server
    )
    assert "ThreadingXMLRPCServer((bind_address, port), log_requests)" in inspect.getsource(
        rosgraph.xmlrpc.XmlRpcNode._run_init
    )
    source = inspect.getsource(tcpros_base.TCPROSServer._tcp_server_callback)
    assert "self.topic_connection_handler(sock, client_addr, header)" in source
    assert "self.service_connection_handler(sock, client_addr, header)" in source


def test_registration_listeners_register_topics_and_services() -> None:
    """`MasterWatch` calls `notify_added` for each registration of the node."""
    registered = inspect.getsource(registration.RegManager.reg_added)
    for call in ("registerPublisher", "registerSubscriber", "registerService", "publisher_update"):
        assert call in registered
    assert "reg_added" in inspect.getsource(registration.RegistrationListeners.notify_added)


def test_shutdown_hooks_receive_the_reason() -> None:
    """`ServerNode` recognizes that another node has its name."""
    assert isinstance(rospy.core._preshutdown_hooks, list)
    source = inspect.getsource(rospy.core.signal_shutdown)
    assert "for h in _preshutdown_hooks" in source
    assert "h(reason)" in source


def test_cached_parameters_need_no_master() -> None:
    """`log_to_ros` stores the parameter that rospy reads for each message of `/rosout`."""
    assert 'get_param_cached("/rosout_disable_topics_generation"' in inspect.getsource(
        rospy.impl.rosout._rosout
    )
    cache = ParamServerCache()
    cache.set("/pinned", False)
    assert cache.get("/pinned") is False
