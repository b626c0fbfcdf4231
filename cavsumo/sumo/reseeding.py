"""New random numbers in a running simulation of SUMO.

SUMO draws from generators that it seeds once, when it starts, from its option ``seed``; neither
libsumo nor traci can seed them again. The library itself can (``native``).
"""

from __future__ import annotations

from typing import Any

from cavsumo.errors import SimulationError
from cavsumo.sumo.native import Library

REFUSED = "this build of libsumo cannot seed a running simulation; branch without a seed"


def reseed(sumo: Any, seed: int) -> None:
    """Seed all generators of SUMO as a start with that seed does.

    Args:
        sumo: the module libsumo, with a simulation.

    Raises SimulationError if this build of libsumo has other functions.
    """
    library = Library(sumo)
    if not library.complete:
        raise SimulationError(REFUSED)
    library.set_option("seed", str(seed % 2**31))
    library.seed_all()
