"""Access control: tokens, and the origin of the page that opens a connection."""

from __future__ import annotations

import hmac
import ipaddress
import secrets
import socket
from dataclasses import dataclass
from urllib.parse import quote, urlsplit

from flatland.checks import shown
from flatland.defaults import WEB_MIN_TOKEN


@dataclass(frozen=True, slots=True)
class Access:
    """Decides whether a request is accepted.

    Attributes:
        host: Address that the server listens on.
        token: Token that clients must send, None if no token is required.
        view_token: Another token, for clients that cannot change a world; None if there is none.
        read_only: Whether no client can change a world.
    """

    host: str
    token: str | None
    view_token: str | None = None
    read_only: bool = False

    @classmethod
    def for_host(
        cls,
        host: str,
        token: str | None,
        view_token: str | None = None,
        *,
        read_only: bool = False,
    ) -> Access:
        """Returns the access for an address, with a random token if one is required and missing.

        Raises:
            ValueError: The host or a token is no text, a token is too short, or both are equal.
        """
        if not isinstance(host, str) or "\0" in host:
            raise ValueError(f"host must be a name or an address, got {shown(host)}")
        for given in (token, view_token):
            if given is not None and not isinstance(given, str):
                raise ValueError(f"a token must be a text, got {shown(given)}")
            if given is not None and len(given) < WEB_MIN_TOKEN:
                raise ValueError(
                    f"a token must have at least {WEB_MIN_TOKEN} characters, got {len(given)}"
                )
        if view_token is not None and view_token == token:
            raise ValueError("the token of viewers must differ from the other token")
        if token is None and (view_token is not None or not is_loopback(host)):
            token = secrets.token_urlsafe(16)
        return cls(host, token, view_token, read_only)

    def allows_token(self, token: str) -> bool:
        """Returns whether a token is valid; takes the same time for all invalid tokens."""
        if self.token is None:
            return True
        return _equal(token, self.token) | self._is_view_token(token)

    def is_read_only(self, token: str) -> bool:
        """Returns whether a client with a valid token cannot change a world."""
        return self.read_only or self._is_view_token(token)

    def _is_view_token(self, token: str) -> bool:
        return self.view_token is not None and _equal(token, self.view_token)

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

    def url(self, port: int, token: str | None) -> str:
        """Returns the address of the page, with a token if it is given."""
        name = _reachable_name(self.host)
        name = f"[{name}]" if ":" in name else name
        query = "" if token is None else f"?token={quote(token, safe='')}"
        return f"http://{name}:{port}/{query}"


def _equal(given: str, token: str) -> bool:
    return hmac.compare_digest(given.encode("utf-8", "replace"), token.encode())


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
