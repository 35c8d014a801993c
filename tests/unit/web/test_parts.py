"""Parts of the viewer without a connection."""

from __future__ import annotations

import itertools
import json
import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from flatland.plugin_api.ports import Output
from flatland.values import LaserScan, NavSatFix, Odometry
from flatland.web import messages
from flatland.web.access import Access, is_loopback
from flatland.web.numbers import as_json, find_number, number_at, series_of

# Valid fields of each type.
VALID: dict[str, dict[str, Any]] = {
    "look": {
        "worlds": [0, 2],
        "scans": True,
        "compact_scans": True,
        "frames": False,
        "inspect": None,
        "series": ["/a/b"],
        "topics": ["/plan"],
        "topic_values": ["/odom"],
        "hidden": False,
        "history": True,
    },
    "pause": {},
    "resume": {},
    "step": {"n": 3},
    "set_rate": {"rate": 0},
    "move": {"model": 1, "pose": [1, 2, 3]},
    "hold": {"model": 1},
    "release": {"model": 1},
    "spawn": {"file": "a.yaml", "name": "a", "pose": [1, 2, 3], "namespace": ""},
    "preview": {"file": "a.yaml"},
    "delete": {"model": 1},
    "reset": {},
    "visit": {"moment": 3},
    "save": {},
    "undo": {},
    "redo": {},
    "drive": {"model": 1, "command": "/cmd_vel", "linear": [1, 0], "angular": -1.5},
    "files": {},
    "describe_series": {},
    "publish_pose": {"purpose": "goal", "topic": "/goal", "pose": [1, 2, 3]},
}
FIELDS = [(kind, field) for kind, fields in VALID.items() for field in fields]


class TestMessages:
    @pytest.mark.parametrize(
        ("text", "reason"),
        [
            ("", "not JSON"),
            ("{", "not JSON"),
            ("[" * 5000, "not JSON"),
            ('{"type": "set_rate", "rate": NaN}', "not JSON"),
            ('{"type": "set_rate", "rate": %s}' % ("9" * 5000), "not JSON"),
            ("[]", "not a JSON object"),
            ("{}", "unknown type"),
            ('{"type": ["look"]}', "unknown type"),
            ('{"type": "eval"}', "unknown type"),
            ('{"type": "pause", "id": "x"}', "pause: id must be an integer"),
            ('{"type": "pause", "world": -1}', "pause: world must be an integer"),
            ('{"type": "pause", "more": 1}', "pause: unknown field 'more'"),
            ('{"type": "move", "model": 1}', "move: pose is missing"),
            ('{"type": "move", "model": 1, "pose": [1, 2]}', "move: pose must be [x, y, theta]"),
            ('{"type": "move", "model": true, "pose": [1, 2, 3]}', "move: model must be an int"),
            ('{"type": "set_rate", "rate": -1}', "set_rate: rate must be a number from 0"),
            ('{"type": "step", "n": 0}', "step: n must be an integer from 1"),
            ('{"type": "look", "scans": 1}', "look: scans must be true or false"),
            ('{"type": "preview", "file": "a\\u0000b"}', "preview: file must be a text without"),
            ('{"type": "preview", "file": "\\ud800"}', "preview: file must be a text without"),
        ],
    )
    def test_a_malformed_message_is_an_error(self, text, reason):
        with pytest.raises(messages.MessageError, match=f"^{re.escape(reason)}"):
            messages.parse(text)

    def test_a_valid_message_has_its_fields(self):
        assert VALID.keys() == messages._FIELDS.keys()
        for kind, fields in VALID.items():
            message = messages.parse(json.dumps({"type": kind, "id": 7, "world": 3, **fields}))
            assert (message.type, message.id, message.world) == (kind, 7, 3)
            assert message.fields.keys() == fields.keys()

    def test_each_field_is_checked(self):
        wrong = ("{}", "1e999", "[{}]", '"\\u0000"', "[1e999, 1e999, 1e999]", "-1e300")
        for (kind, field), value in itertools.product(FIELDS, wrong):
            # `World.spawn_model` checks the names of models.
            if value == wrong[3] and field in ("name", "namespace"):
                continue
            text = json.dumps({"type": kind, **VALID[kind], field: "?"}).replace('"?"', value)
            with pytest.raises(messages.MessageError, match=f"^{kind}: {field} must be "):
                messages.parse(text)

    def test_angles_of_poses_are_wrapped(self):
        message = messages.parse('{"type": "move", "model": 3, "pose": [1, 2, 7]}')
        assert message.fields["pose"] == (1, 2, pytest.approx(7 - 2 * math.pi))

    def test_all_types_are_described(self, checkout):
        page = (checkout / "docs" / "web_protocol.md").read_text()
        for kind, (required, optional) in messages._FIELDS.items():
            rows = [line for line in page.splitlines() if line.startswith("|")]
            (row,) = [line for line in rows if f"`{kind}`" in line.split("|")[1]]
            assert all(f"`{name}`" in row for name in (*required, *optional)), kind


@dataclass(frozen=True)
class Reading:
    """A value with nested numbers."""

    stamp: int
    level: float
    on: bool
    parts: dict[str, float]
    pair: tuple[float, float]
    many: Any = None


class TestNumbers:
    READING = Reading(5, 0.5, True, {"a": 1.0}, (2.0, math.nan), np.arange(20))

    def test_numbers_at_paths(self):
        for path, expected in (
            ("level", 0.5),
            ("on", 1.0),
            ("parts/a", 1.0),
            ("pair/0", 2.0),
            ("pair/1", None),  # NaN
            ("many/19", 19.0),
            ("many/20", None),
            ("many/-1", None),
            ("many", None),
            ("nothing", None),
            ("__class__/__name__", None),
        ):
            assert number_at(self.READING, path.split("/")) == expected, path

    def test_series_of_a_value_and_of_a_type(self):
        output = Output("/a/b", Reading)
        assert series_of(output) == ["/a/b/level", "/a/b/on", "/a/b/pair/0", "/a/b/pair/1"]
        output.emit(self.READING)
        names = ["level", "on", "parts/a", "pair/0", "pair/1"]
        assert series_of(output) == [f"/a/b/{name}" for name in names]
        names = ["latitude", "longitude", "altitude"]
        assert series_of(Output("fix", NavSatFix)) == [f"/fix/{name}" for name in names]
        assert "/odom/pose/2" in series_of(Output("odom", Odometry))
        assert series_of(Output("on", bool)) == ["/on"]

    def test_the_longest_topic_is_the_output(self):
        outputs = {"/a": Output("/a", float), "/a/b": Output("/a/b", Reading)}
        assert find_number(outputs, "/a/b/pair/0") == (outputs["/a/b"], ["pair", "0"])
        assert find_number(outputs, "/a/c") == (outputs["/a"], ["c"])
        assert find_number(outputs, "/c") is None

    def test_values_are_json(self):
        shown = as_json(self.READING)
        json.dumps(shown, allow_nan=False)
        assert shown["pair"] == [2.0, "nan"]
        assert shown["many"][-1] == "… 20 items"
        scan = LaserScan(1, "f", 0, 1, 1, 0, 0, 0, 9, np.ones(500, np.float32), np.zeros(0))
        assert len(as_json(scan)["ranges"]) == 17
        nested: Any = []
        nested.append(nested)
        json.dumps(as_json(nested))
        assert as_json(object()).startswith("<object")


class TestAccess:
    def test_loopback(self):
        own = ["localhost", "LOCALHOST", "127.0.0.1", "127.8.9.1", "::1"]
        others = ["0.0.0.0", "10.0.0.1", "", "localhost.example.org", "::"]
        assert [host for host in own + others if is_loopback(host)] == own

    @pytest.mark.parametrize(
        ("origin", "host", "allowed"),
        [
            (None, "localhost:8000", True),
            ("http://localhost:8000", "localhost:8000", True),
            ("https://viewer.example.org", "viewer.example.org", True),
            ("http://localhost:8001", "localhost:8000", False),
            ("http://localhost:8000.example.org", "localhost:8000", False),
            ("null", "localhost:8000", False),
            ("", "localhost:8000", False),
        ],
    )
    def test_origins(self, origin, host, allowed):
        assert Access("127.0.0.1", None).allows_origin(origin, host) is allowed

    @pytest.mark.parametrize("host", ["example.org", "", "[", "127.0.0.1.example.org", "10.0.0.1"])
    def test_foreign_names_of_the_server(self, host):
        assert not Access("127.0.0.1", None).allows_host(host)
        assert Access("127.0.0.1", "token").allows_host(host)

    def test_addresses(self):
        assert Access("::1", None).url(80, None) == "http://[::1]:80/"
        assert Access("localhost", None).url(80, "a b") == "http://localhost:80/?token=a%20b"
        assert "0.0.0.0" not in Access.for_host("0.0.0.0", None).url(80, None)
