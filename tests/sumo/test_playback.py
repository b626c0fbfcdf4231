"""Episodes played back from what was recorded of them: the same bits, with less, and refused."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from support import benchmark

from cavsumo.agents.recorded import Recorded
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.playback import for_playback, playback_job, recording_of
from cavsumo.batch.prepared import PreparedBatch, prepare
from cavsumo.batch.replay import recorded_alone
from cavsumo.errors import InputError
from cavsumo.model.carriageway import StartRecord
from cavsumo.model.departures import Demand
from cavsumo.model.snapshot import Snapshot
from cavsumo.network.recorded_starts import recorded_start
from cavsumo.results.traces import Trace, trace_of
from cavsumo.simulation.episode import Episode
from cavsumo.simulation.loop import play
from cavsumo.simulation.playback import played_back, recorded
from cavsumo.sumo.recorded_demand import route_file, types_told

SetUp = Callable[..., PreparedBatch]
HEAD = '<routes><vType id="t" vClass="passenger" sigma="0.9" imgFile="x.png"/>'


@dataclasses.dataclass
class Played:
    """An episode and its record."""

    runner: EpisodeRunner
    episode: Episode
    recorded: Recorded

    def again(self, **changed: object) -> Episode:
        """It played back, with a record that is changed."""
        return played_back(self.runner.setup, dataclasses.replace(self.recorded, **changed))


@pytest.fixture
def played(set_up: SetUp) -> Iterator[Callable[..., Played]]:
    """Call with a run, a network's name and settings: that episode, every frame of it kept."""
    open_runners = []

    def one(run: int, name: str = "pedestrians", **settings: object) -> Played:
        runner = EpisodeRunner(set_up(name, **settings))
        open_runners.append(runner)
        own = job(runner.plan, run)
        episode = play(runner.setup, runner.agents_of(own), own.seed, record=True)
        found = recorded(runner.setup, episode, own.seed, episode.departures)
        return Played(runner, episode, found)

    yield one
    for runner in open_runners:
        runner.setup.close()


def background(snapshot: Snapshot) -> dict[str, tuple[float, ...]]:
    """The background by id."""
    return {state.id: state[1:] for state in snapshot.background}


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("crossing", {"routes": "auto"}),
        ("junction", {"kind": "car", "traffic": "8", "agents": ["proximity"], "end": 15.0}),
        ("crossing", {"routes": "auto", "ego": "time-gap", "bodies_per_agent": 3}),
    ],
    ids=["pedestrians", "cars", "one agent with three bodies"],
)
def test_an_episode_is_played_back_bit_by_bit(
    played: Callable[..., Played], name: str, settings: dict[str, object]
) -> None:
    """By its starts, actions and departures, without agents and without the demand."""
    first = played(1, name, **settings)
    again = first.again()
    assert again.frames == first.episode.frames
    assert again.judgement == first.episode.judgement
    assert any(snapshot.background for snapshot in again.frames)
    there = first.recorded.departures
    assert there
    assert len(there.trips) > 2
    assert again.departures == there


def test_testers_that_were_moved_wait_where_they_waited(played: Callable[..., Played]) -> None:
    """Where somebody stands as the ego enters they start elsewhere; until then SUMO saw them."""
    first = played(1, traffic="2,60", end=5.0)
    assert first.episode.waited
    assert len(first.recorded.waited) == len(first.recorded.starts) == 3
    again = first.again()
    assert again.frames == first.episode.frames
    assert again.waited == first.episode.waited


def test_other_actions_make_another_episode(played: Callable[..., Played]) -> None:
    """The control: what is played back is the record."""
    first = played(1, "crossing", routes="auto")
    still = [[action._replace(steering=0.0) for action in one] for one in first.recorded.actions]
    assert first.again(actions=still).frames != first.episode.frames
    x, *place = first.recorded.starts[0]
    moved = [StartRecord(x + 1.0, *place), *first.recorded.starts[1:]]
    assert first.again(starts=moved).frames[0].testers[0].x == x + 1.0


def test_the_background_can_be_played_in_part(played: Callable[..., Played]) -> None:
    """Those who are left depart where, when and as fast as they did; the others are gone."""
    first = played(1, "crossing", routes="auto")
    there = first.recorded.departures
    assert there
    fewer = dataclasses.replace(there, trips=there.trips[::2], walks=there.walks[1:])
    gone = {t.id for t in there.trips[1::2]} | {there.walks[0].id}
    again = first.again(departures=fewer)
    before, after = background(first.episode.frames[0]), background(again.frames[0])
    assert gone & before.keys()
    assert after == {name: state for name, state in before.items() if name not in gone}
    assert not any(gone & background(snapshot).keys() for snapshot in again.frames)
    nobody = first.again(departures=Demand())
    assert not any(snapshot.background for snapshot in nobody.frames)


def test_without_departures_the_scenarios_demand_goes_on(played: Callable[..., Played]) -> None:
    """As reruns need it, which may outlast the episode."""
    first = played(1, "crossing", routes="auto")
    assert first.again(departures=None).frames == first.episode.frames


def test_starts_of_another_site_are_refused(set_up: SetUp, played: Callable[..., Played]) -> None:
    """The number of a place is no place: the edges must agree."""
    start = played(0, "crossing").recorded.starts[0]
    for site in (set_up("junction").site, set_up("crossing", kind="car").site):
        with pytest.raises(InputError, match="another one here"):
            recorded_start(site, start)
    with pytest.raises(InputError, match="another one here"):
        recorded_start(set_up("crossing").site, start._replace(place=-1))
    here = recorded_start(set_up("crossing").site, start)
    assert (here.x, here.y, here.o, here.walk) == (start.x, start.y, start.o, start.edges)


# From a trace


@pytest.fixture(scope="module")
def trace_file(set_up: SetUp, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The trace of an episode with traffic."""
    file = tmp_path_factory.mktemp("trace") / "run000001.jsonl.gz"
    with EpisodeRunner(set_up("crossing", routes="auto", trace="all")) as runner:
        file.write_bytes(runner.play(job(runner.plan, 1)).outcome.trace)
    return file


def test_a_trace_is_played_back_without_agent_and_demand(trace_file: Path) -> None:
    """Its plan names neither; the frames are the same, and so is what is recorded again."""
    record = for_playback(recorded_alone(trace_file, anew=False))
    scenario = record.plan.scenario
    assert (scenario.routes, scenario.traffic, record.plan.known) == (None, None, None)
    assert record.plan.agents == ("playback=recorded",)
    assert not any(name.endswith(".rou.xml") for name in record.origin["sha256"])
    with EpisodeRunner(prepare(record.plan)) as runner:
        again = trace_of(runner.play(playback_job(record)).outcome)
    assert again
    assert record.trace
    assert again.frames == record.trace.frames
    for part in ("starts", "waited", "departures", "approaches", "bodies"):
        assert again.head[part] == record.trace.head[part]


def test_the_actions_of_format_1_are_computed(trace_file: Path) -> None:
    """It holds none; those that lead from frame to frame come near, and the starts are drawn."""
    record = recorded_alone(trace_file)
    assert record.trace
    exact = recording_of(record, record.trace)
    frames = [{k: v for k, v in f.items() if k != "actions"} for f in record.trace.frames]
    old = Trace({**record.trace.head, "format": "cavsumo-trace-1"}, frames)
    computed = recording_of(record, old)
    assert (computed.starts, computed.departures) == ((), None)
    assert len(computed.actions) == len(frames) - 1
    pairs = zip(exact.actions, computed.actions, frames, strict=False)
    for one, near, frame in pairs:
        for a, b, state in zip(one, near, frame["testers"].values(), strict=True):
            if state[2] > 0.1 and 0.0 < state[2] + a.throttle * 0.1 < 1.4:
                assert b == pytest.approx(a, abs=1e-6)
    with pytest.raises(InputError, match="format 1, without actions"):
        for_playback(dataclasses.replace(record, trace=old))


def test_the_benchmark_finds_no_difference(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """At its smallest size, with the demand that draws most; it finds one that is made."""
    playback = benchmark("playback")
    words = ["playback.py", "--runs", "1", "--batch", "pedestrians, flows"]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit) as done:
        playback.main()
    assert done.value.code == 0
    all_of_it = capsys.readouterr().out.splitlines()[-2].split()
    assert (all_of_it[0], all_of_it[1], all_of_it[-1]) == ("all", "1", "1")
    assert int(all_of_it[3]) > 0
    monkeypatch.setattr(playback, "is_same", lambda *_: False)
    with pytest.raises(SystemExit) as done:
        playback.main()
    assert done.value.code == 1


# Demands


@pytest.mark.parametrize(
    "inner",
    [
        '<vehicle id="a" depart="0"><route edges="e"/><stop lane="e_0" duration="3"/></vehicle>',
        '<vehicle id="a" depart="0" arrivalPos="3"><route edges="e"/></vehicle>',
        '<person id="a" depart="0"><ride from="e" to="e"/></person>',
        '<person id="a" depart="0"><walk edges="e" speed="2"/></person>',
        '<person id="a" depart="0"><stop edge="e" duration="3"/></person>',
        '<vType id="u"><param key="has.ssm.device" value="true"/></vType>',
        '<containerFlow id="c" begin="0" end="9" number="1"/>',
        '<include href="other.xml"/>',
        "<vehicle",
    ],
)
def test_a_demand_that_departures_do_not_tell(tmp_path: Path, inner: str) -> None:
    """Stops, rides, ends, own speeds, devices: nothing is recorded, the route file is needed."""
    file = tmp_path / "r.rou.xml"
    file.write_text(f"{HEAD}{inner}</routes>", encoding="utf-8")
    assert types_told(file, ()) is None


def test_a_demand_that_departures_tell(tmp_path: Path, routes: dict[str, Path]) -> None:
    """Its types without what only the viewer reads; additional files may let nobody in."""
    plain, more = tmp_path / "r.rou.xml", tmp_path / "more.add.xml"
    plain.write_text(f"{HEAD}<flow id='f' begin='0' end='9' from='e' to='e'/></routes>")
    more.write_text("<additional><tlLogic id='x'/></additional>")
    assert types_told(plain, (more,)) == {"t": {"vClass": "passenger", "sigma": "0.9"}}
    more.write_text("<additional><trip id='x' depart='0' from='e' to='e'/></additional>")
    assert types_told(plain, (more,)) is None
    assert types_told(None, ()) == {}
    for file in routes.values():
        assert types_told(file, ()) == {"background_car": {"vClass": "passenger"}}


def test_a_demand_with_stops_is_not_recorded(
    set_up: SetUp, played: Callable[..., Played], tmp_path: Path
) -> None:
    """The episode is played back with its route file, and that is bit by bit the same too."""
    file = tmp_path / "stops.rou.xml"
    stop = '<stop lane="westbound_1" endPos="50" duration="5"/>'
    car = f'<vehicle id="a" depart="0"><route edges="westbound"/>{stop}</vehicle>'
    file.write_text(f"<routes>{car}</routes>", encoding="utf-8")
    first = played(0, routes=str(file))
    assert first.recorded.departures is None
    assert any(snapshot.background for snapshot in first.episode.frames)
    assert first.again().frames == first.episode.frames


def test_what_is_written_for_sumo_is_escaped() -> None:
    """Names are data: they come from traces."""
    text = route_file(Demand(types={'"/><x a="': {"vClass": "<&"}}))
    assert "<x" not in text
    assert "&lt;&amp;" in text
