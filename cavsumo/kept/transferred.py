"""Results of a transfer: for each test how many places apply, and at how many it fails again.

Episodes at one place differ by the ego's random numbers alone and are often alike. So places are
counted, too: those where at least one episode failed preventably. Both shares have exact intervals
(Clopper and Pearson).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from cavsumo.kept.transfer import TransferParts, number_of, place_of
from cavsumo.results.failures import NOT_JUDGED, PREVENTABLE, failure_kind
from cavsumo.results.reading import rows_of
from cavsumo.results.rows import cell, is_failure
from cavsumo.results.statistics import Rate, rate

ALL = "all"


@dataclass(frozen=True)
class Transferred:
    """A test on a network, or on all.

    Attributes:
        test, net: their names, "all" for all of them.
        places: where it was tried.
        episodes: how many were played there.
        failures: in how many the ego failed, preventably or not.
        again: the share of episodes with a preventable failure.
        again_at: the share of places with one.
        errors: episodes that could not be played.
    """

    test: str
    net: str
    places: int
    episodes: int
    failures: int
    again: Rate
    again_at: Rate
    errors: int


def transferred(parts: TransferParts, files: Sequence[Path]) -> list[Transferred]:
    """The results of each test on each network, of each test, and of all.

    ``files``: the results of the batches, in their order.
    """
    rows: dict[tuple[int, int], list[tuple[str, Mapping[str, str]]]] = defaultdict(list)
    for part, file in zip(parts.parts, files, strict=True):
        net = parts.nets.index(_net_of(part.name, parts.nets))
        for row in rows_of(file):
            agent = str(cell(row["agent"]))
            rows[number_of(agent), net].append((f"{net} {place_of(agent)}", row))
    found = []
    for t, test in enumerate(parts.tests):
        own = [one for n in range(len(parts.nets)) for one in rows[t, n]]
        found += [_told(test, net, rows[t, n]) for n, net in enumerate(parts.nets)]
        found.append(_told(test, ALL, own))
    return [*found, _told(ALL, ALL, [one for some in rows.values() for one in some])]


def _net_of(part: str, nets: Sequence[str]) -> str:
    """The network of a batch, by its name."""
    return part if part in nets else part.rpartition("-")[0]


def _told(test: str, net: str, rows: Sequence[tuple[str, Mapping[str, str]]]) -> Transferred:
    """The result of some episodes."""
    played = [(place, row) for place, row in rows if cell(row["outcome"]) != "error"]
    failed = {
        (place, str(cell(row["run"])))
        for place, row in played
        if failure_kind(row) in (PREVENTABLE, NOT_JUDGED)
    }
    places = {place for place, _ in played}
    return Transferred(
        test,
        net,
        places=len({place for place, _ in rows}),
        episodes=len(played),
        failures=sum(is_failure(row) for _, row in played),
        again=rate(len(failed), len(played), "exact"),
        again_at=rate(len({place for place, _ in failed}), len(places), "exact"),
        errors=len(rows) - len(played),
    )
