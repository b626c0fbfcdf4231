"""The arguments of ``cavsumo.run`` as the settings of a scenario file, objects by their names."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from typing import Any, get_args

import numpy

from cavsumo.errors import InputError
from cavsumo.model.objects import SentObject, objects_among, sent
from cavsumo.model.scenario import Scenario
from cavsumo.model.scenario.fields import settings as offered

# The settings that are lists: one value will do for a list of one, text may hold several.
LISTS = {s.key: s.option.separator for s in offered() if get_args(s.type)[1:] == (...,)}


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
        return [_agent(one, objects) for one in _several(key, value)]
    if key in ("ego", "assertions"):
        names = [_named(one, objects) for one in _several(key, value)]
        return names if key == "assertions" else names[0]
    if key in LISTS:
        return [_text(one) for one in _several(key, value)]
    return _text(value)


def _several(key: str, value: Any) -> list[Any]:
    """The values of a list, of one value, or of text that holds several as on a command line."""
    if isinstance(value, str) and (separator := LISTS.get(key)):
        return [word for word in re.split(f"[{separator}]+", value) if word]
    return list(value) if isinstance(value, list | tuple) else [value]


def _agent(agent: Any, objects: list[SentObject]) -> str:
    """The word for an agent; an object has the label of its class."""
    name = _named(agent, objects)
    return name if isinstance(agent, str) else f"{objects[-1].label}={name}"


def _named(thing: Any, objects: list[SentObject]) -> str:
    """The name of an agent, an ego or an assertion, as given or of the object."""
    if isinstance(thing, str):
        objects += objects_among([thing])  # of a scenario that was played before
        return thing
    objects.append(sent(thing))
    return objects[-1].name


def _text(value: Any) -> Any:
    """A path as text, a number of numpy as one of Python, anything else as it is."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, Mapping):
        return {key: _text(inner) for key, inner in value.items()}
    return value.item() if isinstance(value, numpy.generic) else value
