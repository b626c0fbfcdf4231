"""The messages between cavsumo and an external ego as JSON lines, with checks of the replies.

Text only, independent of the transport of the lines. ``docs/ego-protocol.md`` is the specification.
Floats are written as Python's repr, the shortest text that reads back as the same number.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import shapely

from cavsumo.egos.base import Acceleration, Drive, Mission
from cavsumo.errors import EgoError
from cavsumo.model.bodies import Body, Kind
from cavsumo.model.carriageway import MarkedCrossing
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import RawState, Snapshot

PROTOCOL, VERSION = "cavsumo-ego", 1
CLOSE = b'{"type":"close"}\n'
_COMMAND = frozenset({"acceleration", "throttle", "steering", "step"})  # keys of an answer
SHOWN = 80  # characters of a reply that a message quotes
# SUMO's letters of a traffic light (its documentation, "Traffic Lights", signal state definitions).
LIGHTS = {
    "r": "red",
    "y": "yellow",
    "Y": "yellow",
    "g": "green",
    "G": "green",
    "u": "red-yellow",
    "s": "stop",
    "o": "blinking",
    "O": "off",
}


# What cavsumo says --------------------------------------------------------------------------------


def hello(mission: Mission, kind: Kind) -> bytes:
    """The first line: the constants of the scenario."""
    speed = mission.approach_speed
    return _line(
        {
            "type": "hello",
            "protocol": PROTOCOL,
            "version": VERSION,
            "timestep_s": mission.dt,
            "horizon_s": mission.horizon,
            **({} if speed is None else {"approach_speed_mps": speed}),
            "ego": {
                "length_m": kind.length,
                "width_m": kind.width,
                "wheelbase_m": kind.wheelbase,
                "speed_min_mps": kind.v_min,
                "speed_max_mps": kind.v_max,
                "acceleration_min_mps2": kind.throttle_min,
                "acceleration_max_mps2": kind.throttle_max,
                "steering_max_rad": kind.steering_max,
            },
            "network": str(mission.net.resolve()),
            "route": {
                "edges": mission.edges,
                "points_m": mission.path.points,
                "lanes": [
                    {"from_m": r.along, "width_m": r.width, "speed_limit_mps": r.speed}
                    for r in mission.surroundings.route
                ],
            },
            "traffic_lights": [{"id": t.id, "stop_line_m": t.along} for t in mission.lights],
            "crossings": [_crossing(crossing) for crossing in mission.crossings],
            "lanes": [
                {"id": lane.id, "left_m": lane.left, "right_m": lane.right}
                for lane in mission.surroundings.lanes
            ],
            "pavements_m": mission.surroundings.pavements,
        }
    )


def _crossing(crossing: MarkedCrossing) -> dict[str, Any]:
    """A marked crossing on the route."""
    return {
        "id": crossing.id,
        "begin_m": crossing.begin,
        "end_m": crossing.end,
        "priority": crossing.priority,
        "signalled": crossing.signalled,
        "outline_m": [
            [round(x, 3), round(y, 3)] for x, y in shapely.get_coordinates(crossing.surface)[:-1]
        ],
    }


def reset(seed: int) -> bytes:
    """The line that begins an episode."""
    return _line({"type": "reset", "seed": seed})


class Observations:
    """Writes the observations of one episode."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._half = scene.ego.kind.length / 2
        self._speed: float | None = None  # of the ego in the last observation
        # The object of each body up to its numbers, its last state and the whole object then. By
        # identity, which is quick to look up; the state keeps the body, so that no other one takes
        # its identity.
        self._known: dict[int, tuple[str, RawState, str]] = {}

    def line(self, snapshot: Snapshot) -> bytes:
        """The observation of one timestep."""
        _, x, y, v, o = snapshot.ego
        here = self._scene.ego_projection(snapshot)
        states = (*snapshot.testers, *snapshot.raw_background)
        bodies = map(self._body, states, self._on_carriageway(states))
        gained = 0.0 if self._speed is None else (v - self._speed) / self._scene.dt
        self._speed = v
        return (
            f'{{"type":"observation","step":{snapshot.step},"time_s":{_f(snapshot.time)},'
            f'"ego":{{"x_m":{_f(x)},"y_m":{_f(y)},"heading_rad":{_f(o)},"speed_mps":{_f(v)},'
            f'"acceleration_mps2":{_f(gained)},'
            f'"steering_rad":{_f(snapshot.ego_steering)},"along_m":{_f(here.along)},'
            f'"lateral_m":{_f(here.lateral)}}},'
            f'"traffic_light":{self._light(snapshot, here.along + self._half)},'
            f'"bodies":[{",".join(bodies)}]}}\n'
        ).encode()

    def _on_carriageway(self, states: Sequence[RawState]) -> Sequence[bool]:
        """Whether each body's centre is on a carriageway; the open plane is one."""
        roads = self._scene.roads
        if roads is None:
            return [True] * len(states)
        return roads.contain([state[1] for state in states], [state[2] for state in states])

    def _body(self, state: RawState, on_carriageway: bool) -> str:
        body, x, y, v, o = state
        known = self._known.get(id(body))
        if known is not None and known[1] == state:
            return known[2]  # it stands
        head = _head(body) if known is None else known[0]
        text = (
            f'{head}{_f(x)},"y_m":{_f(y)},"heading_rad":{_f(o)},"speed_mps":{_f(v)},'
            f'"on_carriageway":{"true" if on_carriageway else "false"}}}'
        )
        self._known[id(body)] = head, state, text
        return text

    def _light(self, snapshot: Snapshot, front: float) -> str:
        """The next traffic light whose stop line the front bumper has not passed."""
        for light, letter in zip(self._scene.lights, snapshot.lights, strict=False):
            if light.along >= front:
                seen = {"id": light.id, "distance_m": light.along - front}
                return _text(seen | {"state": LIGHTS.get(letter, "unknown"), "letter": letter})
        return "null"


def _head(body: Body) -> str:
    """A body's object up to the first number that changes."""
    kind = body.kind
    constant = {"id": body.id, "kind": kind.name, "length_m": kind.length, "width_m": kind.width}
    return _text(constant)[:-1] + ',"x_m":'


_f = float.__repr__  # json's own way with floats; numpy's are floats too but have another repr


def _text(data: Any) -> str:
    return json.dumps(data, separators=(",", ":"), allow_nan=False)


def _line(data: Any) -> bytes:
    return (_text(data) + "\n").encode()


# What the ego answers -----------------------------------------------------------------------------


def check_hello(line: bytes) -> None:
    """Raise EgoError unless this answers our hello in our version."""
    reply = _typed(line, "hello")
    if reply.get("version") != VERSION or isinstance(reply["version"], bool):
        said = f"version {_quoted(reply['version'])}" if "version" in reply else "no version"
        raise EgoError(f"speaks {said} of the protocol, expected version {VERSION}")


def check_ready(line: bytes) -> None:
    """Raise EgoError unless this answers a reset."""
    _typed(line, "ready")


def is_ready(line: bytes) -> bool:
    """Whether this answers a reset."""
    try:
        check_ready(line)
    except EgoError:
        return False
    return True


def is_left_over(line: bytes) -> bool:
    """Whether this answers an observation instead of a reset."""
    try:
        return not _COMMAND.isdisjoint(_object(line))
    except EgoError:
        return False


def answer(line: bytes, step: int) -> tuple[Acceleration | Drive, bool]:
    """The command in the answer to the observation of a timestep, and whether it names the
    timestep.

    Raises EgoError if it names another timestep.
    """
    reply = _object(line)
    if "step" not in reply:
        return _command(line, reply), False
    named = reply["step"]
    if isinstance(named, bool) or named != step:
        raise EgoError(f"answered step {_quoted(named)} when asked for step {step}")
    return _command(line, reply), True


def command(line: bytes) -> Acceleration | Drive:
    """The command in the answer to an observation; its numbers may be out of range."""
    return _command(line, _object(line))


def _command(line: bytes, reply: dict[str, Any]) -> Acceleration | Drive:
    """The command of a reply."""
    accelerates = "acceleration" in reply
    if accelerates is ("throttle" in reply or "steering" in reply):
        raise EgoError(
            f"answered {shown(line)}, expected either acceleration or throttle and steering"
        )
    if accelerates:
        return Acceleration(_number(reply, "acceleration"))
    return Drive(_number(reply, "throttle"), _number(reply, "steering"))


def names(command: Acceleration | Drive) -> tuple[str, ...]:
    """The names of the numbers of a command in the protocol."""
    return ("acceleration",) if isinstance(command, Acceleration) else ("throttle", "steering")


def _typed(line: bytes, expected: str) -> dict[str, Any]:
    """A reply of the type expected."""
    reply = _object(line)
    if reply.get("type") != expected:
        raise EgoError(f'answered {shown(line)}, expected an object of "type" "{expected}"')
    return reply


def _object(line: bytes) -> dict[str, Any]:
    """A reply as an object; raises EgoError with its text if it reports an error."""
    try:
        reply = json.loads(line.decode())
    except (ValueError, RecursionError):
        raise EgoError(f"answered {shown(line)}, expected a line of JSON") from None
    if not isinstance(reply, dict):
        raise EgoError(f"answered {shown(line)}, expected a JSON object")
    if "error" in reply:
        raise EgoError(f"gave up: {_quoted(reply['error'])}")
    return reply


def _number(reply: dict[str, Any], name: str) -> float:
    """A number of a reply, infinite when no float can hold it."""
    value = reply.get(name)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        said = "nothing" if name not in reply else _quoted(value)
        raise EgoError(f"{name} must be a number, got {said}")
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def shown(line: bytes) -> str:
    """A line as a message quotes it: in quotes, not too long."""
    text = line.decode("utf-8", errors="backslashreplace")
    return repr(text if len(text) <= SHOWN else text[:SHOWN] + "...")


def _quoted(value: Any) -> str:
    """A value of a reply, not too long."""
    text = repr(value)
    return text if len(text) <= SHOWN else text[:SHOWN] + "..."
