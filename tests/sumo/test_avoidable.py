"""Avoidable or not: scripted episodes in SUMO whose answer is known, batches, replays."""

from __future__ import annotations

import dataclasses
import itertools
import math
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support import prepared_at, rows

from cavsumo.agents.base import Agent
from cavsumo.assertions.contacts import Contact
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.executors import Means
from cavsumo.batch.jobs import job
from cavsumo.cli import main
from cavsumo.cli.commands.run import Manner, run
from cavsumo.egos import make_ego
from cavsumo.egos.base import EGO_KIND, Ego
from cavsumo.egos.reference import REFERENCES
from cavsumo.egos.reference.encounter import encounter
from cavsumo.egos.reference.takeover import Takeover
from cavsumo.model.bodies import PEDESTRIAN, Action, Body
from cavsumo.model.carriageway import Start
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.site import Site
from cavsumo.report.analysis import analyse
from cavsumo.results.columns import COLUMNS
from cavsumo.simulation.avoidability import (
    NOT_MONOTONE,
    Avoidability,
    AvoidabilityCheck,
)
from cavsumo.simulation.loop import EpisodeLoop, play
from cavsumo.simulation.reruns import ContactWatch
from cavsumo.simulation.setup import Setup, make_setup

LANE_Y, SPEED, WALK, DT = -1.825, 8.0, 1.4, 0.1
HALF = 0.328125  # half the length of a pedestrian, half its width is 0.4375 [m]
Staged = Callable[..., tuple[BatchPlan, Site]]
Played = Callable[..., AvoidabilityCheck]


@pytest.fixture
def played(staged: Staged, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Call with a pedestrian's start: it keeps its velocity and meets an ego that keeps its own.

    Returns the episode, ready to be tried again with other drivers.
    """
    open_stages: list[Setup] = []

    def one(
        *starts: Start, ego: Ego | None = None, agent: Agent | None = None, **asserted: Any
    ) -> AvoidabilityCheck:
        asserted = asserted or {"assertions": ["collision"]}
        plan, site = staged("pedestrians", testers=len(starts), end=20.0, **asserted)
        ego = ego or make_ego("constant", {"speed": SPEED})
        monkeypatch.setattr(Site, "draw", lambda *_: starts)
        setup = make_setup(plan.scenario, site, ego)
        open_stages.append(setup)
        agents = [agent or Agent() for _ in setup.teams]
        episode = play(setup, agents, 1, keep=True)
        assert episode.judgement.verdict == "violated"
        return AvoidabilityCheck(setup, agents, 1, False, episode, lambda: None)

    yield one
    for setup in open_stages:
        setup.close()


def judged(retrial: AvoidabilityCheck, name: str) -> Avoidability:
    """The verdict of one reference driver."""
    return retrial.judged(REFERENCES.make(name, {}))


def standing(x: float = 60.0) -> Start:
    """A pedestrian who stands in the ego's lane, facing along it."""
    return Start(x, LANE_Y, 0.0, v=0.0)


def walking_in(seconds: float, x: float = 60.0) -> Start:
    """One who walks north and is in the middle of the lane after so many seconds."""
    return Start(x, LANE_Y - WALK * seconds, math.pi / 2, v=WALK)


def way_to_stop(name: str) -> float:
    """The way from the perception to standstill, in closed form [m]."""
    if name == "ideal":
        return SPEED**2 / 18.0
    if name == "rss":
        return SPEED + SPEED**2 / 8.0
    full = 0.774 * 9.80665
    left = SPEED - 0.3 * full
    return SPEED * 1.75 - full * 0.06 + left**2 / (2.0 * full)


def test_the_last_chance_is_where_the_way_to_stop_ends_at_the_pedestrian(played: Played) -> None:
    """Who stands in the lane can be seen from afar: preventable by all of them."""
    retrial = played(standing())
    hit = retrial.episode.frames[retrial.end]
    for name in REFERENCES:
        found = judged(retrial, name)
        before = retrial.episode.frames[0].ego
        contact = (60.0 - HALF - before.x - before.body.kind.length / 2) / SPEED
        assert found.avoidable is True, name
        assert found.note == ""
        assert found.last_chance is not None
        assert found.last_chance == pytest.approx(contact - way_to_stop(name) / SPEED, abs=2 * DT)
        assert found.margin == pytest.approx(hit.time - found.last_chance)


def test_whoever_steps_out_late_spares_only_the_fastest_driver(played: Played) -> None:
    """Perceived as it leaves the kerb, 1.4 s ahead: enough for full braking, not for a human.

    RSS, which knows no kerbs, calls the situation dangerous while it still walks on the pavement.
    """
    retrial = played(walking_in(7.1))
    seen = {name: judged(retrial, name) for name in REFERENCES}
    assert {name: v.avoidable for name, v in seen.items()} == {
        "ideal": True,
        "human": False,
        "rss": True,
    }
    both = retrial.judged(*(REFERENCES.make(name, {}) for name in ("human", "ideal")))
    assert both == dataclasses.replace(seen["human"], by_ideal=True)
    human = seen["human"]
    assert human.last_chance is not None, "it would have had to know before the kerb"
    end = retrial.episode.frames[retrial.end].time
    kerb = next(f.time for f in retrial.episode.frames if f.testers[0].y > -3.65)
    assert human.last_chance < kerb < end - 0.9


def test_what_jumps_out_at_the_bumper_nobody_prevents(played: Played) -> None:
    """A pedestrian who grows out of the ground under the bumper: no time for any driver."""
    retrial = played(standing(9.0))
    assert retrial.episode.frames[retrial.end].time < 1.0
    assert dataclasses.replace(judged(retrial, "human"), perceived=None) == Avoidability(False)
    assert dataclasses.replace(judged(retrial, "rss"), perceived=None) == Avoidability(False)


def test_every_timestep_by_itself_gives_the_same_last_chance(played: Played) -> None:
    """Takeovers avoid it up to the last chance and not after: the search may assume it here."""
    retrial = played(walking_in(4.7, 40.0))
    found = judged(retrial, "ideal")
    assert found.last_chance is not None
    last = round(found.last_chance / DT)
    ideal = REFERENCES.make("ideal", {})
    steps = range(0, retrial.end, 3)
    assert [retrial._avoided(ideal, k) for k in steps] == [k <= last for k in steps]
    assert NOT_MONOTONE not in found.note


def test_a_stage_may_play_other_episodes_before_the_judgement(played: Played) -> None:
    """A violation is judged by what it was, not by what the assertions say of a later episode."""
    first = played(standing(40.0))
    before = judged(first, "ideal")
    again = AvoidabilityCheck(first.setup, first.agents, 1, False, first.episode, lambda: None)
    assert judged(again, "ideal") == before


def test_who_wanders_about_in_the_lane_is_a_risk_from_the_beginning(played: Played) -> None:
    """In plain view for six seconds, mostly as if to leave the ego's strip in time.

    It walks on a circle of half a metre in the middle of the lane. Once that looks like a collision
    for as long as a driver evaluates it, no human could stop any more.
    """

    class Circling(Agent):
        def choose_action(self, snapshot: Any) -> tuple[Action, ...]:
            return (Action(0.0, 0.6),)

    retrial = played(Start(55.0, LANE_Y - 0.5, 0.0, v=WALK), agent=Circling())
    scene = retrial._scene()
    met = [encounter(scene, f, f.testers[0]) for f in retrial.episode.frames[: retrial.end + 1]]
    assert all(m.in_way for m in met)
    found = judged(retrial, "human")
    assert found.avoidable is True
    assert found.last_chance is not None
    lasts = 1 + max(i for i, m in enumerate(met) if not m.conflict)  # on a course of collision
    assert lasts * DT > found.last_chance
    assert REFERENCES.make("human", {}).perceived(met, DT) == 0


def test_the_testers_do_again_what_they_did(played: Played) -> None:
    """A counterfactual changes the ego only: agents are not asked, and learn nothing."""

    class Counting(Agent):
        calls = 0

        def choose_action(self, snapshot: Any) -> tuple[Action, ...]:
            self.calls += 1
            return (Action(0.0, 0.1),)  # walks on a circle

    agent = Counting()
    retrial = played(standing(40.0), agent=agent)
    asked = agent.calls
    assert judged(retrial, "ideal").avoidable is True
    assert agent.calls == asked == retrial.episode.steps


class Steering(Ego):
    """Drives freely, straight on, and never brakes."""

    depart_speed = SPEED

    def act(self, snapshot: Any) -> Any:
        from cavsumo.egos.base import Drive

        return Drive(0.0, 0.0)


def test_an_ego_that_steers_itself_is_taken_over_on_its_path(played: Played) -> None:
    """The reference drives it by the same kinematics; the last chance is that of the others."""
    retrial = played(standing(), ego=Steering())
    assert retrial.episode.drives
    found = judged(retrial, "ideal")
    contact = retrial.episode.frames[retrial.end].time
    assert found.margin == pytest.approx(way_to_stop("ideal") / SPEED, abs=2 * DT)
    assert (found.avoidable, contact > 5.0) == (True, True)


def test_an_ego_that_is_never_the_same_is_not_judged(played: Played) -> None:
    """Its reruns part from the record, which is said, and no error."""

    class Moody(Ego):
        depart_speed = SPEED
        lives = 0

        def reset(self, scene: Any) -> None:
            self.lives += 1

        def act(self, snapshot: Any) -> Any:
            from cavsumo.egos.base import Acceleration

            return Acceleration(0.01 * self.lives)

    found = judged(played(standing(), ego=Moody()), "human")
    assert found.avoidable is None
    assert found.note == "not judged: the episode again is another one: the ego differs at 0.10 s"


def test_whom_the_original_touched_before_the_takeover_is_not_held_against_the_driver() -> None:
    """Only contacts of the moving ego that begin after it, in the timestep of the takeover none."""
    ego = BodyState(Body("ego", EGO_KIND), 0.0, 0.0, SPEED, 0.0)
    other = BodyState(Body("tester0", PEDESTRIAN), 2.5, 0.0, 0.0, 0.0)
    verdicts = []
    for step in (3, 7, 8):
        watch = ContactWatch(7)
        watch.reset(None)  # type: ignore[arg-type]  # of pedestrians it asks no scene
        seen = Snapshot(step, step * DT, ego, 0.0, (other,))
        watch.observe(seen, [Contact(step * DT, ego, other)])
        verdicts.append(watch.judgement.verdict)
    assert verdicts == ["not_triggered", "not_triggered", "violated"]


def test_an_earlier_contact_leaves_a_later_failure_preventable(
    played: Played, controller: Callable[..., str]
) -> None:
    """An ego that drove through somebody before, whom the assertion does not mean, can still stop.

    Takeovers after that contact avoid the violation, as they do where there was none.
    """
    source = """
        from cavsumo.assertions.base import VIOLATED, Assertion, Judgement

        class Second(Assertion):
            def observe(self, snapshot, contacts):
                for contact in contacts:
                    if contact.a is snapshot.ego and contact.b.id == "tester1":
                        self.judgement = Judgement(
                            self.name, VIOLATED, "tester1", 0.0, contact.time,
                            impact_speed=contact.closing_speed,
                        )
                        self.decided = True
        """
    name = controller(textwrap.dedent(source), "second_one")
    starts = standing(25.0), standing()
    found = judged(played(*starts, assertions=[f"{name}:Second"]), "ideal")
    assert found.avoidable is True
    assert found.margin == pytest.approx(way_to_stop("ideal") / SPEED, abs=2 * DT)
    assert found.note == ""


def test_sumos_driver_obeys_from_the_takeover_on(staged: Staged) -> None:
    """It drives as it likes before, reaction time and all; then every timestep is commanded."""
    plan, site = staged("pedestrians", testers=1)
    setup = make_setup(plan.scenario, site)
    ego = Takeover(setup.ego, drives=False)
    ego.take_over(REFERENCES.make("ideal", {}), 23)
    with_it = dataclasses.replace(setup, ego=ego, assertions=(ContactWatch(),))
    try:
        alone = _speeds(EpisodeLoop(setup, [Agent()], 5), 40)
        taken = _speeds(EpisodeLoop(with_it, [Agent()], 5), 40)
    finally:
        setup.close()
    assert taken[:24] == alone[:24]
    assert min(alone[24:]) > 5.0
    lost = [a - b for a, b in itertools.pairwise(taken[23:31])]
    assert lost == pytest.approx([0.9] * 7)
    assert taken[-1] == 0.0


def _speeds(loop: EpisodeLoop, steps: int) -> list[float]:
    """The ego's speed at each timestep."""
    speeds = [loop.snapshot.ego.v]
    for _ in range(steps):
        loop.step()
        speeds.append(loop.snapshot.ego.v)
    return speeds


def test_a_standing_ego_is_not_judged(played: Played) -> None:
    """References only brake, so nothing is said of a violation by standing."""
    retrial = played(standing())
    stood = [
        f._replace(ego=f.ego._replace(v=0.0)) if f.step == retrial.end else f
        for f in retrial.episode.frames
    ]
    episode = dataclasses.replace(retrial.episode, frames=stood)
    object.__setattr__(retrial, "episode", episode)
    assert judged(retrial, "human").note.startswith("not judged: the ego stood")


def test_of_several_assertions_the_one_violated_first_is_asked_again(played: Played) -> None:
    """TTC below 3 s is avoided by braking just before; the others still show what they saw."""
    retrial = played(standing(), assertions=["collision", "red-light", "ttc"])
    assert retrial.episode.verdicts["collision"] == "violated"
    assert retrial.broken.name == retrial.episode.judgement.assertion == "ttc"
    for name, least, most in (("ideal", 0.05, 0.35), ("human", 1.15, 2.0)):
        found = judged(retrial, name)
        assert (found.avoidable, found.note) == (True, ""), name
        assert found.margin is not None
        assert least < found.margin < most, name


def test_a_formula_that_names_nobody_is_asked_again_to_the_end(played: Played) -> None:
    """To keep 5 m from a pedestrian the brake must come a way to stop earlier."""
    retrial = played(standing(), formulas={"apart": "always (gap_m > 5)"})
    assert retrial.episode.judgement.tester == ""
    found = judged(retrial, "ideal")
    assert (found.avoidable, found.note) == (True, "")
    assert found.margin == pytest.approx(way_to_stop("ideal") / SPEED, abs=2 * DT)


def test_a_formula_broken_from_the_start_nobody_keeps(played: Played) -> None:
    """Its first timestep belongs to the original."""
    retrial = played(standing(), formulas={"slow": "always (speed_mps < 5)"})
    assert dataclasses.replace(judged(retrial, "ideal"), perceived=None) == Avoidability(False)


# In batches

BATCH: dict[str, Any] = {
    "ego": "constant",
    "ego_params": {"speed": 7.0},
    "agents": ["timing"],
    "routes": "none",
    "runs": 4,
    "reference": "ideal",
}


@pytest.fixture(scope="module")
def batch(networks: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four episodes of an ego that never brakes, on the straight road."""
    file = tmp_path_factory.mktemp("batch") / "results.csv"
    settings = BATCH | {"net": networks["pedestrians"]}
    run(settings, file, Means(), Manner(quiet=True, exit_zero=True))
    return file


def test_an_ideal_driver_prevents_what_an_ego_without_brakes_does(batch: Path) -> None:
    """Tests of the reaction zone are those that an immediate brake passes."""
    failures = [row for row in rows(batch) if row["outcome"] == "violated"]
    assert len(failures) >= 3
    assert {row["avoidable"] for row in failures} == {"1"}
    assert {row["avoidable_ideal"] for row in failures} == {"1"}
    for row in failures:
        margin = float(row["violation_time_s"]) - float(row["last_chance_s"])
        assert row["reference"] == "ideal"
        assert float(row["margin_s"]) == pytest.approx(margin, abs=0.002)
        assert 0.0 < margin < 2.0
    for row in rows(batch):
        if row["outcome"] != "violated":
            assert {row["avoidable"], row["last_chance_s"], row["reference"]} == {""}


def test_the_ideal_driver_is_asked_besides_another(staged: Staged, batch: Path) -> None:
    """A batch judged by a human says the same of the ideal driver as one judged by that."""
    plan, site = staged("pedestrians", **BATCH | {"reference": "human"})
    with EpisodeRunner(prepared_at(plan, site)) as runner:
        found = [runner.play(job(plan, run)).outcome.row for run in range(plan.runs)]
    told = ["" if r["avoidable_ideal"] is None else str(r["avoidable_ideal"]) for r in found]
    assert told == [row["avoidable"] for row in rows(batch)]
    assert "1" in told
    assert {r["avoidable"] for r in found} >= {0}


def test_the_verdicts_do_not_depend_on_who_plays(
    batch: Path, networks: dict[str, Path], tmp_path: Path
) -> None:
    """The same rows from two processes."""
    settings = BATCH | {"net": networks["pedestrians"]}
    file = tmp_path / "results.csv"
    run(settings, file, Means(jobs=2), Manner(quiet=True, exit_zero=True))
    assert rows(file) == rows(batch)


def test_a_replay_finds_the_verdict_again(batch: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """From the results and from the trace alone."""
    failure = next(row for row in rows(batch) if row["avoidable"] == "1")
    assert main(["replay", str(batch), failure["run"]]) == 0
    assert main(["replay", str(batch.parent / failure["trace"])]) == 0
    assert capsys.readouterr().out.count(": the same") == 2


def test_a_report_tells_the_share_of_preventable_failures(batch: Path) -> None:
    """Among the failures that were judged."""
    found = analyse([batch]).rates[0]
    assert found.preventable.count == found.preventable.total == found.failures.count
    assert found.preventable.intervals["Wilson"].high == pytest.approx(1.0)


@pytest.mark.parametrize("trace", ["none", "tests"])
def test_no_reference_leaves_the_rest_of_the_row_as_it_is(
    staged: Staged, batch: Path, trace: str
) -> None:
    """The judgement costs nothing when it is off and changes nothing when it is on."""
    plan, site = staged("pedestrians", **{**BATCH, "reference": "none", "trace": trace})
    number = int(next(row for row in rows(batch) if row["avoidable"])["run"])
    with EpisodeRunner(prepared_at(plan, site)) as runner:
        without = runner.play(job(plan, number)).outcome
    beats: list[int] = []
    plan = plan.model_copy(update={"reference": "ideal"})
    with EpisodeRunner(prepared_at(plan, site)) as runner:
        with_it = runner.play(job(plan, number), lambda: beats.append(1)).outcome
    verdicts = {name for name in COLUMNS if name.startswith("avoidable")}
    for name in verdicts | {"reference", "last_chance_s", "margin_s", "wall_s"}:
        with_it.row.pop(name, None)
        without.row.pop(name, None)
    assert with_it.row == without.row
    assert bool(with_it.trace) == bool(without.trace) == (trace == "tests")
    assert 2 <= len(beats) <= 10


def test_the_summary_says_how_many_were_preventable(
    networks: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In the regulation's word, with the driver that is meant."""
    words = ["run", "-n", str(networks["pedestrians"]), "-r", "none", "--ego", "constant"]
    words += ["--runs", "1", "--reference", "human", "-o", str(tmp_path / "r.csv"), "--exit-zero"]
    assert main(words) == 0
    said = capsys.readouterr().out
    row = rows(tmp_path / "r.csv")[0]
    if row["outcome"] == "violated":
        count = int(row["avoidable"])
        many = "1 failure" if count else "0 failures"
        assert f"{many} preventable by a careful human driver (UN R157)" in said
        assert ("apart from that 1 unpreventable" in said) == (count == 0)
    else:
        assert "preventable by" not in said


BLIND = r"""
import json, sys
for line in sys.stdin:
    said = json.loads(line)
    kind = said["type"]
    if kind == "hello":
        print(json.dumps({"type": "hello", "version": 1}), flush=True)
    elif kind == "reset":
        print("begun", file=sys.stderr, flush=True)
        print(json.dumps({"type": "ready"}), flush=True)
    elif kind == "close":
        break
    else:
        print('{"acceleration": 0}', flush=True)
"""


def test_a_program_is_relieved_too(staged: Staged, tmp_path: Path) -> None:
    """It is told to begin anew for each rerun; its log is that of the episode alone."""
    (tmp_path / "blind.py").write_text(BLIND, encoding="utf-8")
    ego = f"exec:{sys.executable} {tmp_path / 'blind.py'}"
    plan, site = staged("pedestrians", **{**BATCH, "ego": ego, "ego_params": {"depart_speed": 7}})
    with EpisodeRunner(prepared_at(plan, site)) as runner:
        runner.try_out()
        outcome = runner.play(job(plan, 0)).outcome
    assert outcome.row["outcome"] == "violated", outcome.row.get("error")
    assert (outcome.row["avoidable"], outcome.row["avoidable_note"]) == (1, "")
    assert outcome.ego_log.count("begun") == 1
