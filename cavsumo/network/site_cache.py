"""Sites of large networks, kept on disk, so that a network is read once and not by every command.

A site is found again by the content of its network, by what was asked of it, and by the program
that derived it: the source files of the rooms that a site is made by, and the versions of the
libraries.

An entry holds a pickled site. It is read by an unpickler that makes only the records of which a
site consists, and calls nothing else, so that a file that somebody else has put there runs no code.
"""

from __future__ import annotations

import dataclasses
import hashlib
import io
import pickle
import platform
from collections.abc import Callable
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import shapely

from cavsumo.model.bodies import Kind
from cavsumo.model.cache import keep, keep_newest, kept
from cavsumo.model.carriageway import Approach, Light, Limit, MarkedCrossing, Roads
from cavsumo.model.checksums import checksum
from cavsumo.model.polyline import Path as Polyline
from cavsumo.model.surroundings import LaneBorders, RouteLane, Surroundings
from cavsumo.network.ego_routes import EgoRoute
from cavsumo.network.pedestrian_starts import StartingArea
from cavsumo.network.site import Site, Wishes, derive_site
from cavsumo.network.traffic_lights import LightStart

LARGE = 500_000  # bytes of a network's file; reading them takes longer than the imports
MOST = 50  # entries
LIBRARIES = ("numpy", "shapely", "sumolib")
RECORDS = (
    *(Site, EgoRoute, Polyline, StartingArea, LightStart, type(Path())),
    *(Approach, Light, Limit, MarkedCrossing, Roads),
    *(Surroundings, RouteLane, LaneBorders),
)
MADE: dict[tuple[str, str], Any] = {
    (one.__module__, one.__qualname__): one for one in (*RECORDS, shapely.from_wkb)
}


def site_of(
    net: Path, ego_route: tuple[str, ...], junction: str | None, ego: Kind, wishes: Wishes
) -> Site:
    """The site that ``derive_site`` derives, of a large network possibly from disk."""

    def derived() -> Site:
        return derive_site(net, ego_route, junction, ego, wishes)

    if not net.is_file() or net.stat().st_size < LARGE:
        return derived()
    return _found(net, repr((ego_route, junction, ego, wishes)), derived)


def _found(net: Path, asked: str, derived: Callable[[], Site]) -> Site:
    """A site from disk, or derived and kept."""
    content = checksum(net)
    name = f"site-{_name(content, asked)}.bin"
    body = kept(name)
    if body is not None:
        try:
            site: Site = _Unpickler(io.BytesIO(body)).load()
            return dataclasses.replace(site, net=net)
        except Exception:  # a file that is none of ours may lead to any; it is written anew
            pass
    site = derived()
    if checksum(net) == content:
        keep(name, pickle.dumps(site, pickle.HIGHEST_PROTOCOL))
        keep_newest("site-*.bin", MOST)
    return site


def _name(content: str, asked: str) -> str:
    """The hash of all that a site depends on."""
    return hashlib.sha256(repr((content, asked, _program())).encode()).hexdigest()[:32]


@cache
def _program() -> tuple[str, ...]:
    """The program that derives sites: its source files, the libraries and Python."""
    package = Path(__file__).parent.parent
    files = sorted(file for room in ("network", "model") for file in (package / room).rglob("*.py"))
    source = hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
    geos = ".".join(map(str, shapely.geos_version))
    return (source, *map(version, LIBRARIES), geos, platform.python_version())


class _Unpickler(pickle.Unpickler):
    """Makes the records of a site."""

    def find_class(self, module: str, name: str) -> Any:
        """One of them; raises UnpicklingError for anything else."""
        try:
            return MADE[module, name]
        except KeyError:
            raise pickle.UnpicklingError(f"{module}.{name} is no part of a site") from None
