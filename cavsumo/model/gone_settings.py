"""Settings that are gone, with the sentence for those who still give them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple


class Gone(NamedTuple):
    """A setting that is gone.

    Attributes:
        only: the value that all batches have now; other values cannot be had any more.
        words: what is instead.
    """

    only: str
    words: str


GONE: Mapping[str, Gone] = {
    "reset": Gone(
        "fresh",
        "every episode has a simulation of its own since 0.2, and a large network is started once "
        "for all of them; leave it out",
    )
}


def without_gone(plan: Mapping[str, Any]) -> dict[str, Any]:
    """A recorded plan without settings that are gone, where they had the value of all batches."""
    return {k: v for k, v in plan.items() if not (k in GONE and v == GONE[k].only)}
