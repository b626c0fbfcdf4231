"""cavsumo: generates tests for autonomous vehicles in SUMO.

The rooms of the house, in the order in which they may use each other, are listed in
``docs/architecture.md``. Nothing is imported here, so that ``import cavsumo`` costs nothing.
"""

__version__ = "0.1.0"
