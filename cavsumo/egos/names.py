"""The egos that come with cavsumo: each name with the file that registers it."""

from __future__ import annotations

from collections.abc import Iterable

from cavsumo.egos.vtype_attributes import check_attributes
from cavsumo.model.names import Names, check_parameters

EGO_NAMES = Names(
    "ego",
    "cavsumo.egos",
    {
        "constant": "constant",
        "sumo": "sumo",
        "time-gap": "time_gap",
    },
    {
        "constant": "speed",
        "sumo": "carFollowModel actionStepLength",  # and attributes of a vType
        "time-gap": "speed time_gap_s standstill_m accel decel margin_m",
    },
)
# What may stand before a colon: egos in other processes.
EXTERNAL_NAMES = Names("ego", "cavsumo.egos.external", {"exec": "ego", "tcp": "ego"})


def check_ego(name: str, params: Iterable[str]) -> None:
    """Refuse an unknown ego, or parameters that it does not have.

    One of the user's own, with a colon in its name, is checked when it is built.
    """
    if ":" in name:
        return
    EGO_NAMES.check(name)
    known = EGO_NAMES.parameters(name)
    if known is None:
        return
    if name == "sumo":
        check_attributes(key for key in params if key not in known)
    else:
        check_parameters(params, known, f"ego {name}")
