"""Trust in files of others: code and addresses that playing them would use, and the permission.

A plan names its ego and its assertions. A name that is not built in is code or an address from the
file, and is used only if the user repeated it or trusts the file.
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from cavsumo.egos.names import is_built_in
from cavsumo.errors import InputError
from cavsumo.model.objects import is_object
from cavsumo.model.scenario import Scenario

SHOWN = 120  # characters of a name in a message


def check_trust(
    scenario: Scenario, file: Path, allowed: Collection[str] | None, *, ego: bool = True
) -> None:
    """Raise InputError when playing a scenario would use code or an address that only its file
    names.

    Args:
        file: the file of the scenario.
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
    return ":" in name and not is_object(name) and not is_built_in(name)


def _use(spec: str) -> str:
    """The effect of using an external ego or assertion."""
    sort, _, rest = spec.partition(":")
    verb = {"exec": "run", "tcp": "connect to"}.get(sort, "import")
    name = rest if sort in ("exec", "tcp") else spec
    return f"{verb} {name if len(name) <= SHOWN else name[:SHOWN] + '...'!r}"
