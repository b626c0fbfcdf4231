"""Options of the command transfer, checked before heavy imports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from cavsumo.cli.requests.kept import ENDING
from cavsumo.egos.names import check_ego
from cavsumo.errors import InputError
from cavsumo.model.named_networks import check_network
from cavsumo.model.scenario import Params

MOST_PLACES, MOST_SEEDS = 1000, 100_000


@dataclass(frozen=True)
class TransferOptions:
    """Options of the command besides those of a batch.

    Attributes:
        tests: kept tests, or rows as FILE.csv:RUN.
        net: networks.
        ego, ego_param: in place of the egos of the tests; None for their own.
        places: of a test on a network, at most.
        seeds: episodes at each place.
        seed: of the batches.
        form: of each test, "zone", "phase" or "both".
        trust: use egos and assertions that only the files name.
    """

    tests: Sequence[str]
    net: Sequence[str]
    ego: str | None = None
    ego_param: Params = field(default_factory=dict)
    places: int = 5
    seeds: int = 3
    seed: int = 1
    form: str = "both"
    trust: bool = False


def check_transfer(wanted: TransferOptions) -> None:
    """Refuse wrong numbers, names and files."""
    for option, value, most in (
        ("--places", wanted.places, MOST_PLACES),
        ("--seeds", wanted.seeds, MOST_SEEDS),
    ):
        if not 1 <= value <= most:
            raise InputError(f"transfer: {option}: expected 1 to {most}, got {value}")
    if wanted.seed < 0:
        raise InputError(f"transfer: --seed: expected at least 0, got {wanted.seed}")
    if wanted.ego is not None:
        check_ego(wanted.ego, wanted.ego_param)
    elif wanted.ego_param:
        raise InputError("transfer: --ego-param: needs --ego")
    for net in wanted.net:
        check_network(Path(net), "transfer: --net")
    for name in wanted.tests:
        file, colon, run = name.rpartition(":")
        kept = name.endswith(ENDING)
        if not kept and not (colon and run.isdecimal() and file.endswith(".csv")):
            raise InputError(
                f"transfer: {name!r}: expected a kept test ({ENDING}), or a row as FILE.csv:RUN"
            )
        if not Path(name if kept else file).is_file():
            raise InputError(f"transfer: no such file: {name if kept else file!r}")
