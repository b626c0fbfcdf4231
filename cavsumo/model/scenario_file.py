"""Scenario files (TOML): their settings, with paths resolved."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cavsumo.errors import InputError
from cavsumo.model.documents import LARGEST_TOML_B, read_text, toml_of
from cavsumo.model.labels import labelled
from cavsumo.model.named_networks import is_named, is_word
from cavsumo.model.scenario import check_keys

VARY = "vary"  # the table that makes a study of a scenario file
PATH_KEYS = ("net", "routes", "additional")
NAMED_KEYS = ("net", "routes")  # of those, what may be the name of a network of cavsumo's


def read_config(file: Path) -> dict[str, Any]:
    """The settings of a scenario file (TOML) that describes one scenario."""
    data = read_toml(file)
    if VARY in data:
        what = "makes several batches of it; cavsumo.run_study plays them"
        raise InputError(f"config {str(file)!r}: [{VARY}] {what}")
    return settings_in(data, file)


def read_toml(file: Path) -> dict[str, Any]:
    """The content of a scenario file, unchecked."""
    text = read_text(file, "config", largest=LARGEST_TOML_B)
    try:
        return toml_of(text)
    except ValueError as error:
        raise InputError(f"config {str(file)!r}: {error}") from error


def settings_in(data: Mapping[str, Any], file: Path, place: str = "") -> dict[str, Any]:
    """The settings of a table of a scenario file: keys checked, paths resolved."""
    check_keys(data, place or str(file))
    return {k: _resolved(k, v, file.parent) for k, v in data.items()}


def _resolved(key: str, value: Any, folder: Path) -> Any:
    """A path of a scenario file, which is relative to that file, as in SUMO's own files."""
    if key == "agents" and isinstance(value, list):
        return [_resolved_agent(name, folder) for name in value]
    if key not in PATH_KEYS or value == "none":
        return value
    if isinstance(value, list):
        return [str(folder / str(v)) for v in value]
    file = folder / str(value)
    if key in NAMED_KEYS and not file.is_file():
        word = Path(str(value))
        if is_named(word) or (is_word(word) and not file.exists()):
            return str(value)
    return str(file)


def _resolved_agent(word: Any, folder: Path) -> Any:
    """An agent of a scenario file; the file of a policy is a path like any other."""
    label, name = labelled(str(word))
    prefix, _, file = name.partition(":")
    if prefix != "policy" or not file:
        return word
    found = f"{prefix}:{folder / file}"
    return found if label == name else f"{label}={found}"
