"""Episodes per second of cavsumo against a bare libsumo loop that makes the same calls.

    python benchmarks/throughput.py [--net FILE] [--testers N] [--agent NAME] [--episodes N]

Both play the same episodes, one after the other in one process, so that the noise of the machine
hits both alike: trust the ratio, not the seconds. The bare loop restarts SUMO, inserts the same
bodies, moves the testers along the recorded trajectories (moveToXY, setSpeed), steps, and reads
position, angle and speed of every other body and SUMO's events; it draws nothing, decides nothing,
checks nothing.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import libsumo

from cavsumo.commands import prepare
from cavsumo.jobs import job
from cavsumo.scenario import plan_from
from cavsumo.simulator import play
from cavsumo.theatre import Theatre
from cavsumo.world import KEEP_EXACT, MATCH_M, UNSAFE, World, to_sumo

ROOT = Path(__file__).resolve().parent.parent


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--net", default=str(ROOT / "networks" / "crossing.net.xml"))
    parser.add_argument("--testers", type=int, default=3)
    parser.add_argument("--agent", default="timing")
    parser.add_argument("--episodes", type=int, default=60)
    options = parser.parse_args()
    plan = plan_from(
        {"net": options.net, "testers": options.testers, "agents": (options.agent,)}, "benchmark"
    )
    with Theatre(plan, prepare(plan)) as theatre:
        full, bare, steps, ratios = compare(theatre, options.episodes)
        shares = parts(theatre, options.episodes)
    print(
        f"{plan.scenario.name}, {options.agent}, {options.testers} testers, "
        f"{options.episodes} episodes, {steps} steps"
    )
    print(f"bare libsumo  {options.episodes / bare:7.1f} episodes/s  {steps / bare:8.0f} steps/s")
    print(f"cavsumo       {options.episodes / full:7.1f} episodes/s  {steps / full:8.0f} steps/s")
    low, middle, high = statistics.quantiles(ratios, n=4)
    print(
        f"ratio         {bare / full:7.3f}   (an episode: median {middle:.3f}, "
        f"quartiles {low:.3f} and {high:.3f})"
    )
    for name, share in shares:
        print(f"  {name:28} {100 * share:5.1f} %")


def compare(theatre: Theatre, episodes: int) -> tuple[float, float, int, list[float]]:
    """Seconds of cavsumo and of the bare loop for the same episodes, their steps, the ratios.

    Each episode is played three times by each, in turns; the fastest counts, so that what else the
    machine does weighs less.
    """
    full = bare = 0.0
    steps, ratios = 0, []
    for run in range(episodes):
        one = job(theatre.plan, run)
        agents = theatre._cast(one)
        recorded = play(theatre.stage, agents, one.seed, record=True).frames
        tracks = [[to_bare(t) for t in s.testers] for s in recorded]
        del recorded
        ours, theirs = [], []
        for _ in range(3):
            ours.append(seconds(lambda a=agents, s=one.seed: play(theatre.stage, a, s)))
            theirs.append(
                seconds(lambda t=tracks, s=one.seed: bare_loop(theatre.stage.world, s, t))
            )
        full, bare, steps = full + min(ours), bare + min(theirs), steps + len(tracks) - 1
        ratios.append(min(theirs) / min(ours))
    return full, bare, steps, ratios


def seconds(action: Callable[[], Any]) -> float:
    """How long an action takes."""
    begun = time.perf_counter()
    action()
    return time.perf_counter() - begun


def to_bare(state: Any) -> tuple[str, float, float, float, float]:
    """A tester's state as the arguments of moveToXY and setSpeed."""
    return (state.id, *to_sumo(state.x, state.y, state.o, state.body.kind.length), state.v)


def bare_loop(world: World, seed: int, tracks: list[list[Any]]) -> None:
    """The same calls on libsumo, and nothing else."""
    vehicle, person, simulation = libsumo.vehicle, libsumo.person, libsumo.simulation
    move, set_speed = vehicle.moveToXY, vehicle.setSpeed
    libsumo.close()
    libsumo.start(world._command(seed))
    insert(world, tracks[0])
    mine = {"ego", *(t[0] for t in tracks[0])}
    for step, track in enumerate(tracks):
        if step == 1:
            for name, *_ in track:
                vehicle.setSpeedMode(name, UNSAFE)
        for name, x, y, angle, v in track:
            move(name, "", -1, x, y, angle, KEEP_EXACT, MATCH_M)
            set_speed(name, v)
        libsumo.simulationStep()
        for domain in (vehicle, person):
            position, get_angle, speed = domain.getPosition, domain.getAngle, domain.getSpeed
            for name in domain.getIDList():
                if name not in mine or name == "ego":
                    position(name)
                    get_angle(name)
                    speed(name)
        simulation.getCollisions()
        simulation.getStartingTeleportIDList()
        simulation.getEmergencyStoppingVehiclesIDList()


def insert(world: World, track: list[Any]) -> None:
    """The ego and the testers, as the world inserts them."""
    route = world.site.route
    libsumo.route.add("cavsumo_ego", list(route.edges))
    libsumo.vehicle.add(
        "ego",
        "cavsumo_ego",
        typeID="cavsumo_ego",
        departLane=str(route.lane),
        departPos=f"{route.depart_m}",
        departSpeed="max",
        arrivalPos=f"{route.arrive_m}",
    )
    libsumo.route.add("cavsumo_tester", [route.edges[0]])
    for name, *_ in track:
        libsumo.vehicle.add(name, "cavsumo_tester", typeID="cavsumo_pedestrian")


def parts(theatre: Theatre, episodes: int) -> list[tuple[str, float]]:
    """Share of each part in an episode, with a clock around each call."""
    spent: dict[str, float] = defaultdict(float)

    def clocked(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*args: Any, **kwargs: Any) -> Any:
            begun = time.perf_counter()
            try:
                return function(*args, **kwargs)
            finally:
                spent[name] += time.perf_counter() - begun

        return timed

    import cavsumo.simulator as simulator

    world, stage = theatre.stage.world, theatre.stage
    originals = (simulator._observe, simulator._moved)
    world.reset = clocked("restart SUMO", world.reset)  # type: ignore[method-assign]
    world._snapshot = clocked("read SUMO", world._snapshot)  # type: ignore[method-assign]
    world._place = clocked("tell SUMO (moveToXY)", world._place)  # type: ignore[method-assign]
    world.step = clocked("step SUMO", world.step)  # type: ignore[method-assign]
    simulator._observe = clocked("contacts and assertions", simulator._observe)
    simulator._moved = clocked("kinematics", simulator._moved)
    begun = time.perf_counter()
    for run in range(episodes):
        one = job(theatre.plan, run)
        agents = theatre._cast(one)
        for agent in agents:
            agent.choose_action = clocked("agents", type(agent).choose_action.__get__(agent))  # type: ignore[method-assign]
        play(stage, agents, one.seed)
    total = time.perf_counter() - begun
    simulator._observe, simulator._moved = originals
    spent["step SUMO"] -= spent["read SUMO"] + spent["tell SUMO (moveToXY)"]
    spent["the rest"] = total - sum(spent.values())
    return sorted(((k, v / total) for k, v in spent.items()), key=lambda kv: -kv[1])


if __name__ == "__main__":
    main()
