"""The identity of a batch: its plan, files, versions, and SUMO's options."""

from __future__ import annotations

import hashlib
import importlib.metadata
import platform
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from cavsumo import __version__
from cavsumo.assertions.specs import assertion_files
from cavsumo.egos.specs import ego_files
from cavsumo.model.checksums import checksum
from cavsumo.model.gone_settings import without_gone
from cavsumo.model.scenario import Scenario
from cavsumo.network.site import Site

# Settings that determine how much of a batch is played, not its episodes.
EXTENT = frozenset(
    {"runs", "deadline_s", "first", "until_tests", "until_half_width", "until_rate", "budget_s"}
)


def checksums(scenario: Scenario, agent_files: Iterable[Path]) -> dict[str, str]:
    """The SHA-256 of every file of a batch: its scenario's, its ego's, agents' and assertions'."""
    found = {str(scenario.net): scenario.net_file}
    if scenario.routes is not None and scenario.routes_file is not None:
        found[str(scenario.routes)] = scenario.routes_file
    found |= {str(file): scenario.present(file) for file in (*scenario.additional, *agent_files)}
    programs = (*ego_files(scenario.ego), *assertion_files(scenario.assertions))
    found |= {str(file): file for file in programs}
    return {name: checksum(file) for name, file in found.items()}


def versions(more: Iterable[str] = ()) -> dict[str, str]:
    """The versions of the packages on which results depend: on those always, and on more."""
    packages = ("libsumo", "sumolib", "numpy", "shapely", *more)
    return {"cavsumo": __version__, "python": platform.python_version()} | {
        name: importlib.metadata.version(name) for name in packages
    }


def traffic_checksum(site: Site) -> dict[str, str]:
    """The SHA-256 of drawn background traffic, if any."""
    if site.demand is None:
        return {}
    return {"traffic": hashlib.sha256(site.demand.encode()).hexdigest()}


def differences(
    first: Mapping[str, Any], second: Mapping[str, Any], *, apart: frozenset[str] = EXTENT
) -> Iterator[str]:
    """The differences of two manifests as batches, in words, without some settings."""
    plans = [without_gone(m.get("plan") or {}) for m in (first, second)]
    scenarios = [plan.pop("scenario", {}) for plan in plans]
    for name, (was, is_) in (*unequal(*scenarios), *unequal(*plans)):
        if name not in apart:
            yield f"{name} was {was!r}, is {is_!r}"
    yield from changes(first, second)


def changes(recorded: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """The changes around an unchanged plan: versions, files, SUMO's options."""
    for part in ("versions", "sha256", "sumo_options"):
        for name, (was, is_) in unequal(recorded.get(part) or {}, now[part]):
            # The ego wrote the file since; it was not an input. And the package chose the points of
            # a search: an episode does not depend on it, and earlier results did not name it.
            if part in ("sha256", "versions") and was is None:
                continue
            yield f"{part}: {name} was {was}, is {is_}"


def unequal(
    first: Mapping[str, Any], second: Mapping[str, Any]
) -> Iterator[tuple[str, tuple[Any, Any]]]:
    """The keys with different values, and the values; None for a missing one."""
    for key in {**first, **second}:
        if first.get(key) != second.get(key):
            yield key, (first.get(key), second.get(key))
