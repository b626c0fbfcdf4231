"""Reference drivers, by which violations are judged avoidable or not: one file per driver, without
SUMO.

To add one: a file here, its name in ``names``; it is imported when one is built.
"""

from typing import TYPE_CHECKING

from cavsumo.model.lazily import lazily

if TYPE_CHECKING:
    from cavsumo.egos.reference.base import REFERENCES, Reference

__all__ = ["IDEAL", "REFERENCES", "Reference"]

IDEAL = "ideal"  # the driver that is asked besides the one that a batch is judged by

__getattr__ = lazily(
    __name__, dict.fromkeys(("REFERENCES", "Reference"), "cavsumo.egos.reference.base")
)
