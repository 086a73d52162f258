from __future__ import annotations

import os
import zipfile
from pathlib import Path

import pytest

from jaxbrdf.data import input as data_input
from jaxbrdf.errors import DataError


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    with zipfile.ZipFile(tmp_path / "many.zip", "w") as members:
        members.writestr("folder/one.h5", b"one")
        members.writestr("empty.h5", b"")
    return tmp_path / "many.zip"


def test_member_by_full_name_or_last_part(archive: Path) -> None:
    assert data_input.read(archive / "folder" / "one.h5") == b"one"
    assert data_input.read(archive / "one.h5") == b"one"


def test_archive_itself_is_a_file(archive: Path) -> None:
    assert data_input.read(archive) == archive.read_bytes()


@pytest.mark.parametrize(("name", "said"), [("two.h5", "no member 'two.h5'"), ("empty.h5", "empty")])
def test_member_that_is_not_usable(name: str, said: str, archive: Path) -> None:
    with pytest.raises(DataError, match=said):
        data_input.read(archive / name)


def test_broken_archive(archive: Path) -> None:
    content = bytearray(archive.read_bytes())
    for broken in (content[:40], bytes(len(content)), content.replace(b"one", b"eno", 1)):
        archive.write_bytes(broken)
        with pytest.raises(DataError, match="archive"):
            data_input.read(archive / "one.h5")


def test_what_is_not_a_readable_file(tmp_path: Path) -> None:
    (tmp_path / "empty").write_bytes(b"")
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "loop").symlink_to("loop")
    cases = {
        "missing": "no such file",
        ".": "folder",
        "empty": "empty",
        "pipe": "neither a file nor a folder",
        "loop": "circle",
        "empty/in": "not a folder",
        "n" * 300: "too long",
        "a\0b": "null",
    }
    for name, said in cases.items():
        with pytest.raises(DataError, match=said):
            data_input.read(tmp_path / name)


def test_no_permission(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "secret").write_bytes(b"x")

    def refuse(*_args, **_kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(DataError, match="permission denied"):
        data_input.read(tmp_path / "secret")


def test_too_large(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(data_input, "MOST_BYTES", 3)
    (tmp_path / "large").write_bytes(b"1234")
    with pytest.raises(DataError, match="larger than 3 bytes"):
        data_input.read(tmp_path / "large")
