"""Egos by name: building them, and the files that define them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from cavsumo.egos.base import EGOS, Ego
from cavsumo.egos.controller import ControllerEgo, controller_class
from cavsumo.egos.external.ego import EXTERNAL, command_words
from cavsumo.model.objects import Copies, is_object
from cavsumo.model.plugins import source_file
from cavsumo.model.registry import Registry
from cavsumo.model.visible_files import is_visible

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
        return _alone(spec, partial(EXTERNAL.get(sort), spec)).make(spec, params)
    factory = controller_class(spec)
    if is_object(spec) and _leaves_driving_to_sumo(factory):
        return _alone(spec, factory).make(spec, params)
    return ControllerEgo(spec, factory, params)


def _alone(spec: str, factory: Callable[..., Ego]) -> Registry[Ego]:
    """A registry of one ego, so that its messages have the full name."""
    alone: Registry[Ego] = Registry("ego")
    alone.register(spec)(factory)
    return alone


def _leaves_driving_to_sumo(factory: Callable[..., Any]) -> bool:
    """Whether an object, or what a class makes, is an ego that SUMO drives."""
    made = type(factory()) if isinstance(factory, Copies) else factory
    return isinstance(made, type) and issubclass(made, Ego) and made.act is Ego.act


def ego_files(spec: str) -> tuple[Path, ...]:
    """The files that define an ego: those that a command names, or the class's module."""
    sort, colon, address = spec.partition(":")
    if not colon or sort == "tcp":
        return ()
    if sort == "exec":
        words = dict.fromkeys(command_words(address))
        return tuple(file for file in map(Path, words) if is_visible(file))
    controller_class(spec)
    source = source_file(spec)
    return (source,) if source else ()
