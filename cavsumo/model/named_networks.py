"""The networks that come with cavsumo, by name: ``crossing`` instead of a path.

They are in the package (``data/`` of a wheel) or, in a checkout, in ``networks/`` and ``routes/``
beside it. Plans, manifests and traces contain the name, not the path, which differs between
machines. A file of that name takes precedence; a folder does not, since traces have folders.
"""

from __future__ import annotations

import importlib.resources
import shlex
from pathlib import Path

from cavsumo.errors import InputError, UnknownName
from cavsumo.model.visible_files import is_visible

DEFAULT = "crossing"
ENDING = ".net.xml"
OSM_ENDINGS = (".osm", ".osm.xml", ".osm.gz", ".osm.xml.gz", ".osm.bz2", ".pbf")
ROUTES = Path("cavsumo/data/routes")  # stands for the folder of their demand


def names() -> list[str]:
    """The names of the networks that there are, in order."""
    return sorted(f.name.removesuffix(ENDING) for f in _folder("networks").glob(f"*{ENDING}"))


def is_named(net: Path) -> bool:
    """Whether a word is the name of a network and not a file."""
    return not is_visible(net) and str(net) in names()


def network_file(net: Path) -> Path:
    """The file of the network with that name, or the path itself."""
    return _folder("networks") / f"{net}{ENDING}" if is_named(net) else net


def check_network(net: Path, source: str = "") -> None:
    """Raise InputError for an unknown name of a network, and for OpenStreetMap data."""
    if net.name.lower().endswith(OSM_ENDINGS):
        target = net.name.split(".")[0] + ENDING
        command = shlex.join(["cavsumo", "import-osm", str(net), "-o", target])
        place = f"{source}: " if source else ""
        raise InputError(
            f"{place}{str(net)!r} is OpenStreetMap data; make a network of it: {command}"
        )
    if is_word(net) and not net.exists() and not is_named(net):
        raise UnknownName("network", str(net), names(), source)


def is_word(net: Path) -> bool:
    """Whether a path could be a name: it has neither a folder nor an ending."""
    return net.name == str(net) and bool(net.name) and not net.suffix


def routes_of(name: Path) -> Path | None:
    """The demand of a named network as plans hold it; None if it has none."""
    routes = ROUTES / f"{name}.rou.xml"
    return routes if routes_file(routes).is_file() else None


def named_routes(routes: Path, source: str = "") -> Path:
    """The demand of the network of that name as plans hold it, or the path itself.

    Raises UnknownName for a word that is neither a file nor the name of a network with a demand.
    """
    if not is_word(routes) or is_visible(routes):
        return routes
    found = routes_of(routes) if is_named(routes) else None
    if found is None:
        raise UnknownName("routes", str(routes), [n for n in names() if routes_of(Path(n))], source)
    return found


def routes_file(routes: Path) -> Path:
    """The file of the demand of a named network, or the path itself."""
    named = routes.parent == ROUTES and not is_visible(routes)
    return _folder("routes") / routes.name if named else routes


def _folder(sort: str) -> Path:
    """The folder of the networks or the routes: in the package, else beside it in a checkout."""
    package = Path(str(importlib.resources.files("cavsumo")))
    packed = package / "data" / sort
    return packed if packed.is_dir() else package.parent / sort
