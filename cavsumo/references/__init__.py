"""Reference drivers: who could have avoided it? One file a driver, none of them knows SUMO.

Importing this package registers the drivers that come with cavsumo.
"""

from cavsumo.references import human, ideal, rss  # noqa: F401  (imported to be registered)
from cavsumo.references.base import REFERENCES, Reference

__all__ = ["REFERENCES", "Reference"]
