"""Kept tests on other networks: where they fit, and how often they fail the ego again there.

A test is played wherever its relative form (``transfer_form``) fits, on empty roads, with several
seeds. Every network gives one batch or more: an agent ``tT-pP-FORM`` for test T at place P in
one of its forms, which knows its start and its programme, as the agent of a search does. So rows,
replays and continuations are those of any batch.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cavsumo.agents.names import SEARCH
from cavsumo.agents.programme import WalkProgramme
from cavsumo.agents.searched import Programme
from cavsumo.batch.located import located
from cavsumo.batch.prepared import prepare
from cavsumo.batch.replay import Record, recorded
from cavsumo.batch.trust import check_trust
from cavsumo.errors import InputError, NetworkError
from cavsumo.kept.cavtest import read_cavtest
from cavsumo.kept.transfer_form import RelativeTest, relative_test
from cavsumo.kept.transfer_order import TransferOrder, check_order, named_test
from cavsumo.model.scenario import plan_from
from cavsumo.model.study import Part
from cavsumo.network.recorded_starts import start_record
from cavsumo.searchers.places import Place
from cavsumo.searchers.space import Space
from cavsumo.searchers.walks import Walks

Fit = tuple[Place, dict[str, Programme]]  # a place, and the programmes there by form
APART_M = 5.0  # between two places of a test, along the ego's path
LEADS_S = 0.75  # by which a vehicle may arrive earlier or later than in the record
# Settings of a test that other networks keep.
KEPT = (
    "ego", "ego_params", "ego_sensor", "tester_sensor", "end", "step_length", "assertions",
    "assertion_params", "formulas", "kind", "start_speed", "jaywalk", "embodiment", "sumo_width",
)  # fmt: skip


@dataclass(frozen=True)
class TransferParts:
    """The batches of a transfer.

    Attributes:
        tests: their names.
        nets: names of the networks.
        parts: the batches, one or more for each network where a test fits.
        placed: how many places each test has on each network, by (test, net).
    """

    tests: tuple[str, ...]
    nets: tuple[str, ...]
    parts: tuple[Part, ...]
    placed: dict[tuple[int, int], int]


def transfer_parts(order: TransferOrder) -> TransferParts:
    """The batches of a transfer; raises InputError before anything is played."""
    check_order(order)
    names = [Path(net).name.split(".")[0] for net in order.nets]
    if len({*names}) < len(names):
        raise InputError(f"transfer: two networks are called {max(names, key=names.count)!r}")
    tests = [relative_test(name, _record(name, order)) for name in order.tests]
    parts, placed = [], dict[tuple[int, int], int]()
    for n, net in enumerate(order.nets):
        for g, group in enumerate(_groups(tests, order)):
            part, counts = _part(net, f"{names[n]}-{g + 1}" if g else names[n], group, order)
            placed |= {(t, n): count for t, count in counts.items()}
            parts += [part] if part is not None else []
    if not parts:
        raise InputError("transfer: no test fits anywhere on these networks")
    return TransferParts(tuple(order.tests), tuple(names), tuple(parts), placed)


@dataclass(frozen=True)
class _Group:
    """Tests with the same settings, by their numbers."""

    settings: dict[str, Any]
    tests: dict[int, RelativeTest]


def _record(name: str, order: TransferOrder) -> Record:
    """The episode that a name means."""
    allowed = None if order.trust else (order.ego,) if order.ego else ()
    file, run = named_test(name)
    if run is None:
        return read_cavtest(file, allowed).record
    record = located(recorded(file, run, allowed))
    check_trust(record.plan.scenario, record.file, allowed)
    return record


def _groups(tests: Sequence[RelativeTest], order: TransferOrder) -> Iterator[_Group]:
    """The tests by their settings, in the order of the first of each."""
    found: list[_Group] = []
    for number, test in enumerate(tests):
        settings = _settings(test, order)
        group = next((one for one in found if one.settings == settings), None)
        if group is None:
            group = _Group(settings, {})
            found.append(group)
        group.tests[number] = test
    yield from found


def _settings(test: RelativeTest, order: TransferOrder) -> dict[str, Any]:
    """The settings with which a test is played elsewhere."""
    plan = test.record.plan
    whole = plan.scenario.model_dump(mode="json", exclude_none=True)
    found = {key: whole[key] for key in KEPT if key in whole}
    if order.ego is not None:
        found |= {"ego": order.ego, "ego_params": dict(order.ego_params)}
    shared = {"routes": "none", "testers": 1, "bodies_per_agent": 1, "agents": [SEARCH]}
    rest = {"reference": plan.reference, "runs": order.seeds, "seed": order.seed}
    return {**found, **shared, **rest}


def _part(
    net: str, name: str, group: _Group, order: TransferOrder
) -> tuple[Part | None, dict[int, int]]:
    """The batch of some tests on a network, None where none fits, and how many places each has."""
    settings = {**group.settings, "net": net}
    try:
        space = prepare(plan_from(settings, "transfer")).space
    except NetworkError:
        return None, dict.fromkeys(group.tests, 0)
    known: dict[str, Any] = {}
    counts = {}
    for number, test in group.tests.items():
        places = fitting(test, space, order.places)
        counts[number] = len(places)
        for k, (place, forms) in enumerate(places):
            for form, programme in forms.items():
                if form in order.forms or len(forms) == 1:
                    known[label(number, k, form)] = [_memory(space, place, programme)]
    if not known:
        return None, counts
    agents = [f"{one}={SEARCH}" for one in known]
    return Part(name, {**settings, "agents": agents, "known": known}), counts


def label(test: int, place: int, form: str) -> str:
    """The agent that plays a test at a place, both counted from 0, in a form."""
    return f"t{test + 1}-p{place + 1}-{form}"


def number_of(agent: str) -> int:
    """The number of the test that an agent plays."""
    return int(agent.split("-")[0].removeprefix("t")) - 1


def place_of(agent: str) -> str:
    """The test and the place of an agent, in any form."""
    return agent.rpartition("-")[0]


def fitting(test: RelativeTest, space: Space, most: int) -> list[Fit]:
    """The places where a test fits, spread evenly over the ego's path, with its programmes there.

    From the same side; for pedestrians where the ego is still to come as they must set off, for
    vehicles on approaches on which they arrive about as much earlier than the ego.
    """
    fits: list[Fit] = []
    for place in _in_time(test, space):
        if place.whence == test.whence and _apart(place, fits):
            fits.append((place, test.at(place)))
    if len(fits) <= most:
        return fits
    return [fits[round(i * (len(fits) - 1) / max(1, most - 1))] for i in range(most)]


def _in_time(test: RelativeTest, space: Space) -> tuple[Place, ...]:
    """The places from which the body can meet the ego as it did."""
    if isinstance(space.movements, Walks):
        assert isinstance(test.programme, WalkProgramme)
        return space.movements.in_time(test.programme)
    return tuple(p for p in space.movements.places if abs(p.lead - test.lead) <= LEADS_S)


def _apart(place: Place, others: Sequence[Fit]) -> bool:
    """Whether no other place is near."""
    x, y = place.start.x, place.start.y
    return all(
        abs(place.along - other.along) >= APART_M
        and math.dist((x, y), (other.start.x, other.start.y)) > 1.0
        for other, _ in others
    )


def _memory(space: Space, place: Place, programme: Programme) -> dict[str, Any]:
    """The knowledge of the agent that plays a programme at a place."""
    start = list(start_record(space.site, place.start))
    return {"starts": [start], "programmes": [programme._asdict()]}
