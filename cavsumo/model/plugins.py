"""Things of the user's, named ``module:attribute``: importing them, and the files they stand in.

Objects of the user's session have names too (``objects``), and are found by the same functions.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cavsumo.errors import InputError, UnknownName
from cavsumo.model.objects import factory_of, is_object, module_file


def imported(spec: str, what: str, noun: str, *, functions: bool = False) -> Callable[..., Any]:
    """Import ``module:attribute``, the working folder included.

    Raises InputError for a module that cannot be imported, UnknownName for an attribute that it
    has not or that cannot be called; ``what`` begins the message, ``noun`` is what the attribute
    should be, and functions are among the names suggested if it may be one.
    """
    if is_object(spec):
        return factory_of(spec, what)
    module_name, _, name = spec.partition(":")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        raise InputError(f"{what}: no module named {error.name!r}") from error
    except Exception as error:
        raise InputError(f"{what}: importing {module_name} raised {said(error)}") from error
    if not callable(getattr(module, name, None)):
        names = [
            n
            for n, value in vars(module).items()
            if isinstance(value, type) or (functions and callable(value))
        ]
        raise UnknownName(f"{noun} in module {module_name}", name, names, what)
    found: Callable[..., Any] = getattr(module, name)
    return found


def source_file(spec: str) -> Path | None:
    """The file of an imported module or of an object's, relative to the working folder if there."""
    if is_object(spec):
        file = module_file(spec)
    else:
        source = getattr(sys.modules[spec.partition(":")[0]], "__file__", None)
        file = None if source is None else Path(source)
    if file is None:
        return None
    here = Path.cwd()
    return file.relative_to(here) if file.is_relative_to(here) else file


def said(error: BaseException) -> str:
    """An exception as one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())
