"""Reference drivers: who could have avoided it? One file a driver, none of them knows SUMO.

To add one: a file here, its name in ``names``; it is imported when one is built.
"""

from typing import TYPE_CHECKING

from cavsumo.model.lazily import lazily

if TYPE_CHECKING:
    from cavsumo.egos.reference.base import REFERENCES, Reference

__all__ = ["REFERENCES", "Reference"]

__getattr__ = lazily(
    __name__, dict.fromkeys(("REFERENCES", "Reference"), "cavsumo.egos.reference.base")
)
