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
