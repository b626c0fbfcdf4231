"""Inputs kept beside results: small, reproducible, and harmless when a stranger made them."""

from __future__ import annotations

import gzip
import hashlib
import os
import shutil
from pathlib import Path

import pytest

from cavsumo.errors import InputError, ResultsError
from cavsumo.model.scenario import BatchPlan, plan_from
from cavsumo.results import inputs
from cavsumo.results.inputs import inputs_folder, keep, kept_name, remove_others, unpacked
from cavsumo.results.present import present_paths
from cavsumo.results.writing import Recorder

TEXT = b"<net>" + 1000 * b"<edge/>" + b"</net>\n"
SHA = hashlib.sha256(TEXT).hexdigest()


@pytest.fixture
def net(tmp_path: Path) -> Path:
    """A file to keep."""
    file = tmp_path / "town.net.xml"
    file.write_bytes(TEXT)
    return file


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of inputs of results.csv."""
    return inputs_folder(tmp_path / "results.csv")


def test_a_file_comes_back_as_it_was(net: Path, folder: Path) -> None:
    """Compressed under a readable name; the copy has the old name in a temporary folder."""
    assert keep(folder, net, SHA)
    (kept,) = folder.iterdir()
    assert kept.name == f"town-{SHA[:12]}.net.xml.gz"
    assert kept.stat().st_size < len(TEXT) / 10
    copy = unpacked(folder, SHA)
    assert copy is not None
    assert (copy.name, copy.read_bytes()) == ("town.net.xml", TEXT)
    assert unpacked(folder, SHA) == copy
    assert unpacked(folder, "0" * 64) is None


def test_equal_content_makes_equal_bytes(net: Path, tmp_path: Path) -> None:
    """At any time and from any place; a file that is there is not written again."""
    folders = tmp_path / "a" / "inputs", tmp_path / "b" / "inputs"
    other = tmp_path / "elsewhere" / net.name
    other.parent.mkdir()
    other.write_bytes(TEXT)
    os.utime(other, (0, 0))
    for folder, file in zip(folders, (net, other), strict=True):
        assert keep(folder, file, SHA)
    first, second = (next(folder.iterdir()) for folder in folders)
    assert (first.name, first.read_bytes()) == (second.name, second.read_bytes())
    os.utime(first, (0, 0))
    assert keep(folders[0], net, SHA)
    assert first.stat().st_mtime == 0


@pytest.mark.parametrize("name", ["a b/c", "net", ".net.xml", "ü.xml.gz", "a-0123456789ab.b..xml"])
def test_any_name_is_found_again(name: str, tmp_path: Path, folder: Path) -> None:
    """Characters that are no part of plain names are replaced."""
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(TEXT)
    keep(folder, file, SHA)
    copy = unpacked(folder, SHA)
    assert copy is not None
    assert copy.read_bytes() == TEXT


def test_long_names_are_cut(tmp_path: Path) -> None:
    """A name with digits and ending fits into any file system."""
    assert len(kept_name(tmp_path / ("x" * 250 + ".net.xml"), SHA)) < 200


def test_a_file_that_is_too_large_is_not_kept(
    net: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It says so; nothing is written."""
    monkeypatch.setattr(inputs, "LARGEST", len(TEXT) - 1)
    assert not keep(folder, net, SHA)
    assert not folder.exists()


def test_a_file_that_changes_meanwhile_is_not_kept(net: Path, folder: Path) -> None:
    """Its checksum was computed before."""
    with pytest.raises(ResultsError, match="was changed while the batch began"):
        keep(folder, net, "0" * 64)
    assert list(folder.iterdir()) == []


def test_a_bomb_is_not_unpacked(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Decompression stops at the largest size."""
    monkeypatch.setattr(inputs, "LARGEST", 2**20)
    data = bytes(8 * 2**20)
    sha = hashlib.sha256(data).hexdigest()
    folder.mkdir(parents=True)
    (folder / f"bomb-{sha[:12]}.net.xml.gz").write_bytes(gzip.compress(data))
    with pytest.raises(ResultsError, match="is damaged: it holds more than 1 MiB"):
        unpacked(folder, sha)


@pytest.mark.parametrize(
    "data",
    [gzip.compress(b"other"), gzip.compress(TEXT)[:-20], b"no gzip"],
    ids=["other", "cut", "no gzip"],
)
def test_another_content_is_refused(folder: Path, data: bytes) -> None:
    """In one sentence that names the file; no copy remains."""
    folder.mkdir(parents=True)
    (folder / f"town-{SHA[:12]}.net.xml.gz").write_bytes(data)
    sha = SHA[:12] + "1" * 52  # not one of which a copy was made before
    with pytest.raises(ResultsError, match=r"net\.xml\.gz': is damaged: ") as error:
        unpacked(folder, sha)
    assert "\n" not in str(error.value)


def test_a_link_out_of_the_folder_is_not_followed(net: Path, folder: Path, tmp_path: Path) -> None:
    """A stranger's folder leads nowhere else."""
    folder.mkdir(parents=True)
    away = tmp_path / "away.gz"
    away.write_bytes(gzip.compress(TEXT))
    (folder / f"town-{SHA[:12]}.net.xml.gz").symlink_to(away)
    assert unpacked(folder, SHA) is None


@pytest.mark.parametrize("sha", ["", "../..", "*", SHA.upper(), SHA + "0"])
def test_a_checksum_that_is_none_finds_nothing(net: Path, folder: Path, sha: str) -> None:
    """It comes from a manifest and is no part of a path."""
    keep(folder, net, SHA)
    assert unpacked(folder, sha) is None


def test_inputs_of_another_batch_are_removed(net: Path, folder: Path, tmp_path: Path) -> None:
    """Those with other checksums, and nothing else that lies there."""
    keep(folder, net, SHA)
    (folder / f"old-{'0' * 12}.rou.xml.gz").write_bytes(b"")
    (folder / "notes.txt").write_bytes(b"")
    remove_others(folder, {SHA})
    assert {f.name for f in folder.iterdir()} == {f"town-{SHA[:12]}.net.xml.gz", "notes.txt"}


# Found


@pytest.fixture
def plan(net: Path) -> BatchPlan:
    """A plan on that network."""
    return plan_from({"net": net, "routes": "none"}, "test")


def test_a_file_is_taken_where_it_was_before_its_copies(
    net: Path, plan: BatchPlan, tmp_path: Path, folder: Path
) -> None:
    """Where it was, beside the results, among their inputs: the first of that content."""
    keep(folder, net, SHA)
    beside, origin, file = tmp_path / "sub", {"sha256": {str(net): SHA}}, tmp_path / "results.csv"
    assert present_paths(plan, origin, file) == {}
    net.write_bytes(b"edited")
    kept = present_paths(plan, origin, file)[str(net)]
    assert kept.read_bytes() == TEXT
    beside.mkdir()
    (beside / net.name).write_bytes(TEXT)
    moved = present_paths(plan, origin, beside / "results.csv")
    assert moved == {str(net): beside / net.name}


def test_a_file_that_is_nowhere_is_named(net: Path, plan: BatchPlan, tmp_path: Path) -> None:
    """With its checksum and the ways out; one of another content is told apart."""
    origin, file = {"sha256": {str(net): SHA}}, tmp_path / "sub" / "results.csv"
    net.write_bytes(b"edited")
    with pytest.raises(InputError, match=rf"not the 'town.net.xml' \(sha256 {SHA[:12]}"):
        present_paths(plan, origin, file)
    net.unlink()
    with pytest.raises(InputError, match="which is not here; name it with --net FILE or put it"):
        present_paths(plan, origin, file)
    with pytest.raises(InputError, match="sha256 unknown"):
        present_paths(plan, {}, file)


# Written


def test_links_in_a_strangers_folder_are_not_followed(
    net: Path, folder: Path, tmp_path: Path
) -> None:
    """What is written replaces the link, or is refused; nothing outside changes."""
    outside = tmp_path / "outside"
    outside.mkdir()
    folder.mkdir(parents=True)
    (folder / f".{SHA[:12]}.new").symlink_to(outside / "new")
    (folder / kept_name(net, SHA)).symlink_to(outside / "kept")
    assert keep(folder, net, SHA)
    assert gzip.decompress((folder / kept_name(net, SHA)).read_bytes()) == TEXT
    shutil.rmtree(folder)
    folder.symlink_to(outside)
    with Recorder(tmp_path / "results.csv") as recorder:
        recorder.begin({})
        with pytest.raises(ResultsError, match="inputs' is a link"):
            recorder.keep({SHA: net})
    assert list(outside.iterdir()) == []
