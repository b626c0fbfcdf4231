"""SUMO configurations (.sumocfg): the files of a scenario that they name."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from cavsumo.errors import InputError

ENDING = ".sumocfg"
# SUMO's options in their long forms and the shorter ones that it takes as well.
OPTIONS: Mapping[str, tuple[str, ...]] = {
    "net": ("net-file", "net"),
    "routes": ("route-files", "routes"),
    "additional": ("additional-files", "additional"),
}


def with_configuration(settings: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Settings with the files of a configuration that is named in place of a network.

    Files that the settings name go before those of the configuration, and so does traffic that is
    to be drawn. Where a configuration names no routes, the roads are empty. Raises InputError.
    """
    file = Path(settings["net"])
    if file.suffix != ENDING:
        return dict(settings)
    found = {key: _files(file, _read(file, source), key) for key in OPTIONS}
    if len(found["net"]) != 1:
        raise InputError(f"{source}: {str(file)!r} names no network (net-file)")
    if len(found["routes"]) > 1 and settings.get("routes") is None:
        raise InputError(
            f"{source}: {str(file)!r} names {len(found['routes'])} route files, a batch has one; "
            "name it with --routes FILE"
        )
    whole: dict[str, Any] = {"additional": found["additional"]}
    if str(settings.get("traffic", "none")) == "none":
        whole["routes"] = next(iter(found["routes"]), "none")
    given = {key: value for key, value in settings.items() if value is not None}
    return whole | given | {"net": found["net"][0]}


def _read(file: Path, source: str) -> ElementTree.Element:
    """The root of a configuration."""
    try:
        root = ElementTree.parse(file).getroot()
    except OSError as error:
        raise InputError(f"{source}: {str(file)!r}: {error.strerror}") from error
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise InputError(f"{source}: {str(file)!r}: not well-formed XML: {error}") from error
    return root


def _files(file: Path, root: ElementTree.Element, key: str) -> list[str]:
    """The files of an option, relative to the configuration as SUMO has them."""
    for name in OPTIONS[key]:
        for option in root.iter(name):
            words = (option.get("value") or option.get("v") or "").split(",")
            return [str(file.parent / word.strip()) for word in words if word.strip()]
    return []
