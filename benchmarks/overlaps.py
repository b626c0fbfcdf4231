"""Testers in other bodies, and off every lane and pavement before they step out.

    python benchmarks/overlaps.py [--net FILE ...] [--agent NAME ...] [--runs 20] [--seed 77]

Three pedestrians of each agent, ``runs`` episodes an agent and network, in the network's own
traffic or, where it has none, in traffic drawn for it. Every frame up to a violation is looked at.
An episode counts where a tester is deeper in another body than docs/fairness.md
allows. It moved, or started there: in another tester, in somebody on foot, in a vehicle that stands
or drives. Or it stood, and somebody of the traffic came ``onto it``. ``any`` is one of the
first four, ``unsaid`` those of them in whose row ``breach`` is empty. ``off`` is the share of the
testers' frames before their centre first comes onto a carriageway in which it is more than 0.5 m
off any lane, pavement, crossing or walking area.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import shapely

from cavsumo.assertions.contacts import STANDING_MPS, depth
from cavsumo.assertions.validity import DEEP_M
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import prepare
from cavsumo.errors import CavsumoError
from cavsumo.model.bodies import WALKING
from cavsumo.model.scenario import BatchPlan, plan_from
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.drawing.surfaces import walking_areas
from cavsumo.network.reader import Network, lane_areas, read_network
from cavsumo.simulation import loop

ROOT = Path(__file__).resolve().parent.parent
NETS = [ROOT / "networks" / "junction.net.xml"]
AGENTS = ["programmed-random", "proximity", "timing", "election", "expectiminimax"]
TRAFFIC = 6.0  # where a network has no traffic of its own
OFF_M = 0.5
TESTERS, WALKERS, STANDING, DRIVING = MOVED = ("testers", "on foot", "standing", "driving")
ONTO = "onto it"
IN = (*MOVED, ONTO)


def main() -> None:
    """Play, look and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--net", type=Path, action="append")
    parser.add_argument("--agent", action="append")
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--seed", type=int, default=77)
    options = parser.parse_args()
    print(
        f"{'network':12} {'agent':18} episodes  any  unsaid  {'  '.join(IN)}  invalid  tests"
        "  errors      off"
    )
    for net in options.net or NETS:
        for agent in options.agent or AGENTS:
            plan = planned(net, agent, options.runs, options.seed)
            print(f"{net.name.split('.')[0]:12} {agent:18} {line(plan, surface(net))}", flush=True)


def planned(net: Path, agent: str, runs: int, seed: int) -> BatchPlan:
    """The plan of one agent on one network."""
    given = {"net": net, "agents": (agent,), "runs": runs, "seed": seed, "reference": "none"}
    plan = plan_from(given, "overlaps")
    return plan if plan.scenario.routes else plan_from(given | {"traffic": TRAFFIC}, "overlaps")


def surface(net: Path) -> shapely.Geometry:
    """All that one can walk or drive on."""
    network: Network = read_network(net)
    inside = [e for kind in ("internal", "crossing") for e in network.inside(kind)]
    lanes = [lane for edge in (*network.edges, *inside) for lane in edge.getLanes()]
    # The outline of a walking area may cut itself.
    areas = shapely.make_valid([*lane_areas(lanes), *walking_areas(network)])
    found = shapely.union_all(areas)
    shapely.prepare(found)
    return found


def line(plan: BatchPlan, ground: shapely.Geometry) -> str:
    """The figures of a batch."""
    counts, frames, off = Counter[str](), 0, 0
    with EpisodeRunner(prepare(plan)) as runner:
        for run in range(plan.runs):
            one = job(plan, run)
            try:
                episode = loop.play(runner.setup, runner.agents_of(one), one.seed, record=True)
            except CavsumoError as error:
                counts["errors"] += 1
                print(f"run {run}: {error}")
                continue
            end = episode.judgement.violation_time
            shown = [f for f in episode.frames if end is None or f.time <= end]
            deep = overlaps(shown)
            counts.update(deep)
            counts["any"] += bool(deep - {ONTO})
            counts["unsaid"] += bool(deep - {ONTO}) and episode.breach is None
            counts["invalid"] += episode.invalid
            counts["tests"] += episode.judgement.triggered and not episode.invalid
            for i in range(len(shown[0].testers)):
                before = before_the_road([f.testers[i] for f in shown], runner)
                frames += len(before)
                off += strayed(before, ground)
    figures = "  ".join(f"{counts[name]:{len(name)}}" for name in IN)
    return (
        f"{plan.runs:8}  {counts['any']:3}  {counts['unsaid']:6}  {figures}  {counts['invalid']:7}"
        f"  {counts['tests']:5}  {counts['errors']:6}  {off:4}/{frames} {off / max(1, frames):6.1%}"
    )


def overlaps(frames: Sequence[Snapshot]) -> set[str]:
    """In whom testers got too deep in an episode."""
    found, before = set(), frames[0]
    touching: set[tuple[str, str]] = set()
    for frame in frames:
        pairs = {(one.id, other.id): (one, other) for one, other in too_deep(frame)}
        for key in pairs.keys() - touching:
            found.add(sort(*pairs[key], before, frame))
        touching, before = set(pairs), frame
    return found


def too_deep(frame: Snapshot) -> Iterator[tuple[BodyState, BodyState]]:
    """The testers that are too deep in others."""
    others = frame.background
    for i, one in enumerate(frame.testers):
        for other in (*frame.testers[:i], *others):
            reach = one.body.kind.reach + other.body.kind.reach
            if math.hypot(one.x - other.x, one.y - other.y) > reach:
                continue
            walking = [state.body.kind.name in WALKING for state in (one, other)]
            if depth(one.box, other.box) > DEEP_M[sum(walking)]:
                yield one, other


def sort(one: BodyState, other: BodyState, before: Snapshot, frame: Snapshot) -> str:
    """How a tester came into another body."""
    if other in frame.testers:
        return TESTERS
    if before is not frame and one in before.testers:
        return ONTO
    if other.body.kind.name in WALKING:
        return WALKERS
    return STANDING if other.v <= STANDING_MPS else DRIVING


def before_the_road(states: Sequence[BodyState], runner: EpisodeRunner) -> Sequence[BodyState]:
    """The states of one tester before its centre is on a carriageway."""
    roads = runner.setup.site.roads
    for i, state in enumerate(states):
        if roads.contains(state.x, state.y):
            return states[:i]
    return states


def strayed(states: Sequence[BodyState], ground: shapely.Geometry) -> int:
    """In how many of them it is off everything."""
    if not states:
        return 0
    points = shapely.points([(s.x, s.y) for s in states])
    return int((shapely.distance(ground, points) > OFF_M).sum())


if __name__ == "__main__":
    main()
