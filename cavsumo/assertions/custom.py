"""Assertions from the user: a Python function or class named ``module:attribute``.

A function is given each snapshot, and the scene if its second parameter is called ``scene``; its
further parameters are those of the assertion. It returns a number, the robustness: below zero the
assertion is violated. It returns None while its precondition does not hold.

A class is built with the parameters. It derives from ``Assertion``, or has ``observe(snapshot)``,
which returns what a function returns, and may have ``reset(scene)``. An object that observes is
copied afresh for every episode, so that what it keeps changes no later one.

Either may say ``sees_background = False``: that it never looks at background traffic or lights; and
``unconditional = True``: that it has no precondition.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from numbers import Real
from typing import Any

from cavsumo.assertions.base import HELD, SEVERITY, VIOLATED, Assertion, Judgement
from cavsumo.assertions.contacts import Contact
from cavsumo.errors import AssertionFault, InputError
from cavsumo.model.objects import Copies, is_instance
from cavsumo.model.plugins import imported, said
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

SCENE = "scene"  # name of the second parameter of a function that is given the scene


class CustomAssertion(Assertion):
    """What users wrote, kept from doing harm: whatever it does wrong is an AssertionFault."""

    def __init__(self, spec: str, params: Mapping[str, Any]) -> None:
        self.name = spec  # type: ignore[misc]  # registered ones have theirs on the class
        self._own = _made(spec, params)
        self._again = (spec, params) if is_instance(spec) else None
        self._theirs: Judgement | None = None
        self.sees_background = bool(getattr(self._own, "sees_background", True))
        self.unconditional = bool(getattr(self._own, "unconditional", False))

    def reset(self, scene: Scene) -> None:
        super().reset(scene)
        self._margin, self._theirs = math.inf, None
        if self._again is not None:
            self._own = _made(*self._again)
        if hasattr(self._own, "reset"):
            try:
                self._own.reset(scene)
            except Exception as error:
                raise AssertionFault(
                    f"assertion {self.name}: reset raised {said(error)}"
                ) from error
        if isinstance(self._own, Assertion):
            self._take_over("at the start")

    def observe(self, snapshot: Snapshot, contacts: Sequence[Contact]) -> None:
        if self.decided:
            return
        at = f"at {snapshot.time:.2f} s"
        whole = isinstance(self._own, Assertion)
        shown: tuple[Any, ...] = (snapshot, contacts) if whole else (snapshot,)
        if isinstance(self._own, _Function) and self._own.wants_scene:
            shown = snapshot, self.scene
        try:
            answer = self._own.observe(*shown)
        except Exception as error:
            raise AssertionFault(f"assertion {self.name} {at}: raised {said(error)}") from error
        if whole:
            self._take_over(at)
        elif answer is not None:
            self._judge(snapshot, self._number(answer, at))

    def conclude(self) -> None:
        if isinstance(self._own, Assertion):
            try:
                self._own.conclude()
            except Exception as error:
                at = f"assertion {self.name} at the end"
                raise AssertionFault(f"{at}: raised {said(error)}") from error
            self._take_over("at the end")
        elif self.judgement.verdict == HELD:
            self.judgement = dataclasses.replace(self.judgement, robustness=self._margin)

    def _number(self, answer: Any, at: str) -> float:
        """What was answered, if it is a number."""
        if isinstance(answer, bool) or not isinstance(answer, Real) or math.isnan(answer):
            raise AssertionFault(
                f"assertion {self.name} {at}: expected a number, below zero when violated, or "
                f"None, got {answer!r}"
            )
        return float(answer)

    def _judge(self, snapshot: Snapshot, margin: float) -> None:
        """Take in the robustness at a timestep."""
        if not self.judgement.triggered:
            self.judgement = Judgement(
                self.name, HELD, trigger_time=snapshot.time, ego_speed=snapshot.ego.v
            )
        self._margin = min(self._margin, margin)
        if margin < 0.0:
            self.judgement = dataclasses.replace(
                self.judgement,
                verdict=VIOLATED,
                violation_time=snapshot.time,
                ego_speed=snapshot.ego.v,
                robustness=margin,
            )
            self.decided = True

    def _take_over(self, at: str) -> None:
        """Judge as the user's Assertion does, under the name that it was given by."""
        theirs = getattr(self._own, "judgement", None)
        if not isinstance(theirs, Judgement) or theirs.verdict not in SEVERITY:
            raise AssertionFault(
                f"assertion {self.name} {at}: expected a Judgement with a verdict, got {theirs!r}"
            )
        if theirs is not self._theirs:
            self._theirs = theirs
            self.judgement = dataclasses.replace(theirs, assertion=self.name)
        self.decided, self.pending = bool(self._own.decided), bool(self._own.pending)


class _Function:
    """A user's function as something that observes.

    Attributes:
        wants_scene: it is given the scene as well.
    """

    def __init__(self, function: Callable[..., Any], params: Mapping[str, Any]) -> None:
        self.wants_scene = _takes_scene(function)
        self.sees_background = bool(getattr(function, "sees_background", True))
        self._function, self._params = function, dict(params)

    def observe(self, *shown: Any) -> Any:
        """Its answer."""
        return self._function(*shown, **self._params)


def custom_parameters(spec: str) -> inspect.Signature:
    """The parameters of a user's assertion, without the snapshot and the scene."""
    entry = imported(spec, f"assertion {spec}", "function or class", functions=True)
    try:
        found = list(inspect.signature(entry).parameters.values())
    except (TypeError, ValueError):  # of some that are not written in Python
        return inspect.Signature()
    if not isinstance(entry, type | Copies):
        found = found[2 if _takes_scene(entry) else 1 :]
    kinds = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.POSITIONAL_ONLY)
    named = [p for p in found if p.kind not in kinds]
    return inspect.Signature(
        [
            p if p.kind is p.VAR_KEYWORD else p.replace(kind=inspect.Parameter.KEYWORD_ONLY)
            for p in named
        ]
    )


def _takes_scene(function: Callable[..., Any]) -> bool:
    """Whether the second parameter is the scene."""
    try:
        return [*inspect.signature(function).parameters][1:2] == [SCENE]
    except (TypeError, ValueError):
        return False


def _made(spec: str, params: Mapping[str, Any]) -> Any:
    """The user's assertion, built; raises InputError if that is none."""
    entry = imported(spec, f"assertion {spec}", "function or class", functions=True)
    if not isinstance(entry, type | Copies):
        try:
            shown = (None,) * (2 if _takes_scene(entry) else 1)
            inspect.signature(entry).bind(*shown, **params)
        except TypeError as error:
            raise InputError(f"assertion {spec}: cannot be called: {error}") from error
        except ValueError:
            pass  # its signature is not known
        return _Function(entry, params)
    try:
        own = entry(**params)
    except Exception as error:
        raise InputError(f"assertion {spec}: cannot be built: {said(error)}") from error
    if not callable(getattr(own, "observe", None)):
        raise InputError(f"assertion {spec}: has no method observe(snapshot)")
    if isinstance(own, Assertion) and not hasattr(own, "name"):
        own.name = spec  # type: ignore[misc]
    return own
