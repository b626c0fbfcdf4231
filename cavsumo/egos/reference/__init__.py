"""Reference drivers: who could have avoided it? One file a driver, none of them knows SUMO.

Importing this package registers the drivers that come with cavsumo. To add one: a file here, its
name in the import below.
"""

from cavsumo.egos.reference import (  # noqa: F401  (imported to be registered)
    human,
    ideal,
    rss,
)
from cavsumo.egos.reference.base import REFERENCES, Reference

__all__ = ["REFERENCES", "Reference"]
