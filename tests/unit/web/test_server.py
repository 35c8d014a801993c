"""The server: files of the page, and who may connect."""

from __future__ import annotations

import asyncio
import gzip
import json
import re
import socket
import threading
from typing import Any

import aiohttp
import pytest
from raw_web_client import RawWebClient
from waiting import TIMEOUT, wait_until

from flatland.errors import FlatlandError
from flatland.web import WebViewer
from flatland.web.access import Access
from flatland.web.page_files import PageFiles
from flatland.web.server import PAGE

TOKEN = "open-the-sesame-now"


def get(url: str, **options: Any) -> tuple[int, Any, bytes]:
    """Returns the status, the headers and the body of an answer."""

    unpack = options.pop("auto_decompress", True)

    async def get() -> tuple[int, Any, bytes]:
        async with (
            aiohttp.ClientSession(auto_decompress=unpack) as session,
            session.get(url, **options) as answer,
        ):
            return answer.status, answer.headers, await answer.read()

    return asyncio.run(get())


class TestFiles:
    def test_the_page_is_served_with_a_strict_policy(self, viewer):
        status, headers, body = get(viewer.url)
        assert status == 200
        assert headers["Content-Type"] == "text/html; charset=utf-8"
        assert b"<!doctype html>" in body[:100].lower()
        policy = headers["Content-Security-Policy"]
        assert "default-src 'self'" in policy
        assert "unsafe" not in policy
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["Referrer-Policy"] == "no-referrer"
        assert headers["Server"] == "flatland"

    @pytest.mark.parametrize(
        ("options", "ancestors"),
        [
            ({"token": TOKEN}, "'self' http://localhost:* http://127.0.0.1:*"),
            ({"host": "0.0.0.0", "token": TOKEN}, "'self'"),
            ({"host": "0.0.0.0", "token": TOKEN, "embeddable": True}, "*"),
        ],
    )
    def test_the_sites_that_may_show_the_page_in_a_frame(self, options, ancestors):
        with WebViewer(port=0, **options) as viewer:
            url = f"http://127.0.0.1:{viewer.port}/"
            policy = get(url)[1]["Content-Security-Policy"]
        found = policy.partition("frame-ancestors ")[2]
        assert found == ancestors or (" " in ancestors and found.startswith(ancestors))

    def test_a_file_is_not_sent_again_if_it_is_the_same(self, viewer):
        tag = get(viewer.url)[1]["ETag"]
        status, _, body = get(viewer.url, headers={"If-None-Match": tag})
        assert (status, body) == (304, b"")

    def test_assets_are_kept_by_browsers_and_have_paths_of_their_version(self, viewer):
        _, headers, body = get(viewer.url)
        assert headers["Cache-Control"] == "no-cache"
        links = re.findall(r'(?:href|src)="([^"#]+)"', body.decode())
        assert len(links) > 60
        [prefix] = {link.partition("/js/")[0] for link in links if "/js/" in link}
        assert re.fullmatch(r"assets/[0-9a-f]{16}", prefix)
        for name in ("js/main.js", "css/theme.css", "icon.svg"):
            assert f"{prefix}/{name}" in links
            assert get(f"{viewer.url}{name}")[0] == 404, "without a version"
        # Not linked, but imported by a module.
        vendor = [path.relative_to(PAGE) for path in PAGE.glob("vendor/*/*.js")]
        for link in [*links, *(f"{prefix}/{path}" for path in vendor)]:
            status, headers, _ = get(f"{viewer.url}{link}")
            assert status == 200
            assert headers["Cache-Control"] == "public, max-age=31536000, immutable"
        assert get(f"{viewer.url}assets/{16 * '0'}/js/main.js")[0] == 404

    def test_the_version_changes_with_each_file(self, tmp_path):
        (tmp_path / "js").mkdir()
        (tmp_path / "index.html").write_text('<script src="js/main.js"></script><a href="x.js">')
        prefixes = set()
        for name, text in [("main.js", "1"), ("main.js", "2"), ("other.js", "2")]:
            (tmp_path / "js" / name).write_text(text)
            files = PageFiles(tmp_path)
            prefixes.add(files.prefix)
            expected = f'<script src="{files.prefix}js/main.js"></script><a href="x.js">'
            assert files.index.content == expected.encode()
            main = files.asset(f"{files.prefix}js/main.js")
            assert main is not None
            assert main.content == (tmp_path / "js" / "main.js").read_bytes()
        assert len(prefixes) == 3

    @pytest.mark.parametrize(
        ("accepted", "compressed"),
        [
            ("gzip, deflate, br", True),
            ("br;q=1.0, gzip;q=0.8", True),
            ("gzip;q=0", False),
            ("gzip;q=0.0, br", False),
            ("identity", False),
            ("x-gzip-old", False),
        ],
    )
    def test_texts_are_compressed_for_browsers_that_accept_it(self, viewer, accepted, compressed):
        headers = {"Accept-Encoding": accepted}
        _, sent, body = get(viewer.url, headers=headers, auto_decompress=False)
        assert sent["Vary"] == "Accept-Encoding"
        assert (sent.get("Content-Encoding") == "gzip") is compressed
        assert b"<!doctype html>" in (gzip.decompress(body) if compressed else body)[:100].lower()

    @pytest.mark.parametrize(
        "path", ["nothing.js", "../server.py", "%2e%2e/server.py", "..%2fserver.py", "%00.js", "js"]
    )
    def test_other_files_are_not_served(self, viewer, path):
        async def get_raw() -> bytes:
            reader, writer = await asyncio.open_connection("127.0.0.1", viewer.port)
            request = f"GET /{path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
            writer.write(request.encode())
            answer = await reader.read()
            writer.close()
            return answer

        answer = asyncio.run(get_raw())
        assert answer.startswith((b"HTTP/1.1 404", b"HTTP/1.1 400"))
        assert b"import" not in answer


class TestAccess:
    def test_only_the_own_page_may_connect(self, viewer):
        with pytest.raises(aiohttp.WSServerHandshakeError) as error:
            RawWebClient(viewer.url, headers={"Origin": "http://example.org"})
        assert error.value.status == 403
        own = {"Origin": viewer.url.rstrip("/")}
        with RawWebClient(viewer.url, look=False, headers=own) as client:
            assert client.wait("hello")["title"] == "flatland"

    def test_names_of_other_machines_are_refused(self, viewer):
        assert get(viewer.url, headers={"Host": "example.org"})[0] == 403
        with pytest.raises(aiohttp.WSServerHandshakeError) as error:
            RawWebClient(viewer.url, headers={"Host": "example.org:80"})
        assert error.value.status == 403
        for name in ("localhost:9000", "127.0.0.1", "[::1]:8000"):
            assert get(viewer.url, headers={"Host": name})[0] == 200

    def test_a_token_is_required_if_the_viewer_has_one(self):
        with WebViewer(port=0, token="open, sesame & co") as viewer:
            assert viewer.url.endswith("/?token=open%2C%20sesame%20%26%20co")
            assert viewer.view_url is None
            with RawWebClient(viewer.url, look=False) as client:
                client.wait("hello")
            plain = viewer.url.partition("?")[0]
            tokens = ("?token=", "?token=Open%2C%20sesame%20%26%20co", "?token=%c3%a4")
            for wrong in ("", *tokens):
                with RawWebClient(f"{plain}{wrong}", look=False) as client:
                    assert client.wait_closed() == (4401, "the token is missing or wrong")
                    assert client.received == []

    def test_the_second_token_is_that_of_viewers(self, world, simulation):
        with WebViewer(port=0, view_token=TOKEN) as viewer:
            viewer.add_world(world, simulation=simulation)
            assert viewer.view_url == f"http://127.0.0.1:{viewer.port}/?token={TOKEN}"
            assert len(viewer.token or "") >= 20
            with RawWebClient(viewer.view_url, look=False) as client:
                assert client.wait("hello")["read_only"]
                assert client.reply("pause")["error"] == "this viewer is read-only"
            with RawWebClient(viewer.url, look=False) as client:
                assert not client.wait("hello")["read_only"]
                assert client.reply("pause")["ok"]
            with RawWebClient(f"http://127.0.0.1:{viewer.port}/", look=False) as client:
                assert client.wait_closed()[0] == 4401

    @pytest.mark.parametrize(
        ("tokens", "error"),
        [
            ({"token": 15 * "a"}, "a token must have at least 16 characters, got 15"),
            ({"view_token": ""}, "a token must have at least 16 characters, got 0"),
            ({"token": TOKEN, "view_token": TOKEN}, "the token of viewers must differ"),
        ],
    )
    def test_invalid_tokens(self, tokens, error):
        with pytest.raises(ValueError, match=error):
            WebViewer(port=0, **tokens)

    def test_other_hosts_get_a_random_token(self):
        tokens = {Access.for_host("0.0.0.0", None).token for _ in range(3)}
        assert len(tokens) == 3
        assert all(token and len(token) >= 20 for token in tokens)
        for host in ("127.0.0.1", "localhost", "::1"):
            assert Access.for_host(host, None).token is None

    def test_a_read_only_viewer_refuses_changes(self, world, simulation):
        with WebViewer(port=0, read_only=True) as viewer:
            viewer.add_world(world, simulation=simulation)
            with RawWebClient(viewer.url) as client:
                assert client.wait_model("robot")
                robot = {"model": client.model("robot")["id"]}
                pose = {"pose": [1, 1, 0]}
                for kinds, fields in {
                    "pause resume step reset undo redo save": {},
                    "delete hold release": robot,
                    "move": robot | pose,
                    "drive": robot | {"linear": [1, 0]},
                    "set_rate": {"rate": 1},
                    "visit": {"moment": 1},
                    "spawn": {"file": "box.model.yaml", "name": "b", **pose},
                    "publish_pose": {"purpose": "goal", "topic": "/goal", **pose},
                }.items():
                    for kind in kinds.split():
                        assert client.reply(kind, **fields)["error"] == "this viewer is read-only"
                assert client.ask("files")
                assert client.ask("describe_series")
            assert not world.paused
            assert [model.name for model in world.models] == ["robot"]


def test_a_malformed_message_closes_that_connection_and_nothing_else(url):
    with RawWebClient(url) as other, RawWebClient(url) as client:
        client.send_text('{"type": "eval"}')
        assert client.wait_closed() == (1008, "unknown type")
        other.wait(2)
        assert other.ask("describe_series")


def test_a_request_of_a_page_is_no_connection(viewer):
    status, _, body = get(f"{viewer.url}ws")
    assert (status, body) == (400, b"a WebSocket is expected\n")


def test_a_connection_is_watched_and_not_compressed(viewer, monkeypatch):
    monkeypatch.setattr("flatland.web.server.HEARTBEAT", 0.02)

    async def connect() -> None:
        async with aiohttp.ClientSession() as session:
            options = {"protocols": ["other", "flatland.1"], "compress": 15, "autoping": False}
            async with session.ws_connect(f"{viewer.url}ws", **options) as socket:
                assert socket.protocol == "flatland.1"
                assert not socket.compress
                while (await socket.receive(TIMEOUT)).type != aiohttp.WSMsgType.PING:
                    pass

    asyncio.run(connect())


class TestLimits:
    def test_binary_messages_are_refused(self, client):
        client.send_bytes(b"\x00\x01")
        assert client.wait_closed() == (1003, "only text is accepted")

    def test_large_messages_are_refused(self, client):
        client.send_text(json.dumps({"type": "preview", "file": "x" * 17000}))
        assert client.wait_closed()[0] == 1009

    def test_too_many_messages_are_refused(self, url):
        with RawWebClient(url, look=False) as client, RawWebClient(url) as other:
            client.send_many(['{"type": "pause", "world": 7}'] * 2000)
            code, reason = client.wait_closed()
            # A reset of the connection, because of messages that nobody reads, may come first.
            assert (code, reason) in [(1008, "more than 120 messages per second"), (None, None)]
            assert len([m for m in client.received if m.get("type") == "reply"]) < 1000
            other.wait(2)

    def test_requests_that_wait_are_limited(self, client, world):
        release = threading.Event()
        blocked = world.post(lambda: release.wait(30))
        numbers = [client.send("pause") for _ in range(70)]
        reply = client.wait("reply", lambda message: not message["ok"])
        assert reply["error"] == "too many requests wait for the simulator"
        assert reply["id"] > numbers[50]
        release.set()
        blocked.result(30)
        client.wait("reply", lambda message: message["id"] == numbers[0])

    def test_too_many_clients_are_refused(self, viewer, monkeypatch):
        monkeypatch.setattr("flatland.web.server.MAX_CLIENTS", 2)
        with RawWebClient(viewer.url, look=False) as first, RawWebClient(viewer.url, look=False):
            first.wait("hello")
            with RawWebClient(viewer.url, look=False) as third:
                assert third.wait_closed() == (1013, "too many clients")


class TestLifecycle:
    def test_a_port_in_use_is_a_clear_error(self, viewer):
        with pytest.raises(FlatlandError, match=f"cannot listen on port {viewer.port} of '127.0.0"):
            WebViewer(port=viewer.port).start()

    def test_an_unknown_host_is_a_clear_error(self):
        with pytest.raises(FlatlandError, match="cannot listen on port 0 of 'no such host'"):
            WebViewer("no such host", 0).start()

    @pytest.mark.parametrize("port", [-1, 65536])
    def test_an_invalid_port_is_a_clear_error(self, port):
        with pytest.raises(ValueError, match="port must be from 0 to 65535"):
            WebViewer(port=port)

    def test_close_disconnects_clients_and_ends_the_thread(self, client, viewer):
        viewer.close()
        viewer.close()
        assert client.wait_closed() == (1001, "the viewer ends")
        assert "flatland-web" not in {thread.name for thread in threading.enumerate()}
        with socket.socket() as free, pytest.raises(ConnectionRefusedError):
            free.connect(("127.0.0.1", viewer.port))
        with pytest.raises(FlatlandError, match="the viewer is closed"):
            viewer.start()

    def test_a_viewer_that_was_not_started_can_be_closed(self, world):
        viewer = WebViewer(port=0)
        viewer.add_world(world)
        viewer.close()
        with pytest.raises(FlatlandError, match="the viewer is closed"):
            viewer.add_world(world)

    def test_clients_may_vanish(self, client, url, viewer):
        others = [RawWebClient(url) for _ in range(3)]
        for other in others:
            other.wait(2)
            other.vanish()
        wait_until("one client is left", lambda: len(viewer._hub.clients) == 1)
        assert client.ask("describe_series")
        for other in others:
            other.close()
