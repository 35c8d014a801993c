"""Files that are written completely or not at all."""

from __future__ import annotations

import os

import pytest
from full_disk import REASON, limited_files

from flatland.output_files import append, replaced, write_bytes, write_text


def test_a_file_that_cannot_be_written_is_named_and_the_old_one_kept(tmp_path):
    path = tmp_path / "a.txt"
    write_bytes(path, b"old")
    with limited_files(1000), pytest.raises(OSError, match=REASON) as caught:
        write_bytes(path, bytes(2000))
    assert caught.value.filename == str(path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
    missing = tmp_path / "none" / "a.txt"
    with pytest.raises(OSError, match="No such file") as caught:
        write_bytes(missing, b"new")
    assert caught.value.filename == str(missing)


def test_two_writers_of_a_file_do_not_share_a_temporary_file(tmp_path):
    path = tmp_path / "a.bag"
    with replaced(path) as first:
        first.write_text("first")
        with replaced(path) as second:
            second.write_text("second")
        assert path.read_text() == "second"
    assert path.read_text() == "first"
    assert first.suffix == second.suffix == ".bag"
    assert list(tmp_path.iterdir()) == [path]


def test_the_text_of_a_library_names_the_file(tmp_path):
    path = tmp_path / "a.mp4"
    with pytest.raises(OSError, match=r"^cannot write .*/a\.mp4$"), replaced(path) as part:
        raise OSError(f"cannot write {part}")
    with pytest.raises(OSError, match=r"/a\.mp4: no codec$"), replaced(path):
        raise OSError("no codec")


def test_devices_are_written_directly_and_links_followed(tmp_path):
    with pytest.raises(OSError, match="No space left on device: '/dev/full'"):
        write_bytes("/dev/full", b"text")
    (tmp_path / "link").symlink_to("file")
    write_text(tmp_path / "link", "bad \udcff")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "file").read_text() == r"bad \udcff"


def test_what_was_appended_incompletely_is_removed(tmp_path):
    path = tmp_path / "log"
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    append(file, bytes(900))
    with limited_files(1000), pytest.raises(OSError, match=REASON):
        append(file, bytes(200))
    append(file, b"end")
    os.close(file)
    assert path.read_bytes() == bytes(900) + b"end"
