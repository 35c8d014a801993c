"""The addresses of the ROS master and of nodes."""

from __future__ import annotations

import socket

import pytest
from free_ports import free_port

from flatland.ros_addresses import (
    connection_problem,
    is_only_local,
    master_address,
    own_address_problem,
    own_host,
)

FOREIGN = "192.0.2.1"  # of no machine, RFC 5737


@pytest.mark.parametrize(
    ("uri", "address"),
    [
        ("http://localhost:11311", ("localhost", 11311)),
        ("http://robot.lab:80/", ("robot.lab", 80)),
        ("http://[::1]:11311/RPC2", ("::1", 11311)),
    ],
)
def test_the_address_of_a_master(uri: str, address: tuple[str, int]) -> None:
    assert master_address(uri) == address


@pytest.mark.parametrize(
    ("uri", "problem"),
    [
        ("", "does not start with http://"),
        ("localhost:11311", "does not start with http://"),
        ("https://localhost:11311", "does not start with http://"),
        ("http://localhost", "has no port"),
        ("http://localhost:", "has no port"),
        ("http://localhost:0", "has no port"),
        ("http://localhost:ros", "Port could not be cast"),
        ("http://localhost:99999", "Port out of range"),
        ("http://:11311", "has no host"),
        ("http://my robot:11311", "has no host"),
        ("http://localhost:11311/ros", "continues after the port"),
    ],
)
def test_an_invalid_uri_of_a_master_is_an_error(uri: str, problem: str) -> None:
    with pytest.raises(ValueError, match=problem) as caught:
        master_address(uri)
    assert str(caught.value).startswith(f'invalid master URI "{uri}": ')
    assert "expected http://HOST:PORT" in str(caught.value)


def test_the_host_of_a_node_is_that_of_the_first_variable() -> None:
    assert own_host({"ROS_IP": " 10.0.0.1 "}) == ("10.0.0.1", "ROS_IP")
    both = {"ROS_IP": "10.0.0.1", "ROS_HOSTNAME": "robot"}
    assert own_host(both) == ("robot", "ROS_HOSTNAME")
    assert own_host({}) == (socket.gethostname(), "")


@pytest.mark.parametrize("host", ["", "no-such-host.invalid", "1.2.3.4.5", "a..b"])
def test_an_address_that_nobody_can_reach_is_reported(host: str) -> None:
    assert own_address_problem({"ROS_IP": host})
    assert own_address_problem({"ROS_HOSTNAME": host})


def test_an_address_of_this_machine_is_reached() -> None:
    assert own_address_problem({"ROS_HOSTNAME": "localhost"}) == ""
    assert own_address_problem({"ROS_IP": "127.0.0.1"}) == ""


def test_a_closed_port_cannot_be_reached() -> None:
    assert "refused" in connection_problem("localhost", free_port())


@pytest.mark.parametrize(
    ("host", "master", "only_local"),
    [
        ("localhost", FOREIGN, True),
        ("127.0.1.1", FOREIGN, True),
        ("localhost", "localhost", False),
        ("localhost", "127.0.0.1", False),
        ("localhost", socket.gethostname(), False),
        ("10.0.0.1", FOREIGN, False),
    ],
)
def test_a_local_address_does_not_suit_a_master_elsewhere(
    host: str, master: str, only_local: bool
) -> None:
    assert is_only_local(host, master) is only_local
