"""Strangers' files: what playing them would run, import or connect to, and who allowed that.

A plan names its ego and its assertions. Built-in names are ours; any other is code or an address
that came with the file, and is used only when the user repeated it or trusts the file.
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from cavsumo.errors import InputError
from cavsumo.model.objects import is_object
from cavsumo.model.scenario import Scenario

SHOWN = 120  # characters of a name in a message


def check_trust(
    scenario: Scenario, file: Path, allowed: Collection[str] | None, *, ego: bool = True
) -> None:
    """Raise InputError when playing a scenario would use what only its file names.

    Args:
        file: where the scenario was found.
        allowed: egos and assertions that the user named as well; None when the file is trusted.
        ego: whether its ego would drive.
    """
    if allowed is None:
        return
    names = [*([scenario.ego] if ego else []), *scenario.assertions]
    found = list(
        dict.fromkeys(_use(name) for name in names if name not in allowed and _is_foreign(name))
    )
    if found:
        uses = " and ".join(found)
        raise InputError(
            f"{str(file)!r} names what is not cavsumo's: to play it would {uses}; --trust allows it"
        )


def _is_foreign(name: str) -> bool:
    """Whether using a name runs, imports or connects; an object is this session's or unknown."""
    return ":" in name and not is_object(name)


def _use(spec: str) -> str:
    """What using an ego or assertion from outside means."""
    sort, _, rest = spec.partition(":")
    verb = {"exec": "run", "tcp": "connect to"}.get(sort, "import")
    name = rest if sort in ("exec", "tcp") else spec
    return f"{verb} {name if len(name) <= SHOWN else name[:SHOWN] + '...'!r}"
