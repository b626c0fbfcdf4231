"""Objects of a session: their names, their copies, and how long they are known."""

from __future__ import annotations

import gc
from typing import Any

import pytest
from own_objects import DEFINED

from cavsumo.errors import InputError
from cavsumo.model.objects import (
    Copies,
    factory_of,
    is_here,
    is_instance,
    objects_among,
    sent,
    take,
)


def careful(limit: int = 3, before: str = "") -> Any:
    """A class of a notebook's, whose functions use what stands around them."""
    found: dict[str, Any] = {"__name__": "__main__"}
    exec(compile(before + DEFINED.format(limit=limit), f"cell {limit}", "exec"), found)
    return found["Careful"]


def test_a_name_tells_code_and_state_apart() -> None:
    """Where the code stands does not matter; what it does and what it needs does."""
    one = sent(careful()())
    assert one.name.startswith("object:Careful@")
    assert one.label == "Careful"
    assert sent(careful(before="\n\n")()).name == one.name
    others = [sent(careful()(4.0)), sent(careful(limit=4)()), sent(careful())]
    assert len({one.name, *(other.name for other in others)}) == 4


def test_a_copy_is_as_the_object_was() -> None:
    """Neither the object nor another copy changes it."""
    given = careful()()
    one = sent(given)
    given.speed = 7.0
    copies = factory_of(one.name, "ego")
    assert isinstance(copies, Copies)
    assert is_instance(one.name)
    first = copies()
    first.speed = 9.0
    assert copies().speed == 3.0
    built = sent(careful())
    assert factory_of(built.name, "ego")(5.0).speed == 5.0
    assert not is_instance(built.name)


def test_an_object_is_known_while_it_is_kept() -> None:
    """Then its name is one of another session's, unless a process sends it."""
    one = sent(careful(limit=11)())
    name, data = one.name, one
    assert objects_among(["timing", name, name]) == (one,)
    del one, data
    gc.collect()
    assert not is_here(name)
    with pytest.raises(InputError, match=f"^ego {name}: an object of the Python session"):
        factory_of(name, f"ego {name}")
    again = sent(careful(limit=11)())
    take([again])
    assert is_here(name)


def test_what_cannot_be_sent_is_refused() -> None:
    """In one sentence that says why."""
    with pytest.raises(InputError, match=r"^object generator: cannot be sent to a process: "):
        sent(x for x in ())
