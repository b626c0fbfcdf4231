"""The egos that come with cavsumo: each name with the file that registers it."""

from cavsumo.model.names import Names

EGO_NAMES = Names(
    "ego",
    "cavsumo.egos",
    {
        "constant": "constant",
        "sumo": "sumo",
        "sumo:ACC": "sumo_models",
        "sumo:CACC": "sumo_models",
        "sumo:EIDM": "sumo_models",
        "sumo:IDM": "sumo_models",
        "sumo:Krauss": "sumo_models",
        "time-gap": "time_gap",
    },
)
# What may stand before a colon: egos in other processes.
EXTERNAL_NAMES = Names("ego", "cavsumo.egos.external", {"exec": "ego", "tcp": "ego"})


def is_built_in(ego: str) -> bool:
    """Whether a name can only be one of ours: without a colon, or a variant such as sumo:IDM."""
    return ego.partition(":")[0] in EGO_NAMES or ":" not in ego
