"""Episodes per second of cavsumo against a bare libsumo loop that makes the same calls.

    python benchmarks/throughput.py [--net FILE] [--testers N] [--agent NAME] [--episodes N]
                                    [--cars N]

Both play the same episodes, one after the other in one process, so that the noise of the machine
hits both alike: trust the ratio, not the seconds. The bare loop restarts SUMO, inserts the same
bodies, moves the testers along the recorded trajectories (moveToXY, setSpeed), steps, and reads
position, angle and speed of every other body and SUMO's events; it draws nothing, decides nothing,
checks nothing. The ratio a timestep leaves out the restart, up to the ego's entering, on both
sides. ``--cars`` adds cars that wander over the network's own edges.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree

import libsumo

from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import prepare
from cavsumo.model.scenario import plan_from
from cavsumo.network.reader import read_network
from cavsumo.simulation import loop
from cavsumo.simulation.loop import EpisodeLoop
from cavsumo.sumo.moved_bodies import KEEP_EXACT, MATCH_M, UNSAFE, MovedBodies
from cavsumo.sumo.poses import to_sumo
from cavsumo.sumo.world import World

ROOT = Path(__file__).resolve().parent.parent


SPREAD_S, WANDER = 15.0, 40  # when the added cars depart, and over how many edges they drive


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--net", default=str(ROOT / "networks" / "crossing.net.xml"))
    parser.add_argument("--testers", type=int, default=3)
    parser.add_argument("--agent", default="timing")
    parser.add_argument("--episodes", type=int, default=60)
    parser.add_argument("--cars", type=int, default=0, help="cars more than in the demand")
    options = parser.parse_args()
    given = {"net": options.net, "testers": options.testers, "agents": (options.agent,)}
    with TemporaryDirectory() as folder:
        if options.cars:
            demand = plan_from(given, "benchmark").scenario.routes
            given["routes"] = str(wanderers(options.net, demand, options.cars, Path(folder)))
        plan = plan_from(given, "benchmark")
        with EpisodeRunner(prepare(plan)) as runner:
            spent = compare(runner, options.episodes)
            shares = parts(runner, options.episodes)
    print(
        f"{plan.scenario.name}, {options.agent}, {options.testers} testers, "
        f"{options.episodes} episodes, {spent.steps} steps, "
        f"{statistics.median(spent.present):g} background bodies (median)"
    )
    spent.show(options.episodes)
    for name, share in shares:
        print(f"  {name:28} {100 * share:5.1f} %")


@dataclass
class Spent:
    """Seconds, restarts included and alone, of cavsumo (ours) and the bare loop (bare)."""

    ours: float = 0.0
    bare: float = 0.0
    our_restarts: float = 0.0
    bare_restarts: float = 0.0
    steps: int = 0
    ratios: list[float] = field(default_factory=list)
    present: list[int] = field(default_factory=list)

    def show(self, episodes: int) -> None:
        """Print the rates and the ratios."""
        for name, seconds in (("bare libsumo", self.bare), ("cavsumo", self.ours)):
            rates = f"{episodes / seconds:7.1f} episodes/s  {self.steps / seconds:8.0f} steps/s"
            print(f"{name:13} {rates}")
        low, middle, high = statistics.quantiles(self.ratios, n=4)
        print(
            f"ratio         {self.bare / self.ours:7.3f}   (an episode: median {middle:.3f}, "
            f"quartiles {low:.3f} and {high:.3f})"
        )
        bare, ours = self.bare - self.bare_restarts, self.ours - self.our_restarts
        us = 1e6 / self.steps
        print(
            f"a timestep    {bare / ours:7.3f}   (bare {us * bare:.0f} us, cavsumo {us * ours:.0f} "
            "us, restarts excluded)"
        )


def wanderers(net: str, demand: Path | None, cars: int, folder: Path) -> Path:
    """A demand with so many cars more, which drive at random over the network's edges."""
    random = Random(1)
    root = ElementTree.Element("routes")
    if demand is not None:
        root = ElementTree.parse(demand).getroot()
    edges = [e for e in read_network(Path(net)).net.getEdges() if e.allows("passenger")]
    for i in range(cars):
        route = [random.choice(edges)]
        while len(route) < WANDER:
            ways = [e for e in route[-1].getAllowedOutgoing("passenger") if e in edges]
            if not ways:
                break
            route.append(random.choice(ways))
        depart = f"{SPREAD_S * i / cars:.1f}"
        lane = {"departLane": "best", "departPos": "random_free", "departSpeed": "max"}
        car = ElementTree.SubElement(root, "vehicle", {"id": f"car{i}", "depart": depart} | lane)
        ElementTree.SubElement(car, "route", {"edges": " ".join(e.getID() for e in route)})
    root[:] = sorted(root, key=lambda element: float(element.get("depart", "-1")))
    ElementTree.ElementTree(root).write(folder / "cars.rou.xml")
    return folder / "cars.rou.xml"


def compare(runner: EpisodeRunner, episodes: int) -> Spent:
    """What cavsumo and the bare loop need for the same episodes.

    Each episode is played three times by each, in turns; the fastest counts, so that what else the
    machine does weighs less.
    """
    spent = Spent()
    world = runner.setup.world
    for run in range(episodes):
        one = job(runner.plan, run)
        agents = runner.agents_of(one)
        recorded = loop.play(runner.setup, agents, one.seed, record=True).frames
        tracks = [[to_bare(t) for t in s.testers] for s in recorded]
        spent.present += [len(s.raw_background) for s in recorded]
        del recorded
        ours, theirs = [], []
        for _ in range(3):
            ours.append(our_seconds(runner, agents, one.seed))
            begun = time.process_time()
            restarted = bare_loop(world, one.seed, tracks)
            theirs.append((time.process_time() - begun, restarted - begun))
        spent.steps += len(tracks) - 1
        spent.ours, spent.our_restarts = (
            spent.ours + min(ours)[0],
            spent.our_restarts + min(ours)[1],
        )
        spent.bare += min(theirs)[0]
        spent.bare_restarts += min(theirs)[1]
        spent.ratios.append(min(theirs)[0] / min(ours)[0])
    return spent


def our_seconds(runner: EpisodeRunner, agents: list[Any], seed: int) -> tuple[float, float]:
    """How long cavsumo plays an episode, and how long of that it restarts."""
    restart, ended = loop.started, 0.0

    def clocked(*args: Any) -> Any:
        nonlocal ended
        result = restart(*args)
        ended = time.process_time()
        return result

    loop.started = clocked
    begun = time.process_time()
    loop.play(runner.setup, agents, seed)
    whole = time.process_time() - begun
    loop.started = restart
    return whole, ended - begun


def to_bare(state: Any) -> tuple[str, float, float, float, float]:
    """A tester's state as the arguments of moveToXY and setSpeed."""
    return (state.id, *to_sumo(state.x, state.y, state.o, state.body.kind.length), state.v)


def bare_loop(world: World, seed: int, tracks: list[list[Any]]) -> float:
    """The same calls on libsumo, and nothing else; the time at which the ego had entered."""
    restarted = 0.0
    vehicle, person, simulation = libsumo.vehicle, libsumo.person, libsumo.simulation
    move, set_speed = vehicle.moveToXY, vehicle.setSpeed
    libsumo.close()
    simulations = world.simulations
    libsumo.start(simulations.command(seed, simulations.routes))
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
        if step == 0:
            restarted = time.process_time()
    return restarted


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


def parts(runner: EpisodeRunner, episodes: int) -> list[tuple[str, float]]:
    """Share of each part in an episode, with a clock around each call."""
    spent: dict[str, float] = defaultdict(float)

    def clocked(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*args: Any, **kwargs: Any) -> Any:
            begun = time.process_time()
            try:
                return function(*args, **kwargs)
            finally:
                spent[name] += time.process_time() - begun

        return timed

    world, setup = runner.setup.world, runner.setup
    originals = (EpisodeLoop._observe, loop.moved, MovedBodies.place)
    world.reset = clocked("restart SUMO", world.reset)  # type: ignore[method-assign]
    world._snapshot = clocked("read SUMO", world._snapshot)  # type: ignore[method-assign]
    place = clocked("tell SUMO (moveToXY)", MovedBodies.place)
    MovedBodies.place = place  # type: ignore[method-assign]
    world.step = clocked("step SUMO", world.step)  # type: ignore[method-assign]
    observe = clocked("contacts and assertions", EpisodeLoop._observe)
    EpisodeLoop._observe = observe  # type: ignore[method-assign]
    loop.moved = clocked("kinematics", loop.moved)
    begun = time.process_time()
    for run in range(episodes):
        one = job(runner.plan, run)
        agents = runner.agents_of(one)
        for agent in agents:
            agent.choose_action = clocked("agents", type(agent).choose_action.__get__(agent))  # type: ignore[method-assign]
        loop.play(setup, agents, one.seed)
    total = time.process_time() - begun
    EpisodeLoop._observe, loop.moved, MovedBodies.place = originals  # type: ignore[method-assign]
    spent["step SUMO"] -= spent["read SUMO"] + spent["tell SUMO (moveToXY)"]
    spent["the rest"] = total - sum(spent.values())
    return sorted(((k, v / total) for k, v in spent.items()), key=lambda kv: -kv[1])


if __name__ == "__main__":
    main()
