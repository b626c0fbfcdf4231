"""Contracts as pytest classes: the requirements on every ego, agent and assertion.

Derive a class in a test file, name a network and make the object under test::

    from cavsumo.testing import EgoContract

    class TestMyEgo(EgoContract):
        net = Path("networks/crossing.net.xml")

        def make(self):
            return make_ego("exec:./my-stack --quiet", {})

``cavsumo check-ego`` plays the same checks to an ego without pytest.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from cavsumo.agents.base import Agent
from cavsumo.assertions.base import Assertion
from cavsumo.egos.base import EGO_KIND, Ego
from cavsumo.testing import agent_checks, assertion_checks, ego_checks
from cavsumo.testing.scripts import ScriptNetwork, ground

__all__ = ["AgentContract", "AssertionContract", "EgoContract"]


class _Contract:
    """The common part of the three contracts.

    Attributes:
        net: a network file on which the drives take place.
    """

    net: Path

    def ground(self) -> ScriptNetwork:
        """The ground of the drives."""
        return ground(self.net, EGO_KIND)


class EgoContract(_Contract):
    """The requirements on every ego (``ego_checks``)."""

    def make(self) -> Ego:
        """A new ego."""
        raise NotImplementedError("say in make() how to make the ego")

    @pytest.mark.parametrize("check", ego_checks.CHECKS)
    def test_contract(self, check: str) -> None:
        """One of the checks."""
        ego_checks.CHECKS[check](self.make, self.ground())


class AgentContract(_Contract):
    """The requirements on every tester agent (``agent_checks``)."""

    def make(self) -> Agent:
        """A new agent."""
        raise NotImplementedError("say in make() how to make the agent")

    @pytest.mark.parametrize("check", agent_checks.CHECKS)
    def test_contract(self, check: str) -> None:
        """One of the checks."""
        agent_checks.CHECKS[check](self.make, self.ground())


class AssertionContract(_Contract):
    """The requirements on every assertion (``assertion_checks``)."""

    def make(self) -> Assertion:
        """A new assertion."""
        raise NotImplementedError("say in make() how to make the assertion")

    @pytest.mark.parametrize("check", assertion_checks.CHECKS)
    def test_contract(self, check: str) -> None:
        """One of the checks."""
        assertion_checks.CHECKS[check](self.make, self.ground())
