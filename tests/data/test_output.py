from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from jaxbrdf.data.output import check_writable, write_atomically
from jaxbrdf.errors import DataError


def refusing(number: int):
    def refuse(*_args, **_kwargs):
        raise OSError(number, os.strerror(number))

    return refuse


def test_content_replaces_what_was_there_and_nothing_else_is_left(tmp_path: Path) -> None:
    target = tmp_path / "out.bin"
    write_atomically(target, b"first")
    write_atomically(target, b"second")
    assert target.read_bytes() == b"second"
    assert os.listdir(tmp_path) == ["out.bin"]


def test_file_gets_the_usual_permissions(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.write_bytes(b"")
    write_atomically(tmp_path / "out", b"x")
    assert (tmp_path / "out").stat().st_mode == plain.stat().st_mode


@pytest.mark.parametrize(
    ("number", "said"),
    [(errno.ENOSPC, "no space"), (errno.EACCES, "permission"), (errno.EROFS, "read-only"), (errno.EIO, "Input/output")],
)
def test_failure_keeps_the_old_file_and_is_said_in_one_line(number, said, tmp_path: Path, monkeypatch) -> None:
    target = tmp_path / "out.bin"
    target.write_bytes(b"old")
    monkeypatch.setattr(os, "fsync", refusing(number))
    with pytest.raises(DataError, match=said) as caught:
        write_atomically(target, b"new")
    assert str(target) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert target.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["out.bin"]


def test_interruption_leaves_nothing(tmp_path: Path, monkeypatch) -> None:
    def interrupt(*_args) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "out.bin", b"new")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("function", [check_writable, lambda path: write_atomically(path, b"x")])
def test_places_that_take_no_file_are_refused(function, tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"kept")
    for path in (tmp_path, tmp_path / "missing" / "out", tmp_path / "file" / "out", tmp_path / ("n" * 300)):
        with pytest.raises(DataError, match="cannot be written"):
            function(path)
    with pytest.raises(DataError, match="null"):
        function(str(tmp_path / "a\0b"))
    assert os.listdir(tmp_path) == ["file"]


def test_check_leaves_an_existing_file_alone(tmp_path: Path) -> None:
    target = tmp_path / "out.bin"
    check_writable(target)
    target.write_bytes(b"old")
    check_writable(target)
    assert target.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["out.bin"]


def test_link_keeps_pointing_where_it_did(tmp_path: Path) -> None:
    (tmp_path / "real").write_bytes(b"old")
    (tmp_path / "link").symlink_to("real")
    write_atomically(tmp_path / "link", b"new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_bytes() == b"new"


def test_device_is_written_to_and_stays_a_device() -> None:
    check_writable(os.devnull)
    write_atomically(os.devnull, b"x")
    assert Path(os.devnull).is_char_device()
