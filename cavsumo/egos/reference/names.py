"""The reference drivers that come with cavsumo: each name with the file that registers it."""

from cavsumo.model.names import Names

REFERENCE_NAMES = Names(
    "reference driver",
    "cavsumo.egos.reference",
    {
        "human": "human",
        "ideal": "ideal",
        "rss": "rss",
    },
)
