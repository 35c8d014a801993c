"""Texts of foreign code."""

from __future__ import annotations

from flatland.foreign_texts import MAX_TEXT, clean_name, clean_text, text_of


def test_texts_can_be_encoded_and_printed():
    text = clean_text("bad \udcff \x1b[31m\x00 é ∑ 漢字\n\t")
    assert text == "bad \\udcff \\x1b[31m\\x00 é ∑ 漢字\n\t"
    text.encode()
    assert clean_name("two\nlines\r") == "two\\nlines\\r"
    assert clean_text("x" * MAX_TEXT) == "x" * MAX_TEXT
    assert clean_text("x" * 5_000_000) == "x" * MAX_TEXT + "... (4996000 more characters)"


class Unprintable:
    def __str__(self):
        raise SystemExit(3)

    def __repr__(self):
        return None


def test_an_object_without_a_text_has_one():
    assert text_of(Unprintable()) == "<Unprintable whose text raises SystemExit>"
    assert text_of(Unprintable(), repr) == "<Unprintable whose text raises TypeError>"
    assert text_of(3) == "3"
