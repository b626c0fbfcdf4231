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
        "crosswalk": "crosswalk",
        "sumo": "sumo",
        "sumo:ACC": "sumo_models",
        "sumo:CACC": "sumo_models",
        "sumo:EIDM": "sumo_models",
        "sumo:IDM": "sumo_models",
        "sumo:Krauss": "sumo_models",
        "time-gap": "time_gap",
    },
    {
        "constant": "speed",
        "crosswalk": "",
        "sumo": "carFollowModel reaction_s",  # and attributes of a vType, as those below
        "sumo:ACC": "reaction_s",
        "sumo:CACC": "reaction_s",
        "sumo:EIDM": "reaction_s",
        "sumo:IDM": "reaction_s",
        "sumo:Krauss": "reaction_s",
        "time-gap": "speed time_gap_s standstill_m accel decel margin_m",
    },
)
# What may stand before a colon: egos in other processes.
EXTERNAL_NAMES = Names("ego", "cavsumo.egos.external", {"exec": "ego", "tcp": "ego"})


def check_ego(name: str, params: Iterable[str]) -> None:
    """Refuse an unknown ego, or parameters that it does not have.

    One of the user's own is checked when it is built.
    """
    if not is_built_in(name):
        return
    EGO_NAMES.check(name)
    known = EGO_NAMES.parameters(name)
    if known is None:
        return
    if name.partition(":")[0] == "sumo":
        check_attributes((key for key in params if key not in known), f"ego {name}")
    else:
        check_parameters(params, known, f"ego {name}")


def is_built_in(ego: str) -> bool:
    """Whether a name can only be one of ours: without a colon, or a variant such as sumo:IDM."""
    return ego.partition(":")[0] in EGO_NAMES or ":" not in ego
