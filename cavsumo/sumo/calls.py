"""SUMO's functions for inner loops.

A function of libsumo in Python calls one of the extension module with the same arguments, which
costs as much as SUMO's answer. Here is that one, or the function itself where a build of libsumo
has no such.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

try:
    from libsumo import _libsumo as _extension
except ImportError:
    _extension = None


def direct(domain: Any, name: str) -> Callable[..., Any]:
    """A function of one of SUMO's domains, such as ``direct(libsumo.vehicle, "getSpeed")``."""
    there = getattr(_extension, f"{getattr(domain, '__name__', '')}_{name}", None)
    found: Callable[..., Any] = there or getattr(domain, name)
    return found
