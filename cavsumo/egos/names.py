"""The egos that come with cavsumo: each name with the file that registers it."""

from cavsumo.model.names import Names

EGO_NAMES = Names(
    "ego",
    "cavsumo.egos",
    {
        "constant": "constant",
        "sumo": "sumo",
        "time-gap": "time_gap",
    },
)
# What may stand before a colon: egos in other processes.
EXTERNAL_NAMES = Names("ego", "cavsumo.egos.external", {"exec": "ego", "tcp": "ego"})
