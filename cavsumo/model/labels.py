"""Labels of the agents of a batch: ``NAME``, or ``LABEL=NAME`` for a second agent of that name."""

from __future__ import annotations

import re
from collections.abc import Sequence

LABEL = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")


def labelled(word: str) -> tuple[str, str]:
    """The label and the name in the specification of an agent; the label defaults to the name.

    A name may contain a "=" after a colon, as part of a path or command.
    """
    label, equals, name = word.partition("=")
    return (label, name) if equals and ":" not in label else (word, word)


def cast_of(words: Sequence[str]) -> dict[str, str]:
    """The names of agents by their labels, in order; ValueError for invalid labels."""
    cast: dict[str, str] = {}
    for word in words:
        label, name = labelled(word)
        if label != word and not (name and LABEL.fullmatch(label)):
            raise ValueError(
                f"{word!r} must be NAME or LABEL=NAME, a label of letters, digits, '-' and '_'"
            )
        if label in cast:
            raise ValueError(f"{label!r} is named twice; LABEL=NAME tells them apart")
        cast[label] = name
    return cast
