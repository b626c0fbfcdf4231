"""The arguments of ``cavsumo.run`` as the settings of a scenario file, objects by their names."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from cavsumo.errors import InputError
from cavsumo.model.objects import SentObject, sent
from cavsumo.model.scenario import Scenario

LISTS = ("agents", "assertions", "approaches", "additional")  # one word will do for a list of it


def settings_of(net: Any, keywords: Mapping[str, Any]) -> tuple[dict[str, Any], list[SentObject]]:
    """The settings that a call gives, and the objects among them.

    Args:
        net: a network's name or file, a whole scenario, or None.
        keywords: settings by name; one that is None is not given.

    Raises InputError for a network that is none of these, and an object that cannot be sent.
    """
    if isinstance(net, Scenario):
        settings = _of_scenario(net)
    elif net is None or isinstance(net, str | os.PathLike):
        settings = {"net": net}
    else:
        raise InputError(f"run: net: expected a name, a file or a Scenario, got {net!r}")
    given = {k: v for k, v in {**settings, **keywords}.items() if v is not None}
    objects: list[SentObject] = []
    return {key: _plain(key, value, objects) for key, value in given.items()}, objects


def _of_scenario(scenario: Scenario) -> dict[str, Any]:
    """The settings of a scenario; without routes its roads are empty."""
    return {"routes": "none"} | scenario.model_dump(mode="json", exclude_none=True)


def _plain(key: str, value: Any, objects: list[SentObject]) -> Any:
    """A setting as a scenario file has it: lists of words, and words for paths and objects."""
    if key == "agents" and isinstance(value, Mapping):
        return [f"{label}={_named(agent, objects)}" for label, agent in value.items()]
    if key == "agents":
        return [_agent(one, objects) for one in _several(value)]
    if key in ("ego", "assertions"):
        names = [_named(one, objects) for one in _several(value)]
        return names if key == "assertions" else names[0]
    if key in LISTS:
        return [_text(one) for one in _several(value)]
    return _text(value)


def _several(value: Any) -> list[Any]:
    """One as a list of one."""
    return list(value) if isinstance(value, list | tuple) else [value]


def _agent(agent: Any, objects: list[SentObject]) -> str:
    """The word for an agent; an object has the label of its class."""
    name = _named(agent, objects)
    return name if isinstance(agent, str) else f"{objects[-1].label}={name}"


def _named(thing: Any, objects: list[SentObject]) -> str:
    """The name of an agent, an ego or an assertion, as given or of the object."""
    if isinstance(thing, str):
        return thing
    objects.append(sent(thing))
    return objects[-1].name


def _text(value: Any) -> Any:
    """A path as text, anything else as it is."""
    return os.fspath(value) if isinstance(value, os.PathLike) else value
