"""Options of each command: light to import, so that help and mistakes are answered at once.

Every function ``add_NAME`` of a file here adds a command to the parser; the file needs no other
mention.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any

# Files whose commands lead the help; the others follow by name.
FIRST = ("run", "results", "certify", "check_ego", "networks")


def adders() -> Iterator[Callable[[Any], None]]:
    """The functions that add the commands, in the order of the help."""
    names = {module.name for module in pkgutil.iter_modules(__path__)}
    for name in (*FIRST, *sorted(names - {*FIRST})):
        module = import_module(f"{__name__}.{name}")
        yield from (value for key, value in vars(module).items() if key.startswith("add_"))
