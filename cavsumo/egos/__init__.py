"""The vehicle under test: the protocol (``base``), the registry, one file per kind of driver.

``external`` communicates with egos in other processes, ``reference`` holds the drivers by which
violations are judged. Importing this package registers the egos that come with cavsumo. To add one:
a file here, its name in the import below. To add a reference driver: ``reference``.
"""

from cavsumo.egos import (  # noqa: F401  (imported to be registered)
    constant,
    sumo,
    time_gap,
)
from cavsumo.egos.base import EGOS, Acceleration, Command, Drive, Ego
from cavsumo.egos.specs import make_ego

__all__ = ["EGOS", "Acceleration", "Command", "Drive", "Ego", "make_ego"]
