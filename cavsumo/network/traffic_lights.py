"""How a traffic light is set at the start, so that the ego meets the colour asked for.

Pure: the light's program and the ego's way come from the network; the world only sets the phase.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from cavsumo.errors import NetworkError
from cavsumo.model.carriageway import Light
from cavsumo.model.vocabulary import Signal
from cavsumo.network.ego_routes import EgoRoute, lanes_along
from cavsumo.network.reader import Network

# SUMO's letters of a link; G comes before g, which gives way.
LETTERS = {"green": ("G", "g"), "red": ("r",)}
PREPARED_S = 1.0  # the colour has been shown that long when the ego starts, if it lasts
STANDING = 1.0  # m/s, egos that start more slowly are expected to speed up
PICK_UP = 2.6  # m/s2, as they do


@dataclass(frozen=True)
class Pace:
    """How fast an ego drives when nothing hinders it.

    Attributes:
        start: its speed at the start, which it keeps [m/s]; None for what the road allows.
        top: its maximum [m/s].
    """

    start: float | None = None
    top: float = 55.0


@dataclass(frozen=True)
class LightStart:
    """How a traffic light begins an episode.

    Attributes:
        light: its id.
        program: id of the program that this is meant for.
        phase: index of the phase.
        left: how long this phase goes on [s].
    """

    light: str
    program: str
    phase: int
    left: float


@dataclass(frozen=True)
class LightOnRoute:
    """The ego's way to the first traffic light on its route.

    Attributes:
        light: its id.
        link: index of the ego's link in the light's states.
        legs: lengths [m] and speed limits [m/s] on the way to it.
    """

    light: str
    link: int
    legs: tuple[tuple[float, float], ...]


def light_start(network: Network, route: EgoRoute, signal: Signal, pace: Pace) -> LightStart | None:
    """How the first light on the route must start, for an unhindered ego to meet a colour.

    None for any colour. Raises NetworkError when there is no light, when it does not run by the
    clock, or when it never shows that colour.
    """
    if signal == "any":
        return None
    approach = first_light(network, route, signal)
    program = _program(network, approach.light, signal)
    phases = [(float(phase.duration), str(phase.state)) for phase in program.getPhases()]
    arrives = arrival(approach.legs, pace)
    # Green as long before as it takes to be on when the ego starts; red in the middle.
    lead = arrives + PREPARED_S if signal == "green" else math.inf
    for letter in LETTERS[signal]:
        start = phase_at_start(phases, approach.link, letter, arrives, lead)
        if start is not None:
            return LightStart(approach.light, str(program._id), *start)
    raise NetworkError(
        f"{network.file}: signal {signal}: traffic light {approach.light!r} never shows {signal} "
        "to the ego"
    )


def lights_along(network: Network, route: EgoRoute) -> tuple[Light, ...]:
    """The traffic lights that the ego meets on its route, in this order."""
    return tuple(
        Light(
            str(link.getTLSID()),
            int(link.getTLLinkIndex()),
            route.path.project(*lane.getShape()[-1]).along,
        )
        for lane, link in _links(network, route)
        if link is not None and link.getTLSID()
    )


def first_light(network: Network, route: EgoRoute, signal: Signal) -> LightOnRoute:
    """The way to the first traffic light on the ego's route; raises NetworkError for none."""
    legs: list[tuple[float, float]] = []
    for lane, link in _links(network, route):
        legs.append((float(lane.getLength()), float(lane.getSpeed())))
        if link is not None and link.getTLSID():
            legs[0] = (max(0.1, legs[0][0] - route.depart_m), legs[0][1])
            return LightOnRoute(str(link.getTLSID()), int(link.getTLLinkIndex()), tuple(legs))
    raise NetworkError(f"{network.file}: signal {signal}: the ego's route has no traffic light")


def _links(network: Network, route: EgoRoute) -> Iterator[tuple[Any, Any]]:
    """Each lane of a route with the link to the next one, None within a junction."""
    lanes = lanes_along(network, [network.edge(edge) for edge in route.edges])
    assert lanes is not None  # or it were no route
    for lane, following in pairwise(lanes):
        onto = following.getID()
        links = lane.getOutgoing()
        joins = (k for k in links if onto == (k.getViaLaneID() or k.getToLane().getID()))
        yield lane, next(joins, None)


def arrival(legs: Sequence[tuple[float, float]], pace: Pace) -> float:
    """When an unhindered ego has come to the end of the legs [s]."""
    way = math.fsum(length for length, _ in legs)
    free = math.fsum(length / max(0.1, min(limit, pace.top)) for length, limit in legs)
    if pace.start is None:
        return free
    if pace.start > STANDING:
        return way / pace.start
    v = way / free
    if v * v / (2 * PICK_UP) > way:
        return float((2 * way / PICK_UP) ** 0.5)
    return free + v / (2 * PICK_UP)


def phase_at_start(
    phases: Sequence[tuple[float, str]], link: int, letter: str, arrival_s: float, lead_s: float
) -> tuple[int, float] | None:
    """The phase at the start and what is left of it [s], so that the link shows a letter later.

    The ego arrives in the longest run of phases that show it, at their middle at the latest. None
    when no phase shows the letter.

    Args:
        phases: durations [s] and states.
        arrival_s: when the ego arrives, from the start [s].
        lead_s: how long the letter has been shown by then, if that is before the middle [s].
    """
    shown = [state[link : link + 1] == letter for _, state in phases]
    ends = [math.fsum(duration for duration, _ in phases[: i + 1]) for i in range(len(phases))]
    cycle = ends[-1] if ends else 0.0
    if not any(shown) or cycle <= 0.0:
        return None
    begin, length = _longest([duration for duration, _ in phases], shown)
    moment = (begin + min(length / 2, lead_s) - arrival_s) % cycle
    phase = next((i for i, end in enumerate(ends) if moment < end - 5e-4), 0)
    return phase, round((ends[phase] - moment) % cycle or cycle, 3)


def _longest(durations: Sequence[float], shown: Sequence[bool]) -> tuple[float, float]:
    """Beginning and length of the longest run of phases shown, round the end of the cycle [s]."""
    count = len(durations)
    if all(shown):
        return 0.0, math.fsum(durations)
    runs: list[tuple[float, float]] = []
    for first in range(count):
        if shown[first] and not shown[first - 1]:
            last = next(i for i in range(first, first + count) if not shown[i % count])
            length = math.fsum(durations[i % count] for i in range(first, last))
            runs.append((math.fsum(durations[:first]), length))
    return max(runs, key=lambda run: run[1])


def _program(network: Network, light: str, signal: Signal) -> Any:
    """The program of a light; raises NetworkError unless it runs by the clock, phase by phase."""
    programs = list(network.net.getTLS(light).getPrograms().values())
    if not programs:
        raise NetworkError(
            f"{network.file}: signal {signal}: traffic light {light!r} has no program"
        )
    kind = str(programs[0]._type)
    if kind != "static" or any(phase.next for phase in programs[0].getPhases()):
        said = kind if kind != "static" else "not a plain cycle"
        raise NetworkError(
            f"{network.file}: signal {signal}: traffic light {light!r} is {said}; only static "
            "programs can be timed (netconvert --tls.default-type static)"
        )
    return programs[0]
