"""Egos by name: building them, and the files that define them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from cavsumo.egos.base import EGOS, Ego
from cavsumo.egos.controller import ControllerEgo, controller_class
from cavsumo.egos.external.ego import EXTERNAL, command_words
from cavsumo.model.plugins import source_file
from cavsumo.model.registry import Registry

# Forms of an ego's name besides a registered name, for listings.
FORMS: Mapping[str, str] = {
    "module:Class": "a Python class that answers each snapshot (README, docs/architecture.md)",
    "exec:COMMAND": "a program in any language, over its stdin and stdout (docs/ego-protocol.md)",
    "tcp:HOST:PORT": "a program that listens there, by the same protocol",
}


def make_ego(spec: str, params: Mapping[str, Any]) -> Ego:
    """The registered ego of that name, an external one, or the controller ``module:Class``."""
    sort, colon, _ = spec.partition(":")
    if not colon:
        return EGOS.make(spec, params)
    if sort in EXTERNAL:
        alone: Registry[Ego] = Registry("ego")  # so that messages have the full name
        alone.register(spec)(partial(EXTERNAL.get(sort), spec))
        return alone.make(spec, params)
    return ControllerEgo(spec, controller_class(spec), params)


def ego_files(spec: str) -> tuple[Path, ...]:
    """The files that define an ego: those that a command names, or the class's module."""
    sort, colon, address = spec.partition(":")
    if not colon or sort == "tcp":
        return ()
    if sort == "exec":
        words = dict.fromkeys(command_words(address))
        return tuple(file for file in map(Path, words) if file.is_file())
    controller_class(spec)
    source = source_file(spec)
    return (source,) if source else ()
