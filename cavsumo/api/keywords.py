"""The arguments of ``cavsumo.run`` as the settings of a scenario file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from cavsumo.errors import InputError
from cavsumo.model.scenario import Scenario

LISTS = ("agents", "assertions", "approaches", "additional")  # one word will do for a list of it


def settings_of(net: Any, keywords: Mapping[str, Any]) -> dict[str, Any]:
    """The settings that a call gives; an argument that is None is not given.

    Args:
        net: a network's name or file, a whole scenario, or None.
        keywords: settings by name.

    Raises InputError for a network that is none of these.
    """
    if isinstance(net, Scenario):
        settings = _of_scenario(net)
    elif net is None or isinstance(net, str | os.PathLike):
        settings = {"net": net}
    else:
        raise InputError(f"run: net: expected a name, a file or a Scenario, got {net!r}")
    given = {**settings, **keywords}
    return {key: _plain(key, value) for key, value in given.items() if value is not None}


def _of_scenario(scenario: Scenario) -> dict[str, Any]:
    """The settings of a scenario; without routes its roads are empty."""
    return {"routes": "none"} | scenario.model_dump(mode="json", exclude_none=True)


def _plain(key: str, value: Any) -> Any:
    """A setting as a scenario file has it: lists of words, and words for paths."""
    if key in LISTS:
        several = value if isinstance(value, list | tuple) else [value]
        return [_text(one) for one in several]
    return _text(value)


def _text(value: Any) -> Any:
    """A path as text, anything else as it is."""
    return os.fspath(value) if isinstance(value, os.PathLike) else value
