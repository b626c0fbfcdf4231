"""What the ego must not do: one protocol (``base``), one registry, one file an assertion.

Importing this package registers the assertions that come with cavsumo.
"""

from cavsumo.assertions import collision, reaction_zone  # noqa: F401  (imported to be registered)
from cavsumo.assertions.base import ASSERTIONS, Assertion, Judgement
from cavsumo.assertions.specs import make_assertions

__all__ = ["ASSERTIONS", "Assertion", "Judgement", "make_assertions"]
