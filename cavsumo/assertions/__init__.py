"""What the ego must not do: the protocol (``base``), the registry, one file an assertion.

Also what an episode is judged by besides: contacts, validity of the testers, blame, naturalness,
criticality, ``metrics`` (functions of numbers), ``formulas`` (temporal logic).
Nothing here moves a body.
To add one: a file here, its name in ``names``; it is imported when one is built.
"""

from typing import TYPE_CHECKING

from cavsumo.model.lazily import lazily

if TYPE_CHECKING:
    from cavsumo.assertions.base import ASSERTIONS, Assertion, Judgement
    from cavsumo.assertions.specs import make_assertions

__all__ = ["ASSERTIONS", "Assertion", "Judgement", "make_assertions"]

__getattr__ = lazily(
    __name__,
    {
        "ASSERTIONS": "cavsumo.assertions.base",
        "Assertion": "cavsumo.assertions.base",
        "Judgement": "cavsumo.assertions.base",
        "make_assertions": "cavsumo.assertions.specs",
    },
)
