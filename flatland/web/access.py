"""Access control: the token, and the origin of the page that opens a connection."""

from __future__ import annotations

import hmac
import ipaddress
import secrets
import socket
from dataclasses import dataclass
from urllib.parse import quote, urlsplit


@dataclass(frozen=True, slots=True)
class Access:
    """Decides whether a request is accepted.

    Attributes:
        host: Address that the server listens on.
        token: Token that clients must send, None if no token is required.
    """

    host: str
    token: str | None

    @classmethod
    def for_host(cls, host: str, token: str | None) -> Access:
        """Returns the access for an address, with a random token if one is required and missing."""
        if token is None and not is_loopback(host):
            token = secrets.token_urlsafe(16)
        return cls(host, token)

    def allows_token(self, token: str) -> bool:
        """Returns whether a token is valid; takes the same time for all invalid tokens."""
        if self.token is None:
            return True
        return hmac.compare_digest(token.encode("utf-8", "replace"), self.token.encode())

    def allows_host(self, host: str) -> bool:
        """Returns whether the header `Host` of a request is accepted.

        The name of another site can resolve to this machine, so that a page of the site could
        connect. Without a token, only names of this machine are therefore accepted.
        """
        if self.token is not None:
            return True
        name = _hostname(f"//{host}")
        return name is not None and (name == self.host.lower() or is_loopback(name))

    def allows_origin(self, origin: str | None, host: str) -> bool:
        """Returns whether a page may connect: a page of this server, or a program without a page.

        Args:
            origin: Header `Origin`, None if the request has none.
            host: Header `Host`.
        """
        return origin is None or origin.lower() in (
            f"http://{host.lower()}",
            f"https://{host.lower()}",
        )

    def url(self, port: int) -> str:
        """Returns the address of the page."""
        name = _reachable_name(self.host)
        name = f"[{name}]" if ":" in name else name
        query = "" if self.token is None else f"?token={quote(self.token, safe='')}"
        return f"http://{name}:{port}/{query}"


def is_loopback(host: str) -> bool:
    """Returns whether a name or an address is a loopback address."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _hostname(url: str) -> str | None:
    try:
        return urlsplit(url).hostname
    except ValueError:
        return None


def _reachable_name(host: str) -> str:
    """Returns the address of a host; for all addresses, that of this machine in its network."""
    if host not in ("", "0.0.0.0", "::"):  # noqa: S104 - compared only
        return host
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            # Sends nothing; selects the interface. The address is reserved for documentation.
            probe.connect(("192.0.2.1", 9))
            return str(probe.getsockname()[0])
        except OSError:
            return socket.gethostname()
