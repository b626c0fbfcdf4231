"""Assertions about the ego: the protocol (``base``), the registry, one file per assertion.

Also the other evaluations of an episode: contacts, validity of the testers, blame, naturalness,
criticality, ``metrics`` (functions of numbers), ``formulas`` (temporal logic). Importing this
package registers the assertions that come with cavsumo. No file here moves a body. To add one: a
file here, its name in the import below.
"""

from cavsumo.assertions import (  # noqa: F401  (imported to be registered)
    collision,
    criticality,
    give_way,
    hard_braking,
    leaving_the_road,
    reaction_zone,
    red_light,
    rss,
    speed_limit,
    standing,
    stopping_distance,
    two_second_gap,
)
from cavsumo.assertions.base import ASSERTIONS, Assertion, Judgement
from cavsumo.assertions.specs import make_assertions

__all__ = ["ASSERTIONS", "Assertion", "Judgement", "make_assertions"]
