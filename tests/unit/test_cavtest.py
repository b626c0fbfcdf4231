"""Kept tests from strangers: nothing but their own members is read, and no more than a size."""

from __future__ import annotations

import json
import stat
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from cavsumo.errors import ResultsError
from cavsumo.kept import cavtest
from cavsumo.kept.cavtest import ABOUT, FORMAT, PAGE, TRACE, read_cavtest, unpacked

GOOD = {ABOUT: json.dumps({"format": FORMAT}).encode(), PAGE: b"<p>", TRACE: b"x"}
Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Call with members: a zip of them."""

    def one(members: dict[str, bytes], *, mode: int = 0, twice: str = "") -> Path:
        file = tmp_path / "a.cavtest"
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in [*members.items(), *([(twice, b"")] if twice else [])]:
                info = zipfile.ZipInfo(name)
                info.external_attr = (mode if name == PAGE else 0) << 16
                info.compress_type = zipfile.ZIP_DEFLATED
                archive.writestr(info, data)
        return file

    return one


def refused(file: Path) -> str:
    """The sentence by which a file is refused."""
    with pytest.raises(ResultsError) as error:
        unpacked(file)
    said = str(error.value)
    assert said.startswith(f"test {str(file)!r}: ")
    assert "\n" not in said
    return said


def test_members_are_unpacked_once(write: Write) -> None:
    """Into a folder of this process; nothing else is in it."""
    folder = unpacked(write(GOOD))
    assert {path.name for path in folder.iterdir()} == {*GOOD, "inputs"}
    assert (folder / PAGE).read_bytes() == b"<p>"
    assert unpacked(write(GOOD)) == folder


@pytest.mark.parametrize(
    "name",
    [
        "/etc/passwd", "../a.json", "inputs/../../a.net.xml", "C:\\a", "inputs\\a", "evil.py",
        "inputs/", "inputs/a.net.xml", "inputs/x/a-0123456789ab.net.xml.gz", "TEST.JSON", "a" * 300,
    ],
)  # fmt: skip
def test_other_names_are_refused(write: Write, name: str) -> None:
    """Absolute and climbing ones among them; one sentence quotes the name, not at length."""
    said = refused(write({**GOOD, name: b""}))
    assert "which no test has" in said
    assert len(said) < 400


@pytest.mark.parametrize("mode", [stat.S_IFLNK | 0o777, stat.S_IFDIR, stat.S_IFIFO])
def test_only_plain_files(write: Write, mode: int) -> None:
    """No links, folders, pipes."""
    assert "is no plain file" in refused(write(GOOD, mode=mode))


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_nothing_twice_and_nothing_missing(write: Write) -> None:
    """Which of two would count?"""
    assert "twice or too many" in refused(write(GOOD, twice=PAGE))
    assert "it holds no page.html" in refused(write({ABOUT: b"{}", TRACE: b""}))
    many = {f"inputs/a-{i:012x}.xml.gz": b"" for i in range(101)}
    assert "twice or too many" in refused(write(GOOD | many))


def test_a_bomb_is_refused(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each member up to its size, and all together; sizes in the zip are not believed."""
    assert f"{ABOUT} holds more than" in refused(write({**GOOD, ABOUT: bytes(2 << 20)}))
    monkeypatch.setattr(cavtest, "MOST_ALL_B", 3 << 20)
    bomb = {f"inputs/a-{i:012x}.xml.gz": bytes(2 << 20) for i in range(3)}
    assert "holds more than" in refused(write(GOOD | bomb))


def test_damage_is_one_sentence(write: Write, tmp_path: Path) -> None:
    """No zip, a torn one, one with another content, none."""
    file = write(GOOD)
    data = file.read_bytes()
    assert "is damaged" in refused(_with(file, b"no zip"))
    assert "is damaged" in refused(_with(file, data[: len(data) // 2]))
    broken = bytearray(data)
    broken[data.index(b"page.html") + 9 + 1] ^= 0xFF  # in the compressed content
    refused(_with(file, bytes(broken)))
    assert "cannot be read" in refused(tmp_path / "nowhere.cavtest")


def test_another_version_is_named(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not read as if it were this one."""
    file = write({**GOOD, ABOUT: b'{"format": "cavsumo-test-9"}'})
    with pytest.raises(ResultsError, match=r"format 'cavsumo-test-9', this version reads"):
        cavtest._about(file, unpacked(file))
    with pytest.raises(ResultsError, match="trace"):
        read_cavtest(write(GOOD))


def _with(file: Path, data: bytes) -> Path:
    """The file with another content."""
    file.write_bytes(data)
    return file
