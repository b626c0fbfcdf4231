"""What the ego must not do: one protocol (``base``), one registry, one file an assertion.

Importing this package registers the assertions that come with cavsumo.
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
