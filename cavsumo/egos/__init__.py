"""The vehicle under test: the protocol (``base``), the registry, one file a sort of driver.

``external`` speaks with egos in other processes, ``reference`` holds the drivers by which
violations are judged.
To add one: a file here, its name in ``names``; it is imported when one is built. To add a
reference driver: ``reference``.
"""

from typing import TYPE_CHECKING

from cavsumo.model.lazily import lazily

if TYPE_CHECKING:
    from cavsumo.egos.base import EGOS, Acceleration, Command, Drive, Ego
    from cavsumo.egos.specs import make_ego

__all__ = ["EGOS", "Acceleration", "Command", "Drive", "Ego", "make_ego"]

__getattr__ = lazily(
    __name__,
    dict.fromkeys(("EGOS", "Acceleration", "Command", "Drive", "Ego"), "cavsumo.egos.base")
    | {"make_ego": "cavsumo.egos.specs"},
)
