import errno
import os
from pathlib import Path

import pytest

from flyreg_core.errors import InputError
from flyreg_core.files import read_bytes, read_text, write_atomically


def fail_with(monkeypatch, error):
    """Let the system fail after the temporary file has been written."""

    def fsync(descriptor):
        raise error

    monkeypatch.setattr(os, "fsync", fsync)


def test_what_is_written_is_read_again(tmp_path):
    write_atomically(tmp_path / "a", b"\x00\xff")
    assert read_bytes(tmp_path / "a") == b"\x00\xff"


def test_text_keeps_its_line_ends(tmp_path):
    write_atomically(tmp_path / "a", "µ\r\nß\n")
    assert read_bytes(tmp_path / "a") == "µ\r\nß\n".encode()


def test_nothing_else_is_left_in_the_folder(tmp_path):
    write_atomically(tmp_path / "a", "text")
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


@pytest.mark.parametrize("error", [KeyboardInterrupt(), OSError(errno.EIO, "broken")])
def test_an_interruption_leaves_the_old_file_alone(tmp_path, monkeypatch, error):
    (tmp_path / "a").write_text("old")
    fail_with(monkeypatch, error)
    with pytest.raises((KeyboardInterrupt, InputError)):
        write_atomically(tmp_path / "a", "new")
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("a", "old")]


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "file")
    write_atomically(tmp_path / "link", "text")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "file").read_text() == "text"


def test_new_files_have_the_usual_permissions(tmp_path):
    (tmp_path / "usual").write_text("")
    write_atomically(tmp_path / "a", "text")
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_a_full_disk_is_named(tmp_path, monkeypatch):
    fail_with(monkeypatch, OSError(errno.ENOSPC, "No space left on device"))
    with pytest.raises(InputError, match="cannot be written: the disk is full; make room"):
        write_atomically(tmp_path / "a", "text")


def test_a_read_only_folder_is_named(tmp_path, monkeypatch):
    def refuse(path, mode):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(InputError, match=r"the folder .* is read-only; choose another one"):
        write_atomically(tmp_path / "a", "text")


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(InputError, match=r"there is no folder .*nowhere; make it first"):
        write_atomically(tmp_path / "nowhere" / "a", "text")


def test_a_folder_cannot_be_overwritten(tmp_path):
    with pytest.raises(InputError, match="it is a folder; choose another name"):
        write_atomically(tmp_path, "text")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"there is no file .*a; check its name and folder"):
        read_bytes(tmp_path / "a")


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(InputError, match="is a folder; choose a file in it"):
        read_bytes(tmp_path)


def test_an_empty_file_is_named(tmp_path):
    (tmp_path / "a").touch()
    with pytest.raises(InputError, match=r"a is empty \(0 bytes\); copy or export it again"):
        read_bytes(tmp_path / "a")


def test_a_byte_order_mark_is_not_text(tmp_path):
    (tmp_path / "a").write_bytes(b"\xef\xbb\xbftext")
    assert read_text(tmp_path / "a") == "text"


def test_other_encodings_are_refused(tmp_path):
    (tmp_path / "a").write_bytes(b"caf\xe9")
    with pytest.raises(InputError, match=r"not a text file in UTF-8 \(byte 4\); save it as UTF-8"):
        read_text(tmp_path / "a")
