"""A table of names: register refuses duplicates, an unknown name suggests the nearest."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from cavsumo.errors import InputError
from cavsumo.model.names import Names, check_parameters, check_shared

T = TypeVar("T")


@dataclass(frozen=True)
class Parameter:
    """One parameter of a registered class, as the listings show it."""

    name: str
    default: Any
    doc: str


class Registry(Generic[T]):
    """Names to classes (or factories) of one sort: agents, egos, assertions.

    Each is called with keyword parameters only; their defaults come from the signature, their
    meaning and units from the class attribute ``PARAMETERS`` (name to one line).

    Args:
        names: those that are declared; their modules are imported when something is built. Or the
            sort alone.
    """

    def __init__(self, names: Names | str) -> None:
        self.names = names if isinstance(names, Names) else Names(names)
        self.sort = self.names.sort
        self._entries: dict[str, Callable[..., T]] = {}

    def register(self, name: str) -> Callable[[Callable[..., T]], Callable[..., T]]:
        """Decorator that registers a class under a name; each name is used once."""

        def file(entry: Callable[..., T]) -> Callable[..., T]:
            if name in self._entries:
                raise ValueError(f"{self.sort} {name!r} is registered already")
            self.names.add(name, getattr(entry, "__module__", None))
            self._entries[name] = entry
            return entry

        return file

    def __contains__(self, name: str) -> bool:
        return name in self.names

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def get(self, name: str) -> Callable[..., T]:
        """The class registered under a name, or UnknownName with the nearest one."""
        if name not in self._entries:
            self.names.check(name)
            self.names.load(name)
        return self._entries[name]

    def summary(self, name: str) -> str:
        """The first line of the entry's docstring."""
        return (inspect.getdoc(self.get(name)) or "").splitlines()[0]

    def parameters(self, name: str) -> list[Parameter]:
        """The parameters of an entry with default and meaning, in the order of its signature."""
        entry = self.get(name)
        docs: Mapping[str, str] = getattr(entry, "PARAMETERS", {})
        return [
            Parameter(p.name, p.default, docs.get(p.name, ""))
            for p in inspect.signature(entry).parameters.values()
            if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)
        ]

    def shared(self, names: Iterable[str], params: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        """Parameters given for several entries, by entry: ``KEY`` for all that have it, and
        ``NAME.KEY`` for one of them, which goes before.

        Raises UnknownName for a key that none of them has.
        """
        known = {name: {p.name for p in self.parameters(name)} for name in names}
        check_shared(params, known, f"{self.sort} {' '.join(known)}")
        return {
            name: {key: value for key, value in params.items() if key in keys}
            | {
                key.removeprefix(f"{name}."): value
                for key, value in params.items()
                if key.startswith(f"{name}.")
            }
            for name, keys in known.items()
        }

    def make(self, name: str, params: Mapping[str, Any]) -> T:
        """Build an entry; unknown parameters and values that it refuses are InputErrors."""
        entry = self.get(name)
        known = [p.name for p in self.parameters(name)]
        signature = inspect.signature(entry).parameters.values()
        free = any(p.kind is p.VAR_KEYWORD for p in signature)
        if not free:
            check_parameters(params, known, f"{self.sort} {name}")
        try:
            return entry(**params)
        except (TypeError, ValueError) as error:
            raise InputError(f"{self.sort} {name}: {error}") from error
