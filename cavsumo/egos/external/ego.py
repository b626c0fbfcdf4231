"""Egos from outside: a program that is started (``exec:COMMAND``), or one that listens (``tcp:``).

Each is one conversation by the rules of ``protocol``. Whatever goes wrong in it ends the episode
as an EgoError with the time; the next episode begins a new conversation.
"""

from __future__ import annotations

import dataclasses
import math
import shlex
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar

from cavsumo.egos.base import EGO_KIND, Command, Ego, Mission
from cavsumo.egos.effectors import checked
from cavsumo.egos.external import protocol
from cavsumo.egos.external.child import Child
from cavsumo.egos.external.link import Link, Tail
from cavsumo.egos.external.wire import Wire, host_and_port
from cavsumo.errors import EgoError, InputError
from cavsumo.model.checks import number
from cavsumo.model.registry import Registry
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

DAY_S = 86400.0
EXTERNAL: Registry[ExternalEgo] = Registry("ego")


class ExternalEgo(Ego, ABC):
    """Base of both; the spec names it in messages."""

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "reply_s": "real time within which it must answer an observation [s]",
        "start_s": "real time within which it must answer a hello or a reset [s]",
        "depart_speed": "speed on entering [m/s]; as fast as SUMO finds safe if not given",
        "length": "length of its box [m]",
        "width": "width of its box [m]",
        "wheelbase": "distance between its axles [m]",
        "v_max": "its top speed [m/s]",
        "throttle_min": "its hardest braking, negative [m/s2]",
        "throttle_max": "its hardest acceleration [m/s2]",
        "steering_max": "its largest steering angle to either side [rad]",
    }

    def __init__(
        self,
        spec: str,
        *,
        reply_s: float = 1.0,
        start_s: float = 10.0,
        depart_speed: float | None = None,
        length: float = EGO_KIND.length,
        width: float = EGO_KIND.width,
        wheelbase: float = EGO_KIND.wheelbase,
        v_max: float = EGO_KIND.v_max,
        throttle_min: float = EGO_KIND.throttle_min,
        throttle_max: float = EGO_KIND.throttle_max,
        steering_max: float = EGO_KIND.steering_max,
    ) -> None:
        self.spec = spec
        self._aim(spec.partition(":")[2])
        self.reply_s = number("reply_s", reply_s, 0.001, DAY_S)
        self.start_s = number("start_s", start_s, 0.001, 60.0)
        self.kind = dataclasses.replace(
            EGO_KIND,
            length=number("length", length, 0.1, 30.0),
            width=number("width", width, 0.1, 5.0),
            wheelbase=number("wheelbase", wheelbase, 0.1, 30.0),
            v_max=number("v_max", v_max, 0.1, 100.0),
            throttle_min=number("throttle_min", throttle_min, -100.0, -0.01),
            throttle_max=number("throttle_max", throttle_max, 0.01, 100.0),
            steering_max=number("steering_max", steering_max, 0.0, math.nextafter(math.pi / 2, 0)),
        )
        if depart_speed is not None:
            self.depart_speed = number("depart_speed", depart_speed, 0.0, self.kind.v_max)
        self._link: Link | None = None
        self._tail = Tail()

    @abstractmethod
    def _aim(self, address: str) -> None:
        """Take up what stands behind the colon of the spec; raises InputError."""

    @abstractmethod
    def _linked(self) -> Link:
        """A new process or connection; raises EgoError when there is none to be had."""

    def prepare(self, mission: Mission) -> None:
        self._hello = protocol.hello(mission, self.kind)
        try:
            self._open()
        except EgoError as error:
            raise EgoError(f"ego {self.spec}: {error}") from error

    def close(self) -> None:
        if self._link is not None:
            self._link.end(protocol.CLOSE)
            self._link = None

    def reset(self, scene: Scene) -> None:
        self._sort: type | None = None
        self._observations = protocol.Observations(scene)
        try:
            link = self._link or self._open()
            protocol.check_ready(link.ask(protocol.reset(scene.seed), self.start_s))
        except EgoError as error:
            raise self._given_up("reset", 0.0, error) from error

    def act(self, snapshot: Snapshot) -> Command:
        assert self._link is not None  # or reset has raised
        try:
            reply = self._link.ask(self._observations.line(snapshot), self.reply_s)
            command = protocol.command(reply)
            checked(command, self._sort, self.kind, protocol.names(command))
        except EgoError as error:
            raise self._given_up("act", snapshot.time, error) from error
        self._sort = type(command)
        return command

    def take_log(self) -> str:
        if self._link is not None:
            self._link.drain()
        return self._tail.take()

    def _open(self) -> Link:
        """Begin a conversation."""
        self._link = self._linked()
        try:
            protocol.check_hello(self._link.ask(self._hello, self.start_s))
        except EgoError:
            self._drop()
            raise
        return self._link

    def _given_up(self, what: str, time: float, error: EgoError) -> EgoError:
        """The error of an episode, its conversation ended."""
        self._drop()
        during = " (reset)" if what == "reset" else ""
        return EgoError(f"ego {self.spec} at {time:.2f} s{during}: {error}")

    def _drop(self) -> None:
        """End the process or connection at once."""
        if self._link is not None:
            self._link.end()
            self._link = None


@EXTERNAL.register("exec")
class ExecEgo(ExternalEgo):
    """A program that answers on its stdout what it reads on its stdin: --ego exec:COMMAND."""

    def _aim(self, address: str) -> None:
        self.words = command_words(address)

    def _linked(self) -> Link:
        return Child(self.words, self._tail)


@EXTERNAL.register("tcp")
class TcpEgo(ExternalEgo):
    """A program that listens there and answers the same lines: --ego tcp:HOST:PORT."""

    def _aim(self, address: str) -> None:
        self.host, self.port = host_and_port(address)

    def _linked(self) -> Link:
        return Wire(self.host, self.port, self.start_s, self._tail)


def command_words(command: str) -> list[str]:
    """A command as a shell would split it; raises InputError."""
    expected = "expected exec:COMMAND, such as exec:python3 my_ego.py"
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise InputError(f"ego 'exec:{command}': {error}; {expected}") from error
    if not words or not words[0]:
        raise InputError(f"ego 'exec:{command}': {expected}")
    return words
