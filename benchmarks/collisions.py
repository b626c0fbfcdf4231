"""SUMO's own collision reports beside the contacts that cavsumo computes, from real episodes.

    python benchmarks/collisions.py [--episodes N] [--examples]
    python benchmarks/collisions.py --show NETWORK AGENT EGO SHOWN RUN

Plays every network with the agents, egos and embodiments below. After each timestep it compares,
for every pair that involves the ego or a tester, whether the true boxes touch and whether SUMO
reported the pair; where the two differ it notes why, by what SUMO believes: the lanes on which it
has the two bodies and the stretch of the lane that each of them takes there. The same SUMO gives
the same output. docs/collisions.md explains it.

SUMO sometimes dies of a moved person, so each setup is played in a process of its own; an episode
that killed it is counted and left out.
"""

from __future__ import annotations

import argparse
import itertools
import math
import multiprocessing
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import libsumo

from cavsumo.assertions.base import ASSERTIONS, Assertion
from cavsumo.assertions.contacts import Contact
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import prepare
from cavsumo.model.geometry import gap, in_frame, overlap
from cavsumo.model.scenario import plan_from
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.simulation.loop import play

ROOT = Path(__file__).resolve().parent.parent
NETWORKS = ("crossing", "junction", "pedestrians")
AGENTS = ("proximity", "timing")
EGOS = ("sumo", "constant")
# How SUMO is shown a tester: the embodiment, and the width that it is given [m].
SHOWN_AS = {
    "narrow-vehicle": ("vehicle", 0.05),
    "wide-vehicle": ("vehicle", 0.875),
    "narrow-person": ("person", 0.05),
}
SHOWN = tuple(SHOWN_AS)
PAIRS = ("ego x tester", "ego x background", "tester x background", "tester x tester")
VERDICTS = ("both", "ours", "SUMO")
Pair = tuple[str, str]


class Setup(NamedTuple):
    """What is played."""

    network: str
    agent: str
    ego: str
    shown: str  # one of SHOWN_AS


class Report(NamedTuple):
    """One of SUMO's reports."""

    type: str
    collider: str


class Place(NamedTuple):
    """Where SUMO has a body: its lane (empty off the lanes) and the stretch it takes there [m]."""

    person: bool
    lane: str
    back: float
    front: float

    @property
    def inside(self) -> bool:
        """Whether it is inside a junction."""
        return self.lane.startswith(":")

    def meets(self, other: Place) -> bool:
        """Whether the stretches of two bodies on the same lane meet."""
        return self.back <= other.front and other.back <= self.front


@dataclass(frozen=True)
class Sighting:
    """A pair in one timestep, touching or reported.

    Attributes:
        pair: the two ids, in alphabetical order.
        touching: whether the true boxes touch.
        reported: the type of SUMO's report, empty for none.
        gap: between the true boxes [m].
        why: the class of the difference, empty when the two agree.
        words: the two bodies in words.
    """

    time: float
    pair: Pair
    touching: bool
    reported: str
    gap: float
    why: str
    words: tuple[str, ...]

    @property
    def verdict(self) -> str:
        """Who saw it: both, ours or SUMO."""
        return "both" if self.touching and self.reported else "ours" if self.touching else "SUMO"


@ASSERTIONS.register("watch-collisions")
class Watch(Assertion):
    """Asserts nothing and never decides: compares the boxes with SUMO's reports."""

    name: ClassVar[str] = "watch-collisions"

    def reset(self, scene: Scene) -> None:
        super().reset(scene)
        self.sightings: list[Sighting] = []
        self._before: dict[str, str] = {}  # the lanes of the vehicles a timestep ago
        self._reported: dict[Pair, Report] = {}

    def observe(self, snapshot: Snapshot, contacts: Sequence[Contact]) -> None:
        reported = {
            pair_of(c.collider, c.victim): Report(c.type, c.collider)
            for c in libsumo.simulation.getCollisions()
        }
        if snapshot.step > 0:  # SUMO's first steps, in which the ego entered, are not counted
            bodies = {b.id: b for b in (snapshot.ego, *snapshot.testers, *snapshot.background)}
            pairs = {p for p in reported if any(map(is_judged, p)) and bodies.keys() >= set(p)}
            for one in (snapshot.ego, *snapshot.testers):
                pairs |= {pair_of(one.id, o.id) for o in bodies.values() if touch(one, o)}
            for pair in sorted(pairs):
                self._note(snapshot, bodies[pair[0]], bodies[pair[1]], reported.get(pair))
        self._reported = reported
        vehicle = libsumo.vehicle
        self._before = {i: vehicle.getLaneID(i) for i in vehicle.getIDList()}

    def _note(self, snapshot: Snapshot, a: BodyState, b: BodyState, report: Report | None) -> None:
        """Write down a pair that touches or is reported."""
        touching, places = touch(a, b), (place_of(a.id), place_of(b.id))
        why = ""
        if touching and report is None:
            why = self._why_only_ours(a.id, b.id, *places)
        elif report is not None and not touching:
            why = self._why_only_sumo(a, b, *places, report)
        words = [in_words(body, place) for body, place in zip((a, b), places, strict=True)]
        kind = report.type if report else ""
        self.sightings.append(
            Sighting(
                snapshot.time, (a.id, b.id), touching, kind, gap(a.box, b.box), why, tuple(words)
            )
        )

    def _why_only_ours(self, a: str, b: str, p: Place, q: Place) -> str:
        """Why SUMO does not report two bodies that touch."""
        if p.person and q.person:
            return "two persons"
        if p.person or q.person:
            return "person on this lane" if p.lane == q.lane else "person on another lane"
        if not (p.lane and q.lane):
            return "off the lanes"
        if p.lane != q.lane:
            return "junction" if p.inside and q.inside else "different lanes"
        if not p.meets(q):
            return "laid along the lane"
        others = {i for i, lane in self._before.items() if lane == p.lane}
        others.update(libsumo.lane.getLastStepVehicleIDs(p.lane))
        if others - {a, b}:
            return "not neighbours"
        together = self._before.get(a) == self._before.get(b) == p.lane
        return "unexplained" if together else "a step late"

    def _why_only_sumo(self, a: BodyState, b: BodyState, p: Place, q: Place, report: Report) -> str:
        """Why SUMO reports two bodies that are apart."""
        if p.person or q.person:
            return "person"
        if p.lane != q.lane:
            if p.inside and q.inside:
                return "junction"
            lanes = self._before.get(a.id, ""), self._before.get(b.id, "")
            together = lanes[0] == lanes[1] != "" or all(lane.startswith(":") for lane in lanes)
            return "a step late" if together else "unexplained"
        if p.meets(q):
            side_by_side = apart_across(a, b, p.lane, p.front)
            return "side by side" if side_by_side else "laid along the lane"
        collider, victim = (p, q) if report.collider == a.id else (q, p)
        if collider.back > victim.front:
            return "already past"
        return "a step late" if pair_of(a.id, b.id) in self._reported else "unexplained"


def apart_across(a: BodyState, b: BodyState, lane: str, at: float) -> bool:
    """Whether the true boxes are apart across the lane."""
    length = libsumo.lane.getLength(lane)
    angle = math.radians(90.0 - libsumo.lane.getAngle(lane, min(length, max(0.0, at))))
    boxes = [in_frame(body.box, a.x, a.y, angle) for body in (a, b)]
    half = sum(
        (box.length * abs(math.sin(box.heading)) + box.width * abs(math.cos(box.heading))) / 2
        for box in boxes
    )
    return abs(boxes[0].y - boxes[1].y) > half


def place_of(body: str) -> Place:
    """Where SUMO has a body."""
    person = body in libsumo.person.getIDList()
    domain: Any = libsumo.person if person else libsumo.vehicle
    front = domain.getLanePosition(body)
    return Place(person, domain.getLaneID(body), front - domain.getLength(body), front)


def in_words(body: BodyState, place: Place) -> str:
    """A body and where SUMO has it."""
    at = f"{place.lane} {place.back:.2f}..{place.front:.2f}" if place.lane else "off the lanes"
    who = f"{body.id}, a person," if place.person else body.id
    return (
        f"{who} at ({body.x:.2f}, {body.y:.2f}), {math.degrees(body.o):.0f} deg, "
        f"{body.v:.1f} m/s; for SUMO {at}"
    )


def pair_of(a: str, b: str) -> Pair:
    """Two ids in alphabetical order."""
    return (a, b) if a < b else (b, a)


def touch(a: BodyState, b: BodyState) -> bool:
    """Whether two different bodies' true boxes touch."""
    reach = a.body.kind.reach + b.body.kind.reach
    return a is not b and math.hypot(a.x - b.x, a.y - b.y) <= reach and overlap(a.box, b.box)


def is_judged(body: str) -> bool:
    """Whether cavsumo itself judges the contacts of a body."""
    return body == "ego" or body.startswith("tester")


def sort_of(pair: Pair) -> str:
    """The sort of a pair, one of PAIRS."""
    sorts = ["ego" if i == "ego" else "tester" if is_judged(i) else "background" for i in pair]
    return " x ".join(sorted(sorts, key=("ego", "tester", "background").index))


# Playing


def episodes(setup: Setup, count: int) -> Iterator[list[Sighting] | None]:
    """What was seen in each episode; None for one in which SUMO died."""
    context = multiprocessing.get_context("spawn")
    run = 0
    while run < count:
        ours, theirs = context.Pipe(duplex=False)
        process = context.Process(target=serve, args=(theirs, setup, run, count), daemon=True)
        process.start()
        theirs.close()
        try:
            while run < count:
                yield ours.recv()
                run += 1
        except EOFError:
            process.join()
            if process.exitcode is not None and process.exitcode > 0:
                raise SystemExit(f"{setup}: run {run} failed, see above") from None
            yield None
            run += 1
        process.join()


def serve(pipe: Connection, setup: Setup, first: int, count: int) -> None:
    """Play the episodes of one setup from a given one on."""
    embodiment, width = SHOWN_AS[setup.shown]
    plan = plan_from(
        {
            "net": str(ROOT / "networks" / f"{setup.network}.net.xml"),
            "agents": (setup.agent,),
            "ego": setup.ego,
            "embodiment": embodiment,
            "sumo_width": width,
            "assertions": (Watch.name,),
        },
        "benchmark",
    )
    with EpisodeRunner(prepare(plan)) as runner:
        watch = runner.setup.assertions[0]
        assert isinstance(watch, Watch)
        agents = runner.prepared.cast.agents(setup.agent)
        for run in range(first, count):
            play(runner.setup, agents, job(plan, run).seed)
            pipe.send(watch.sightings)


# Counting


class Tally:
    """The counts over all episodes."""

    def __init__(self) -> None:
        self.episodes = self.died = 0
        self.steps: Counter[tuple[str, str, str, str]] = Counter()
        self.encounters: Counter[tuple[str, str, str, str]] = Counter()
        self.classes: dict[tuple[str, str, str], Counter[Any]] = defaultdict(Counter)
        self.largest: dict[tuple[str, str, str], float] = defaultdict(float)
        self.examples: dict[tuple[str, str, str], tuple[Setup, int, Sighting]] = {}
        self.leads: dict[str, list[float]] = defaultdict(list)

    def add(self, setup: Setup, run: int, sightings: list[Sighting]) -> None:
        """Count an episode."""
        self.episodes += 1
        by_pair: dict[Pair, list[Sighting]] = defaultdict(list)
        for sighting in sightings:
            by_pair[sighting.pair].append(sighting)
            self.steps[(setup.shown, setup.ego, sort_of(sighting.pair), sighting.verdict)] += 1
            if sighting.why:
                self._count_class(setup, run, sighting)
        for pair, seen in by_pair.items():
            touched = [s.time for s in seen if s.touching]
            reported = [s.time for s in seen if s.reported]
            verdict = "both" if touched and reported else "ours" if touched else "SUMO"
            self.encounters[(setup.shown, setup.ego, sort_of(pair), verdict)] += 1
            if verdict == "both":
                self.leads[setup.shown].append(touched[0] - reported[0])

    def _count_class(self, setup: Setup, run: int, sighting: Sighting) -> None:
        key = (setup.shown, sighting.verdict, sighting.why)
        self.classes[key][(setup, run, sighting.pair)] += 1
        if key not in self.examples or sighting.gap > self.largest[key]:
            self.examples[key] = (setup, run, sighting)
        self.largest[key] = max(self.largest[key], sighting.gap)


def print_pairs(tally: Tally) -> None:
    """Encounters and timesteps by sort of pair."""
    print(f"{'':52}encounters{'':12}timesteps")
    counted = f"{'both':>6}{'ours':>6}{'SUMO':>6}"
    print(f"{'testers shown as':20}{'ego':10}{'pair':20}{counted}  {counted}")
    for shown, ego, pair in itertools.product(SHOWN, EGOS, PAIRS):
        counts = [
            [table[(shown, ego, pair, verdict)] for verdict in VERDICTS]
            for table in (tally.encounters, tally.steps)
        ]
        print(f"{shown:20}{ego:10}{pair:20}{cells_of(counts)}")
    for shown in SHOWN:
        counts = [
            [sum(n for k, n in table.items() if (k[0], k[3]) == (shown, v)) for v in VERDICTS]
            for table in (tally.encounters, tally.steps)
        ]
        print(f"{shown:20}{'all':10}{'all':20}{cells_of(counts)}")


def cells_of(counts: list[list[int]]) -> str:
    """Two groups of counts as columns."""
    return "  ".join("".join(f"{n:6}" for n in row) for row in counts)


def print_classes(tally: Tally) -> None:
    """Why the two differ: timesteps, encounters, and the most timesteps in one of them."""
    print(" " * 30 + "".join(f"{shown:>20}" for shown in SHOWN))
    print(f"{'only':6}{'because':24}" + f"{'steps':>8}{'enc.':>6}{'most':>6}" * len(SHOWN))
    for verdict, why in sorted({key[1:] for key in tally.classes}):
        cells = ""
        for shown in SHOWN:
            counts = tally.classes.get((shown, verdict, why), Counter())
            cells += f"{counts.total():8}{len(counts):6}{max(counts.values(), default=0):6}"
        print(f"{verdict:6}{why:24}{cells}")


def print_leads(tally: Tally) -> None:
    """How much earlier or later SUMO reports what both see."""
    print(f"{'testers shown as':20}{'both':>6}  SUMO's first report, against the first touch")
    for shown in SHOWN:
        leads = tally.leads[shown] or [0.0]
        early, late = sum(t > 0.01 for t in leads), sum(t < -0.01 for t in leads)
        print(
            f"{shown:20}{len(leads):6}  {early} before (up to {max(leads):.1f} s), "
            f"{len(leads) - early - late} with, {late} after (up to {max(0.0, -min(leads)):.1f} s)"
        )


def print_example(setup: Setup, run: int, sighting: Sighting) -> None:
    """One sighting in words."""
    seen = {"both": "both", "ours": "only ours", "SUMO": "only SUMO"}[sighting.verdict]
    report = f", report {sighting.reported!r}" if sighting.reported else ""
    print(
        f"{setup.network} {setup.agent} {setup.ego}, {setup.shown}: run {run}, "
        f"{sighting.time:.1f} s: {seen}{report}, gap {sighting.gap:.2f} m {sighting.why}"
    )
    for words in sighting.words:
        print(f"    {words}")


def main() -> None:
    """Play, count and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--episodes", type=int, default=15, help="of each setup (default 15)")
    parser.add_argument("--examples", action="store_true", help="print an example of each class")
    parser.add_argument(
        "--show",
        nargs=5,
        metavar=("NETWORK", "AGENT", "EGO", "SHOWN", "RUN"),
        help=f"print one episode, timestep by timestep; SHOWN is one of {SHOWN}",
    )
    options = parser.parse_args()
    if options.show:
        network, agent, ego, shown, run = options.show
        setup = Setup(network, agent, ego, shown)
        *_, last = episodes(setup, int(run) + 1)
        for sighting in last or ():
            print_example(setup, int(run), sighting)
        return
    tally = Tally()
    for what in itertools.product(NETWORKS, AGENTS, EGOS, SHOWN):
        setup = Setup(*what)
        for run, sightings in enumerate(episodes(setup, options.episodes)):
            if sightings is None:
                tally.died += 1
            else:
                tally.add(setup, run, sightings)
    print(f"{tally.episodes} episodes; {tally.died} more in which SUMO died\n")
    print_pairs(tally)
    print()
    print_classes(tally)
    print()
    print_leads(tally)
    if options.examples:
        for key in sorted(tally.examples):
            print()
            print_example(*tally.examples[key])


if __name__ == "__main__":
    main()
