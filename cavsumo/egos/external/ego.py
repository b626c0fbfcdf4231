"""External egos: a program that is started (``exec:COMMAND``), or one that listens (``tcp:``).

Each has one conversation by the rules of ``protocol``. An error in it ends the episode as an
EgoError with the time; the next episode begins a new conversation.
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
from cavsumo.egos.external.link import ExtraLineError, GoneError, Link, Tail
from cavsumo.egos.external.protocol import shown
from cavsumo.egos.external.wire import Wire, host_and_port
from cavsumo.egos.names import EXTERNAL_NAMES
from cavsumo.errors import EgoError, InputError
from cavsumo.model.checks import number
from cavsumo.model.registry import Registry
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

DAY_S = 86400.0
EXTERNAL: Registry[ExternalEgo] = Registry(EXTERNAL_NAMES)


class ExternalEgo(Ego, ABC):
    """Base of both; the spec is its name in messages."""

    outside = True

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
        self._ended: EgoError | None = None  # between two episodes
        self._tail = Tail()

    @abstractmethod
    def _aim(self, address: str) -> None:
        """Take up the part of the spec after the colon; raises InputError."""

    @abstractmethod
    def _linked(self) -> Link:
        """A new process or connection; raises EgoError if that fails."""

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
        self._time, self._named = 0.0, True
        self._observations = protocol.Observations(scene)
        self._reset = protocol.reset(scene.seed)
        try:
            self._begin()
        except EgoError as error:
            raise self._given_up(" (reset)", error) from error

    def act(self, snapshot: Snapshot) -> Command:
        assert self._link is not None  # or reset has raised
        self._time = snapshot.time
        try:
            reply = self._link.ask(self._observations.line(snapshot), self.reply_s)
            command, named = protocol.answer(reply, snapshot.step)
            checked(command, self._sort, self.kind, protocol.names(command))
        except EgoError as error:
            raise self._given_up("", error) from error
        self._sort, self._named = type(command), self._named and named
        return command

    def conclude(self) -> None:
        """Make sure that each answer belonged to its observation, if the answers have no step.

        A late second answer would have been taken for the answer to the next observation. After one
        more reset all lines about this episode have arrived.
        """
        if self._link is None or self._named:
            return
        self._link.drain()
        log = self._tail.state()
        try:
            left = self._left_over(self._link)
            self._link.drain()
            if left:
                raise EgoError(f"answered more often than it was asked: {shown(left)} is left over")
        except GoneError as error:  # its answers are all there: the next episode will have none
            self._drop()
            self._ended = error
        except EgoError as error:
            raise self._given_up(" (end)", error) from error
        else:
            self._named = True
            self._tail.back_to(log)  # it may say that it begins again, and no episode does

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

    def _begin(self) -> None:
        """Begin an episode, in a new conversation if the old one has unread lines.

        Lines that precede this episode are not its error.
        """
        if self._ended is not None:
            error, self._ended = self._ended, None
            raise error
        if self._link is not None:
            left = self._left_over(self._link)
            if not left:
                return
            note = f"[cavsumo: {shown(left)} was written before this episode; begun anew]\n"
            self._tail.add(note.encode())
            self._drop()
        protocol.check_ready(self._open().ask(self._reset, self.start_s))

    def _left_over(self, link: Link) -> bytes:
        """Ask the ego to begin an episode; returns the line about the previous one, if any."""
        try:
            reply = link.ask(self._reset, self.start_s)
        except ExtraLineError as error:
            if protocol.is_ready(error.line):
                raise
            return error.line or b"\n"
        if protocol.is_left_over(reply):
            return reply
        protocol.check_ready(reply)
        return b""

    def _given_up(self, when: str, error: EgoError) -> EgoError:
        """The error of an episode, whose conversation is ended."""
        self._drop()
        return EgoError(f"ego {self.spec} at {self._time:.2f} s{when}: {error}")

    def _drop(self) -> None:
        """End the process or connection at once."""
        if self._link is not None:
            self._link.end()
            self._link = None


@EXTERNAL.register("exec")
class ExecEgo(ExternalEgo):
    """A program that answers on its stdout the lines of its stdin: --ego exec:COMMAND."""

    def _aim(self, address: str) -> None:
        self.words = command_words(address)

    def _linked(self) -> Link:
        return Child(self.words, self._tail)


@EXTERNAL.register("tcp")
class TcpEgo(ExternalEgo):
    """A program that listens at a port and answers the same lines: --ego tcp:HOST:PORT."""

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
