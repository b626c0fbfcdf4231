"""Objects of a Python session as agents, egos and assertions: named, kept as bytes, copied.

An object has the name ``object:NAME@DIGEST``: of its class or function, and of its code and state.
Its bytes are kept while a batch or its results need it, and travel in the pipe between a process
and the workers that it started. No file holds or brings any: a name that a file tells is known in
the session that played it, and nowhere else.
"""

from __future__ import annotations

import hashlib
import inspect
import io
import pickle
import re
import sys
import weakref
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from types import CodeType
from typing import Any

from cavsumo.errors import InputError

PREFIX = "object:"
DIGITS = 12  # hexadecimal ones, of the digest in a name


@dataclass(frozen=True)
class SentObject:
    """An object as it was given.

    Attributes:
        name: ``object:NAME@DIGEST``.
        data: the object as bytes (pickle).
        builds: whether it is a class or a function, to be called for what is meant.
    """

    name: str
    data: bytes
    builds: bool

    @property
    def label(self) -> str:
        """The name of its class or function."""
        return self.name.removeprefix(PREFIX).partition("@")[0]


@dataclass(frozen=True)
class Copies:
    """The factory of an object that is no factory itself: each call gives a fresh copy."""

    sent: SentObject

    def __call__(self) -> Any:
        return pickle.loads(self.sent.data)


# The objects that somebody in this process keeps, by their names.
_KNOWN: weakref.WeakValueDictionary[str, SentObject] = weakref.WeakValueDictionary()


def is_object(name: str) -> bool:
    """Whether a name is that of an object."""
    return name.startswith(PREFIX)


def is_here(name: str) -> bool:
    """Whether the object of a name is known in this process."""
    return name in _KNOWN


def sent(thing: Any) -> SentObject:
    """An object with its name, by which it is known while somebody keeps what is returned.

    Raises InputError for an object that cannot be sent to a process.
    """
    import cloudpickle

    label = re.sub(r"[^A-Za-z0-9_-]", "", _owner(thing).__name__)
    try:
        name = f"{PREFIX}{label}@{_digest(thing)}"
        found = SentObject(name, cloudpickle.dumps(thing), builds=_owner(thing) is not type(thing))
    except Exception as error:  # anything that an object's own methods raise
        said = " ".join(f"{type(error).__name__}: {error}".split())
        raise InputError(f"object {label}: cannot be sent to a process: {said}") from error
    return _KNOWN.setdefault(name, found)


def objects_among(names: Iterable[str]) -> tuple[SentObject, ...]:
    """The objects among some names; raises InputError for one that is not here."""
    return tuple(_known(name, name) for name in dict.fromkeys(names) if is_object(name))


def take(objects: Iterable[SentObject]) -> None:
    """Know the objects that the parent process sent, while somebody keeps them."""
    for one in objects:
        _KNOWN[one.name] = one


def factory_of(name: str, what: str) -> Callable[..., Any]:
    """The class or function of a name, else the copies of that object.

    Raises InputError, which begins with ``what``, when the object is not here.
    """
    found = _known(name, what)
    made: Callable[..., Any] = pickle.loads(found.data) if found.builds else Copies(found)
    return made


def is_instance(name: str) -> bool:
    """Whether a name is that of an object of which every episode has a fresh copy."""
    return is_object(name) and not _known(name, name).builds


def module_file(name: str) -> Path | None:
    """The file from which a worker imports the object's class or function, None for none."""
    thing = pickle.loads(_known(name, name).data)
    module = getattr(_owner(thing), "__module__", "")
    if module == "__main__" or module.partition(".")[0] == __name__.partition(".")[0]:
        return None
    source = getattr(sys.modules.get(module), "__file__", None)
    return None if source is None else Path(source)


def _known(name: str, what: str) -> SentObject:
    """The object of a name."""
    found = _KNOWN.get(name)
    if found is None:
        raise InputError(
            f"{what}: an object of the Python session that played it, which no file holds; replay "
            "it in that session, or show the frames that were recorded"
        )
    return found


def _owner(thing: Any) -> Any:
    """The class or function that an object is, else its class."""
    plain = thing.func if isinstance(thing, partial) else thing
    return plain if isinstance(plain, type) or inspect.isroutine(plain) else type(thing)


def _digest(thing: Any) -> str:
    """The digest of an object's code and state, the same in every session.

    Where code stands, in which file and line, is no part of it.
    """
    import cloudpickle.cloudpickle

    stream = io.BytesIO()
    _code_pickler()(stream).dump(thing)
    found = stream.getvalue()
    # random words, by which cloudpickle tells the classes of a session apart
    for word in list(
        getattr(cloudpickle.cloudpickle, "_DYNAMIC_CLASS_TRACKER_BY_CLASS", {}).values()
    ):
        found = found.replace(word.encode(), b"")
    return hashlib.sha256(found).hexdigest()[:DIGITS]


@cache
def _code_pickler() -> Any:
    """A pickler of objects whose code is reduced to what it does."""
    import cloudpickle

    class CodePickler(cloudpickle.Pickler):  # type: ignore[misc]
        """Writes bytes that are only compared, never read."""

        def reducer_override(self, obj: Any) -> Any:
            """Code as text, anything else as cloudpickle has it."""
            return (
                (str, (_text(obj),)) if isinstance(obj, CodeType) else super().reducer_override(obj)
            )

    return CodePickler


def _text(value: Any) -> str:
    """A piece of code, or one of its constants, as text that is the same in every session."""
    if isinstance(value, CodeType):
        names = value.co_names, value.co_varnames, value.co_freevars, value.co_cellvars
        counts = value.co_argcount, value.co_posonlyargcount, value.co_kwonlyargcount
        does = value.co_name, value.co_code, value.co_exceptiontable, value.co_flags
        return f"{does} {names} {counts} {_text(value.co_consts)}"
    if isinstance(value, tuple):
        return f"({' '.join(map(_text, value))})"
    if isinstance(value, frozenset):
        return f"{{{' '.join(sorted(map(_text, value)))}}}"
    return repr(value)
