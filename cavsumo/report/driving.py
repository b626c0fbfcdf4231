"""How the ego came along: whether it arrived, what it lost, and whether it drove at all."""

from __future__ import annotations

from dataclasses import dataclass

from cavsumo.batch import sentences
from cavsumo.report.grouping import Group, Told


@dataclass(frozen=True)
class EgoDriving(Told):
    """How the ego came along in the valid episodes of a group.

    Attributes:
        arrived, could_arrive: in how many episodes it arrived, of those that no verdict ended.
        lost_s: mean time that it lost against the free drive [s]; None if that was not measured.
        stood_s: mean time that it stood [s]; likewise.
        stood_still, crawled: in how many it stood still at the end, in how many it crawled.
        warning: that as a sentence, empty where neither happened.
    """

    arrived: int
    could_arrive: int
    lost_s: float | None
    stood_s: float | None
    stood_still: int
    crawled: int
    warning: str


def driving(group: Group) -> EgoDriving:
    """How the ego came along in one group."""
    found, stood = group.found, group.valid["stood_s"].dropna()
    return EgoDriving(
        *group.whose,
        arrived=found.arrivals[True],
        could_arrive=found.arrivals.total(),
        lost_s=found.lost_s / found.compared if found.compared else None,
        stood_s=float(stood.mean()) if len(stood) else None,
        stood_still=found.frozen["stood"],
        crawled=found.frozen["crawled"],
        warning=sentences.frozen(found),
    )
