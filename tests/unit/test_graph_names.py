"""Names of topics and namespaces."""

from __future__ import annotations

import pytest

from flatland.graph_names import is_legal_namespace, resolve_topic


@pytest.mark.parametrize(
    ("topic", "namespace", "expected"),
    [
        ("scan", "", "scan"),
        ("scan", "r1", "r1/scan"),
        ("scan", "r1/", "r1/scan"),
        ("scan", "/r1", "/r1/scan"),
        ("/scan", "r1", "/scan"),
        ("a/2d", "r1/b", "r1/b/a/2d"),
        ("cmd_vel/", "", "cmd_vel"),
        ("a//b", "r1", "r1/a/b"),
        ("//a///b//", "r1", "/a/b"),
        ("a", "//r1///b//", "/r1/b/a"),
        ("a", "/", "a"),
    ],
)
def test_topics_take_the_namespace(topic, namespace, expected):
    assert resolve_topic(topic, namespace) == expected


@pytest.mark.parametrize("topic", ["", "my robot", "1st", "a-b", "/", "//", "~x", "é", "_a", "a /"])
def test_illegal_topics(topic):
    with pytest.raises(ValueError, match="is not a legal topic name"):
        resolve_topic(topic)


@pytest.mark.parametrize(
    ("namespace", "legal"),
    [("", True), ("/", True), ("r1", True), ("/r1/", True), ("a/b_2", True), ("a b", False),
     ("a-b", False), ("2", False), ("a//b", True), ("//", True), ("a//b c/", False)],
)  # fmt: skip
def test_namespaces(namespace, legal):
    assert is_legal_namespace(namespace) is legal
