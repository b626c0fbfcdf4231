"""Parameters of agents, egos and assertions: flat tables, ``KEY`` or ``NAME.KEY``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Params = dict[str, bool | int | float | str]


def qualified(params: Any) -> Any:
    """Parameters with those of inner tables under their full names, ``TABLE.KEY``."""
    if not isinstance(params, Mapping):
        return params
    flat: dict[str, Any] = {}
    for key, value in params.items():
        inner = isinstance(value, Mapping)
        flat |= {f"{key}.{k}": v for k, v in value.items()} if inner else {key: value}
    return flat
