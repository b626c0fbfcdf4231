"""The record of an episode.

To measure something new in every episode: a field of ``Episode``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from cavsumo.agents.base import Forecast
from cavsumo.assertions.base import INVALID, Judgement
from cavsumo.assertions.contacts import ContactMonitor
from cavsumo.assertions.criticality_monitor import CriticalityMonitor, Extremes
from cavsumo.assertions.naturalness import Naturalness
from cavsumo.assertions.validity import Breach
from cavsumo.model.bodies import Action
from cavsumo.model.carriageway import Start
from cavsumo.model.departures import Demand
from cavsumo.model.snapshot import Snapshot
from cavsumo.simulation.ego_progress import EgoProgress
from cavsumo.simulation.tester_course import TesterCourse

# The actions of all agents at one timestep: for each agent those of its bodies.
Joint = Sequence[Sequence[Action]]


@dataclass
class Episode:
    """The record of an episode, during and after it.

    ``seen``: all snapshots; frames and actions only where they are kept; ``drives``: whether the
    ego steers itself; ``forecast``: what the testers said of it beforehand; ``notes``: what the
    first agent noted of it for its searcher; ``starts``: where they started, and ``waited``: where
    they were while the ego entered; ``departures``: of the background, None where they were not
    recorded or do not tell all of it; ``short``: what a human driver was short of in a test that
    was held or unfair, as ``foresight.human_short``; ``course``: of the tester that was met, else
    of the nearest.
    """

    judgement: Judgement
    verdicts: Mapping[str, str] = field(default_factory=dict)
    steps: int = 0
    time: float = 0.0
    max_decel: float = 0.0
    contacts: ContactMonitor = field(default_factory=ContactMonitor)
    naturalness: Naturalness = field(default_factory=Naturalness)
    breach: Breach | None = None
    invalid: bool = False
    blame: str = ""
    rms_acceleration: float = 0.0
    criticality: CriticalityMonitor = field(default_factory=CriticalityMonitor)
    extremes: Extremes = field(default_factory=Extremes)
    progress: EgoProgress = field(default_factory=EgoProgress)
    cost: float = 0.0
    reward: float = 0.0
    sumo_collisions: frozenset[tuple[str, str]] = frozenset()
    teleports: int = 0
    emergency_stops: int = 0
    seen: list[Snapshot] = field(default_factory=list, compare=False, repr=False)
    frames: list[Snapshot] = field(default_factory=list)
    actions: list[Joint] = field(default_factory=list)
    starts: tuple[Start, ...] = ()
    waited: tuple[Start, ...] = ()
    departures: Demand | None = None
    drives: bool = False
    forecast: Forecast | None = None
    short: float | None = None
    notes: str = ""
    course: TesterCourse | None = None

    @property
    def outcome(self) -> str:
        """The outcome: the verdict, unless a tester broke the rules of the world before it."""
        return INVALID if self.invalid else self.judgement.verdict
