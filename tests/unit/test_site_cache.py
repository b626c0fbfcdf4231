"""Sites of large networks are kept on disk: found again by content, never trusted, never needed."""

from __future__ import annotations

import hashlib
import os
import pickle
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from cavsumo.model.bodies import CAR
from cavsumo.network import site_cache
from cavsumo.network.site import Site, Wishes, derive_site
from cavsumo.network.site_cache import site_of
from cavsumo.network.traffic import Volume

WALKING, DRIVING = Wishes(), Wishes(kind=CAR)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache, in which every network is large enough to be kept."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(site_cache, "LARGE", 0)
    return tmp_path / "cavsumo"


@pytest.fixture
def derived(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """The networks that are read."""
    found: list[Path] = []

    def derive(net: Path, *asked: Any) -> Site:
        found.append(net)
        return derive_site(net, *asked)

    monkeypatch.setattr(site_cache, "derive_site", derive)
    return found


@pytest.fixture
def net(networks: Mapping[str, Path], tmp_path: Path) -> Path:
    """A copy of a network with a crossing, which a test may change."""
    return Path(shutil.copy(networks["junction"], tmp_path))


def asked(net: Path, wishes: Wishes = WALKING) -> bytes:
    """All that is known of a site."""
    return pickle.dumps(site_of(net, (), None, CAR, wishes))


@pytest.mark.parametrize("wishes", [WALKING, DRIVING, Wishes(signal="red"), Wishes(jaywalk=True)])
def test_a_site_is_derived_once(
    cache: Path, derived: list[Path], net: Path, wishes: Wishes
) -> None:
    """Who asks again gets the same, to the last bit, and no network is read."""
    first = asked(net, wishes)
    assert asked(net, wishes) == first
    assert derived == [net]
    assert len(list(cache.iterdir())) == 1


def test_other_wishes_and_other_contents_are_other_sites(
    cache: Path, derived: list[Path], net: Path
) -> None:
    """What a site depends on is in the name of its entry."""
    volumes = [Volume(6.0, 3.0, 60.0, seed) for seed in (1, 2)]
    sites = {asked(net), asked(net, DRIVING), *(asked(net, Wishes(volume=v)) for v in volumes)}
    net.write_text(net.read_text(encoding="utf-8") + "<!-- other -->", encoding="utf-8")
    asked(net)
    assert len(sites) == 4
    assert len(derived) == len(list(cache.iterdir())) == 5


def test_another_program_derives_anew(
    cache: Path, derived: list[Path], net: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Entries of other versions are left alone."""
    asked(net)
    monkeypatch.setattr(site_cache, "_program", lambda: ("another",))
    asked(net)
    assert len(derived) == len(list(cache.iterdir())) == 2


def test_a_network_is_known_wherever_it_lies(
    cache: Path, derived: list[Path], net: Path, tmp_path: Path
) -> None:
    """A site names the file that was asked for."""
    asked(net)
    moved = net.rename(tmp_path / "moved.net.xml")
    assert site_of(moved, (), None, CAR, WALKING).net == moved
    assert derived == [net]


class _Code:
    """An object that runs code when it is unpickled."""

    def __reduce__(self) -> tuple[Callable[[str], None], tuple[str]]:
        return os.mkdir, ("made",)


def whole(body: bytes) -> bytes:
    """An entry with a right checksum."""
    return hashlib.sha256(body).digest() + body


@pytest.mark.parametrize(
    "damage",
    [b"", b"x" * 40, whole(b"no pickle"), whole(pickle.dumps(1)), whole(pickle.dumps(_Code()))],
    ids=["empty", "torn", "no pickle", "no site", "code"],
)
def test_what_is_no_site_is_derived_anew(
    cache: Path, derived: list[Path], net: Path, damage: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An entry that somebody else has written runs no code."""
    monkeypatch.chdir(net.parent)
    first = asked(net)
    (entry,) = cache.iterdir()
    good = entry.read_bytes()
    entry.write_bytes(damage)
    assert asked(net) == first
    assert entry.read_bytes() == good
    assert not Path("made").exists()
    assert len(derived) == 2


def test_the_newest_are_kept(
    cache: Path, net: Path, monkeypatch: pytest.MonkeyPatch, derived: list[Path]
) -> None:
    """The cache does not grow for ever, and leaves what is not its own."""
    monkeypatch.setattr(site_cache, "MOST", 2)
    cache.mkdir()
    (cache / "game-of-others.bin").touch()
    for wishes in (WALKING, DRIVING, Wishes(signal="red")):
        asked(net, wishes)
    assert len(list(cache.glob("site-*"))) == 2
    assert (cache / "game-of-others.bin").exists()
    asked(net, Wishes(signal="red"))
    assert len(derived) == 3


def test_small_networks_and_refusals_are_not_kept(
    cache: Path, derived: list[Path], net: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those are read as quickly; and a refusal names its file."""
    monkeypatch.setattr(site_cache, "LARGE", 10_000_000)
    asked(net)
    assert derived == [net]
    assert not cache.exists()
