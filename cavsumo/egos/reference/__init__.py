"""Reference drivers, by which violations are judged avoidable or not: one file per driver, without
SUMO.

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
