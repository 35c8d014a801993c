"""Names of topics and namespaces."""

from __future__ import annotations

import pytest

from flatland.graph_names import MAX_NAME, check_model_name, check_namespace, resolve_topic


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
    if legal:
        check_namespace(namespace)
        return
    with pytest.raises(ValueError, match="is not a legal ROS name"):
        check_namespace(namespace)


@pytest.mark.parametrize("namespace", [None, 5, b"r1", ["r1"], "a" * (MAX_NAME + 1)])
def test_a_namespace_is_a_text_of_limited_length(namespace):
    with pytest.raises(ValueError, match=r"namespace must .*, got "):
        check_namespace(namespace)


@pytest.mark.parametrize(
    "name", ["r1", "my robot", "a-b", "a/b", "ä", "c(1)", "a..b", "x" * MAX_NAME]
)
def test_model_names(name):
    check_model_name(name)


@pytest.mark.parametrize(
    "name",
    ["", None, 5, b"r1", "a\0", "a\nb", "\x7f", "\x9b", "\u2028", "\ud800", "a\udfff", "..", "../x",
     "a/../b", "a\\..", "x" * (MAX_NAME + 1), "x" * 100_000],
)  # fmt: skip
def test_illegal_model_names(name):
    with pytest.raises(ValueError, match=r"^its name must ") as caught:
        check_model_name(name)
    text = str(caught.value)
    assert len(text) < 300
    assert text.isprintable()


def test_a_name_of_a_world_file_may_contain_dots():
    check_model_name("../x", is_of_file=True)
    with pytest.raises(ValueError, match="no control characters"):
        check_model_name("a\n", is_of_file=True)
