"""A table of names: what it refuses, what it suggests, and that the shipped ones are documented."""

from __future__ import annotations

import importlib
import inspect
import re
from pathlib import Path
from typing import Any, ClassVar

import pytest

from cavsumo.agents import AGENTS
from cavsumo.assertions import ASSERTIONS
from cavsumo.egos import EGOS
from cavsumo.egos.reference import REFERENCES
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.checks import number
from cavsumo.model.names import Names
from cavsumo.model.registry import Registry

SHIPPED = [(r, name) for r in (AGENTS, EGOS, ASSERTIONS) for name in r]
REGISTRIES: dict[str, Registry[Any]] = {
    "AGENTS": AGENTS,
    "EGOS": EGOS,
    "ASSERTIONS": ASSERTIONS,
    "REFERENCES": REFERENCES,
}
NAMES = [f"{r.sort}-{name}" for r, name in SHIPPED]


class Kettle:
    """Boils water."""

    PARAMETERS: ClassVar[dict[str, str]] = {"litres": "how much it holds [l]"}

    def __init__(self, litres: float = 1.5) -> None:
        self.litres = number("litres", litres, 0.1, 3.0)


@pytest.fixture
def kitchen() -> Registry[Any]:
    """A registry with one entry."""
    registry: Registry[Any] = Registry("appliance")
    registry.register("kettle")(Kettle)
    return registry


def test_a_name_is_given_once(kitchen: Registry[Any]) -> None:
    """A second kettle is refused and the first stays."""
    with pytest.raises(ValueError, match="appliance 'kettle' is registered already"):
        kitchen.register("kettle")(object)
    assert kitchen.get("kettle") is Kettle


def test_an_unknown_name_suggests_the_nearest(kitchen: Registry[Any]) -> None:
    """Whoever asks for a ketle is told of the kettle."""
    with pytest.raises(UnknownName, match="unknown appliance 'ketle'; did you mean 'kettle'"):
        kitchen.make("ketle", {})


def test_a_name_like_no_other_lists_them_all(kitchen: Registry[Any]) -> None:
    """With nothing near, the few there are are named."""
    with pytest.raises(UnknownName, match="valid: kettle"):
        kitchen.get("zzz")


def test_an_unknown_parameter_suggests_the_nearest(kitchen: Registry[Any]) -> None:
    """A misspelt parameter is never ignored."""
    with pytest.raises(UnknownName, match=r"appliance kettle: .*'liters'; did you mean 'litres'"):
        kitchen.make("kettle", {"liters": 1.0})


@pytest.mark.parametrize("value", [5.0, float("nan"), "much", True])
def test_a_wrong_value_is_an_input_error(kitchen: Registry[Any], value: object) -> None:
    """A value that the entry refuses is the user's mistake, named with entry and parameter."""
    with pytest.raises(InputError, match="appliance kettle: litres must"):
        kitchen.make("kettle", {"litres": value})


def test_what_is_made_has_the_parameters_given(kitchen: Registry[Any]) -> None:
    """Parameters reach the entry; those not given keep their defaults."""
    assert kitchen.make("kettle", {"litres": 2}).litres == 2.0
    assert kitchen.make("kettle", {}).litres == 1.5


def test_the_listing_shows_default_and_meaning(kitchen: Registry[Any]) -> None:
    """One line of summary, and each parameter with its default and its unit."""
    assert kitchen.summary("kettle") == "Boils water."
    (litres,) = kitchen.parameters("kettle")
    assert (litres.name, litres.default, litres.doc) == ("litres", 1.5, "how much it holds [l]")


def test_a_declared_name_belongs_to_its_module() -> None:
    """Nobody takes a name before its module is imported, which happens when it is built."""
    registry: Registry[Any] = Registry(Names("appliance", "json", {"kettle": "decoder"}))
    assert list(registry) == ["kettle"]
    with pytest.raises(ValueError, match="appliance 'kettle' is registered already"):
        registry.register("kettle")(Kettle)
    registry.register("toaster")(Kettle)
    assert list(registry) == ["kettle", "toaster"]


@pytest.mark.parametrize("constant", REGISTRIES)
def test_the_declared_names_are_those_that_the_modules_register(constant: str) -> None:
    """Every file of the package that registers something stands in the table, with that name."""
    registry = REGISTRIES[constant]
    modules = registry.names.modules
    package = next(iter(modules.values())).rpartition(".")[0]
    folder = Path(importlib.import_module(package).__file__ or "").parent
    registered = re.compile(rf"^@{constant}\.register\(", re.MULTILINE)
    files = [file for file in folder.glob("*.py") if registered.search(file.read_text("utf-8"))]
    count = sum(len(registered.findall(file.read_text("utf-8"))) for file in files)
    assert {name.rpartition(".")[2] for name in modules.values()} == {file.stem for file in files}
    assert count == len(modules)
    for name, module in modules.items():
        assert registry.get(name).__module__ == module


@pytest.mark.parametrize(("registry", "name"), SHIPPED, ids=NAMES)
def test_the_declared_parameters_are_those_of_the_signature(
    registry: Registry[Any], name: str
) -> None:
    """So that a misspelt one is refused before its module is imported."""
    assert registry.names.parameters(name) == tuple(
        p.name for p in registry.parameters(name) if (name, p.name) != ("sumo", "attributes")
    )


@pytest.mark.parametrize(("registry", "name"), SHIPPED, ids=NAMES)
def test_everything_shipped_has_a_summary(registry: Registry[Any], name: str) -> None:
    """Every agent, ego and assertion says in one sentence what it does, in its own words."""
    entry = registry.get(name)
    assert entry.__doc__, "no docstring of its own"
    summary = registry.summary(name)
    assert len(summary) > 20
    assert summary.rstrip().endswith((".", ")"))


@pytest.mark.parametrize(("registry", "name"), SHIPPED, ids=NAMES)
def test_every_parameter_shipped_is_documented(registry: Registry[Any], name: str) -> None:
    """Every parameter has a line of meaning, and no line speaks of one that is not there."""
    entry: Any = registry.get(name)
    assert sorted(inspect.signature(entry).parameters) == sorted(entry.PARAMETERS)
    assert all(len(line) > 10 for line in entry.PARAMETERS.values())


@pytest.mark.parametrize(("registry", "name"), SHIPPED, ids=NAMES)
def test_everything_shipped_works_with_its_defaults(registry: Registry[Any], name: str) -> None:
    """Nothing needs a parameter to be built, and the same name builds the same thing."""
    made = registry.make(name, {})
    assert type(made) is type(registry.make(name, {}))


@pytest.mark.parametrize(("registry", "name"), SHIPPED, ids=NAMES)
def test_nothing_shipped_takes_a_number_that_is_none(registry: Registry[Any], name: str) -> None:
    """NaN and infinity are refused wherever a number is expected."""
    for parameter in registry.parameters(name):
        if isinstance(parameter.default, float):
            for bad in (float("nan"), float("inf")):
                with pytest.raises(InputError, match=parameter.name):
                    registry.make(name, {parameter.name: bad})
