"""An order of a transfer: which tests, and where; checked before anything heavy is imported."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from cavsumo.egos.names import check_ego
from cavsumo.errors import InputError, UnknownName
from cavsumo.kept.names import CAVTEST
from cavsumo.model.named_networks import check_network
from cavsumo.model.scenario import Params

ZONE, PHASE = "zone", "phase"  # forms of a test
FORMS = (ZONE, PHASE)
MOST_PLACES, MOST_SEEDS = 1000, 100_000


@dataclass(frozen=True)
class TransferOrder:
    """An order of a transfer: which tests, and where.

    Attributes:
        tests: kept tests, or rows of results as ``FILE.csv:RUN``.
        nets: names or files of networks.
        ego, ego_params: in place of the egos of the tests; None for their own.
        places: of a test on a network, at most.
        seeds: episodes at each place, in each form.
        seed: of the batches.
        forms: of each test: in its zone, in its phase.
        trust: use egos and assertions that only the files name.
    """

    tests: Sequence[str]
    nets: Sequence[str]
    ego: str | None = None
    ego_params: Params = field(default_factory=dict)
    places: int = 5
    seeds: int = 3
    seed: int = 1
    forms: Sequence[str] = FORMS
    trust: bool = False


def check_order(order: TransferOrder) -> None:
    """Refuse wrong numbers, names and files; raises InputError in one sentence."""
    for name, value, most in (
        ("places", order.places, MOST_PLACES),
        ("seeds", order.seeds, MOST_SEEDS),
    ):
        if not 1 <= value <= most:
            raise InputError(f"transfer: --{name}: expected 1 to {most}, got {value}")
    if order.seed < 0:
        raise InputError(f"transfer: --seed: expected at least 0, got {order.seed}")
    for form in order.forms:
        if form not in FORMS:
            raise UnknownName("form", form, FORMS, "transfer")
    if order.ego is not None:
        check_ego(order.ego, order.ego_params)
    elif order.ego_params:
        raise InputError("transfer: --ego-param: needs --ego")
    for net in order.nets:
        check_network(Path(net), "transfer: --net")
    for name in order.tests:
        file, _ = named_test(name)
        if not file.is_file():
            raise InputError(f"transfer: no such file: {str(file)!r}")


def named_test(name: str) -> tuple[Path, int | None]:
    """The file of a test, and the number of its row; None for a kept test."""
    if name.endswith(CAVTEST):
        return Path(name), None
    file, colon, run = name.rpartition(":")
    if not colon or not run.isdecimal() or not file.endswith(".csv"):
        raise InputError(
            f"transfer: {name!r}: expected a kept test ({CAVTEST}), or a row as FILE.csv:RUN"
        )
    return Path(file), int(run)
