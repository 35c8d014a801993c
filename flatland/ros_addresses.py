"""The addresses of ROS 1: that of the master, and that at which other programs reach a node.

The module imports only the standard library, because `flatland doctor` also loads it without
flatland.
"""

from __future__ import annotations

import ipaddress
import os
import socket
import urllib.parse
from collections.abc import Mapping

_EXAMPLE = "expected http://HOST:PORT, such as http://localhost:11311"
_PATHS = ("", "/", "/RPC2")  # that the master accepts
_TIMEOUT = 2.0  # s
_OVERRIDES = ("ROS_HOSTNAME", "ROS_IP")  # the first one that is set counts


def master_address(uri: str) -> tuple[str, int]:
    """Returns the host and the port of the URI of a ROS master.

    Args:
        uri: The URI.

    Raises:
        ValueError: The URI is not that of a master. rospy would wait for it indefinitely.
    """
    try:
        parts = urllib.parse.urlsplit(uri)
        host, port = parts.hostname, parts.port
        if parts.scheme != "http":
            raise ValueError("it does not start with http://")
        if not host or any(map(str.isspace, host)):
            raise ValueError("it has no host")
        if not port:
            raise ValueError("it has no port")
        if parts.path not in _PATHS or parts.query or parts.fragment:
            raise ValueError("it continues after the port")
    except ValueError as error:
        raise ValueError(f'invalid master URI "{uri}": {error}, {_EXAMPLE}') from None
    return host, port


def connection_problem(host: str, port: int) -> str:
    """Returns why no connection can be made, empty if one can be made within two seconds."""
    try:
        socket.create_connection((host, port), _TIMEOUT).close()
    except (OSError, UnicodeError) as error:
        return str(error)
    return ""


def own_address_problem(environment: Mapping[str, str] = os.environ) -> str:
    """Returns why no program can reach a node at the address that it is going to have.

    Args:
        environment: Environment variables.
    """
    host, _ = own_host(environment)
    with socket.create_server(("", 0)) as server:
        return connection_problem(host, server.getsockname()[1])


def own_host(environment: Mapping[str, str] = os.environ) -> tuple[str, str]:
    """Returns the host in the address of a node, and the variable that sets it, empty for none."""
    for name in _OVERRIDES:
        if name in environment:
            return environment[name].strip(), name
    return socket.gethostname(), ""


def remedy(variable: str) -> str:
    """Returns what makes a node reachable.

    Args:
        variable: The environment variable that sets its address; empty for none.
    """
    if variable:
        return (
            f"set {variable} to a name or an address of this machine that the other machines "
            "know, or unset it"
        )
    return "add the name of this machine to /etc/hosts, or set ROS_IP to its address"


def is_only_local(host: str, master: str) -> bool:
    """Returns whether a node has an address for this machine alone, but a master on another one.

    Args:
        host: Host in the address of the node.
        master: Host of the master.
    """
    return _is_loopback(host) and not (_is_loopback(master) or _is_own(master))


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _is_own(host: str) -> bool:
    """Returns whether an address of a host is one of this machine, or nothing is known about it."""
    try:
        addresses = {each[4][0] for each in socket.getaddrinfo(host, None)}
    except (OSError, UnicodeError):
        return True
    for address in addresses:
        family = socket.AF_INET6 if ":" in str(address) else socket.AF_INET
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            try:
                probe.bind((address, 0))
            except OSError:
                continue
            return True
    return False
