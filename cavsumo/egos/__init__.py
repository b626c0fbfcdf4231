"""The vehicle under test: one protocol (``base``), one registry, one file a sort.

Importing this package registers the egos that come with cavsumo.
"""

from cavsumo.egos import constant, sumo, time_gap  # noqa: F401  (imported to be registered)
from cavsumo.egos.base import EGOS, Acceleration, Command, Drive, Ego
from cavsumo.egos.specs import make_ego

__all__ = ["EGOS", "Acceleration", "Command", "Drive", "Ego", "make_ego"]
