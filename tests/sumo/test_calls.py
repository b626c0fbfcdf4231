"""SUMO's functions without the layer of Python around them, and reruns that show less."""

from __future__ import annotations

import libsumo
import pytest

from cavsumo.model.bodies import CAR, PEDESTRIAN, Body
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.simulation.reruns import same
from cavsumo.sumo.calls import direct


class Traffic:
    """A domain that is not SUMO's."""

    def getSpeed(self, name: str) -> float:
        return 7.0


@pytest.mark.parametrize(
    ("domain", "name"),
    [("vehicle", "moveToXY"), ("person", "getAngle"), ("simulation", "step")],
)
def test_a_function_is_that_of_the_extension(domain: str, name: str) -> None:
    """The one that the function in Python calls, with the same arguments."""
    found = direct(getattr(libsumo, domain), name)
    assert found is getattr(libsumo._libsumo, f"{domain}_{name}")


def test_a_function_that_the_extension_has_not_is_the_domains_own() -> None:
    """Of a build with other names, or of another domain."""
    assert direct(Traffic(), "getSpeed")("car0") == 7.0


def test_a_rerun_that_shows_less_is_compared_in_what_both_show() -> None:
    """The ego, the testers and the bodies near them; not those that it left out."""
    ego, tester = (
        BodyState(Body("ego", CAR), 0, 0, 5, 0),
        BodyState(Body("t", PEDESTRIAN), 9, 3, 1, 0),
    )
    near, far = (Body("near", CAR), 4.0, 3.0, 1.0, 0.0), (Body("far", CAR), 90.0, 3.0, 1.0, 0.0)
    whole = Snapshot(3, 0.3, ego, 0.0, (tester,), (near, far))
    less = whole._replace(raw_background=(near,))
    assert same(whole, whole)
    assert same(less, whole)
    assert same(whole, less)
    assert same(whole._replace(raw_background=()), whole)
    assert not same(less._replace(raw_background=((*near[:3], 1.1, 0.0),)), whole)
    assert not same(less._replace(ego=ego._replace(v=5.1)), whole)
    assert not same(less._replace(testers=()), whole)
    assert not same(less._replace(step=4), whole)
