"""The cases of a suite as scenarios: every number computed, every variation drawn."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from cavsumo.errors import InputError, UnknownName
from cavsumo.model.documents import first_problem
from cavsumo.model.named_networks import network_file
from cavsumo.model.scenario import BatchPlan, Scenario
from cavsumo.model.scenario.script import ScriptedTest
from cavsumo.model.scenario.suite import SuiteChoice
from cavsumo.suites.cells import SuiteCell, selected_cells
from cavsumo.suites.expressions import Value, evaluated
from cavsumo.suites.files import FOLDER, read_suite, suite_file
from cavsumo.suites.records import Suite

CHECKED = 2000  # cases of a batch that are made before the first is played
MOST = 100  # testers of a table
WORDS = frozenset({"kind", "body"})  # keys whose values are words, not expressions

Names = dict[str, Value]


@dataclass(frozen=True)
class SuiteCases:
    """The cases of a batch.

    Attributes:
        suite, choice: what is played.
        folder: that of the suite's file, to which the networks that it names are relative.
        seed: from which variations are drawn.
    """

    suite: Suite
    choice: SuiteChoice
    folder: Path
    seed: int

    @cached_property
    def cells(self) -> list[SuiteCell]:
        """The selected cells."""
        return selected_cells(self.suite, self.choice)

    def __len__(self) -> int:
        return len(self.cells) * (1 + self.choice.vary)

    def scenario(self, run: int, base: Scenario) -> Scenario:
        """The scenario of a run: first all cases as they are, then the first variation of all ...

        ``base``: the settings that all cases share.
        """
        layer, which = divmod(run, len(self.cells))
        cell, suite = self.cells[which], self.suite
        place = f"suite {self.choice.name}: {cell.name}"
        try:
            names = self._names(cell, layer)
            script = _script(suite, cell, names, layer)
            end = _number(cell.test.end, names)
        except UnknownName:
            raise
        except ValidationError as error:
            raise InputError(f"{place}: {first_problem(error)}") from error
        except ValueError as error:
            raise InputError(f"{place}: {error}") from error
        shared = {key: getattr(base, key) for key in Scenario.model_fields if key != "script"}
        route = [names.get(edge, edge) for edge in cell.test.ego_route]
        case = {"net": self.net(cell.test.net), "ego_route": route, "end": end}
        return Scenario(**{**shared, **case, "script": script}).placed(base.places)

    def runs_by_net(self) -> dict[str, list[int]]:
        """The runs on each network."""
        found: dict[str, list[int]] = {}
        for run in range(len(self)):
            net = str(self.net(self.cells[run % len(self.cells)].test.net))
            found.setdefault(net, []).append(run)
        return found

    def net(self, name: str) -> Path:
        """A network that the suite names: one of cavsumo's, or a file beside the suite's."""
        beside = self.folder / name
        return beside if beside.is_file() else Path(name)

    def nets(self) -> list[str]:
        """The networks of the selected cases."""
        return list(dict.fromkeys(str(self.net(cell.test.net)) for cell in self.cells))

    def _names(self, cell: SuiteCell, layer: int) -> Names:
        """The names that the expressions of a case may use, variations drawn."""
        suite, test = self.suite, cell.test
        names: Names = {"pi": math.pi}
        for name, box in suite.bodies.items():
            front = box.length_m / 2 if box.front_m is None else box.front_m
            sizes = {"length": box.length_m, "width": box.width_m, "front": front}
            names |= {f"{name}_{key}": value for key, value in sizes.items()}
        given_values = dict(self.choice.values)
        names |= {name: value for name, value in given_values.items() if name in names}
        varied = _variation(cell, layer, self.seed)
        computed = ((name, value, True) for name, value in suite.values.items())
        given = ((name, value, False) for name, value in cell.parameters.items())
        derived = ((name, value, True) for name, value in test.values.items())
        for name, value, is_expression in (*computed, *given, *derived):
            found = _number(value, names) if is_expression else value
            found = given_values.get(name, found) if is_expression else found
            names[name] = varied(name, found)
        return names


def _variation(cell: SuiteCell, layer: int, seed: int) -> Callable[[str, Value], Value]:
    """The function that varies a named value in one layer; the first layer varies nothing."""
    by, times = cell.test.vary_by, cell.test.vary_times
    if layer == 0:
        return lambda name, value: value
    import numpy as np  # a filter that leaves nothing is refused without it

    words = seed, zlib.crc32(cell.name.encode()), layer
    rng = np.random.default_rng(np.random.SeedSequence(words))
    added = {name: float(rng.uniform(*limits)) for name, limits in by.items()}
    factors = {name: float(rng.uniform(*limits)) for name, limits in times.items()}

    def varied(name: str, value: Value) -> Value:
        if name not in added and name not in factors:
            return value
        return float(value) * factors.get(name, 1.0) + added.get(name, 0.0)

    return varied


def _script(suite: Suite, cell: SuiteCell, names: Names, layer: int) -> ScriptedTest:
    """The script of a case."""
    ego = _evaluated({**suite.ego, **cell.test.ego}, names)
    testers = [
        _evaluated(_boxed(suite, table, names), {**names, "index": index})
        for table in cell.test.testers
        for index in range(_count(table, names))
    ]
    test = cell.test
    shown = (*cell.parameters, *test.shown, *test.vary_by, *test.vary_times)
    parameters = {"test": cell.test.name, **{key: names[key] for key in shown}, "variation": layer}
    content = {"name": cell.name, "parameters": parameters, "ego": ego, "testers": testers}
    return ScriptedTest.model_validate(content)


def _count(table: Mapping[str, Any], names: Names) -> int:
    """How many testers a table is."""
    count = _number(table.get("count", 1), names)
    if not isinstance(count, int | float) or not 1 <= count <= MOST or count != int(count):
        raise ValueError(f"count: {count} is no whole number from 1 to {MOST}")
    return int(count)


def _boxed(suite: Suite, table: Mapping[str, Any], names: Names) -> dict[str, Any]:
    """A tester with the box that it names."""
    table = {key: value for key, value in table.items() if key != "count"}
    name = table.pop("body", None)
    if name is None:
        return table
    if name not in suite.bodies:
        raise UnknownName("body", str(name), suite.bodies, "testers")
    sizes = {f"{key}_m": names[f"{name}_{key}"] for key in ("length", "width")}
    return {"kind": suite.bodies[name].kind, **sizes, **table}


def _evaluated(value: Any, names: Names, key: str = "") -> Any:
    """A table with its expressions computed."""
    if isinstance(value, Mapping):
        return {k: _evaluated(v, names, k) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_evaluated(v, names, key) for v in value]
    return evaluated(value, names) if isinstance(value, str) and key not in WORDS else value


def _number(value: Value, names: Names) -> Value:
    """A number or the value of an expression."""
    return evaluated(value, names) if isinstance(value, str) else value


# Cases of plans


def cases_of(plan: BatchPlan) -> SuiteCases:
    """The cases of a batch that plays a suite."""
    assert plan.suite is not None
    file = suite_file(plan.suite.name, plan.scenario.places)
    facts = file.stat()
    return _cases(plan.suite, file, (facts.st_mtime_ns, facts.st_size), plan.seed)


@lru_cache(maxsize=8)
def _cases(choice: SuiteChoice, file: Path, _facts: tuple[int, int], seed: int) -> SuiteCases:
    """The cases of a choice, kept so that each run need not select them again."""
    return SuiteCases(read_suite(file), choice, file.parent, seed)


def case_plan(plan: BatchPlan, run: int) -> BatchPlan:
    """The plan of one run by itself: that of its case, without a suite."""
    if plan.suite is None:
        return plan
    scenario = cases_of(plan).scenario(run, plan.scenario)
    return plan.model_copy(update={"scenario": scenario, "suite": None})


def suite_inputs(plan: BatchPlan) -> dict[str, Path]:
    """The files of a suite: its own and its networks, by the names that plans have for them."""
    assert plan.suite is not None
    cases, places = cases_of(plan), plan.scenario.places
    nets = {name: places.get(name) or network_file(Path(name)) for name in cases.nets()}
    own = suite_file(plan.suite.name, places)
    return nets if own.parent == FOLDER else {plan.suite.name: own, **nets}


def case_plans(plan: BatchPlan) -> Iterator[BatchPlan]:
    """The plans of the runs, one after another; of thousands some of each test.

    All cells of a test are made by the same expressions.
    """
    cases = cases_of(plan)
    apart = 1 + len(cases) // CHECKED
    first = {cell.test.name: i for i, cell in reversed(list(enumerate(cases.cells)))}
    for run in sorted({*first.values(), *range(0, len(cases), apart)}):
        yield case_plan(plan, run)
