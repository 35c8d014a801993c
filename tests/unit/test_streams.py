"""Standard streams that accept any text."""

from __future__ import annotations

import io
import sys

import pytest

from flatland.streams import accept_any_text


@pytest.mark.parametrize(
    ("encoding", "errors", "written"),
    [
        ("ascii", "strict", rb"a\u4e16b\udce4"),
        ("latin-1", "strict", rb"a\u4e16b\udce4"),
        ("utf-8", "strict", "a世b".encode() + rb"\udce4"),
        ("ascii", "surrogateescape", rb"a\u4e16b" + b"\xe4"),
    ],
)
def test_what_cannot_be_encoded_is_escaped(
    monkeypatch: pytest.MonkeyPatch, encoding: str, errors: str, written: bytes
) -> None:
    buffers = {}
    for name in ("stdout", "stderr"):
        buffers[name] = io.BytesIO()
        stream = io.TextIOWrapper(buffers[name], encoding, errors, write_through=True)
        monkeypatch.setattr(sys, name, stream)
    for _ in range(2):
        accept_any_text()
    for name, buffer in buffers.items():
        getattr(sys, name).write("a世b\udce4")
        assert buffer.getvalue() == written


def test_other_streams_remain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    accept_any_text()
