"""Failures made as small as they can be, kept as one file, and played against other egos."""

from __future__ import annotations

import dataclasses
import json
import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from inline import cavsumo as command
from support import ROOT

import cavsumo
from cavsumo.batch.located import located
from cavsumo.batch.replay import Record, recorded
from cavsumo.errors import Exit, InputError
from cavsumo.kept.candidate import as_recorded
from cavsumo.kept.minimising import Minimised, Replays, minimised
from cavsumo.kept.reductions import Reductions
from cavsumo.kept.regression import ELSEWHERE, FAILS, PASSES, STANDS, OtherEgo, regressions
from cavsumo.model.departures import Trip
from cavsumo.results.reading import read_rows

CAREFUL = {"actionStepLength": 0, "sigma": 0}  # SUMO's driver, deciding in every timestep
EGOS = """
from cavsumo.egos import Acceleration

class StopsForEver:
    def act(self, snapshot):
        return Acceleration(-9.0 if snapshot.time > 1.0 else 0.0)

class Moody:
    drives = [0]
    def reset(self, scene):
        self.drives[0] += 1
    def act(self, snapshot):
        return Acceleration(1.0 if self.drives[0] % 2 else 0.5)
"""


def failure(csv_file: Path) -> Record:
    """The first preventable failure of a batch."""
    rows = [row for row in read_rows(csv_file) if row["outcome"] == "violated"]
    run = next(int(row["run"]) for row in rows if row["avoidable"] == "1")
    return located(recorded(csv_file, run))


@pytest.fixture(scope="module")
def found(found_failure: Path, inline: None) -> Minimised:
    """A failure at the Helsinki crossing, made small."""
    return minimised(failure(found_failure), located)


@pytest.fixture(scope="module")
def kept(found_failure: Path, tmp_path_factory: pytest.TempPathFactory, inline: None) -> Path:
    """A folder with that failure, as it was (all.cavtest) and small (small.cavtest)."""
    folder = tmp_path_factory.mktemp("kept")
    run = str(failure(found_failure).run)
    words = str(found_failure), run, "-o"
    assert command(folder, "keep", *words, "all.cavtest").returncode == 0
    page = "--html", "page.html"
    done = command(folder, "minimise", *words, "small.cavtest", *page)
    assert done.returncode == 0, done.stderr
    assert "hits it at" in done.stdout
    assert "no background, motion in" in done.stdout
    (folder / "others.py").write_text(EGOS)
    return folder


def test_it_fails_the_same_way(found: Minimised) -> None:
    """The same assertion and pair, preventable as before; with one tester and nobody else."""
    before, after = found.before.row, found.after.row
    for column in ("outcome", "assertion", "avoidable", "reference", "seed", "breach"):
        assert before[column] == after[column], column
    assert after["tester"] == "tester0"
    assert found.last.numbers == (int(before["tester"].removeprefix("tester")),)
    assert (len(found.first.motions), len(found.last.motions)) == (3, 1)
    assert len(found.first.background) > 5
    assert not found.last.background
    assert found.last.segments <= 2
    assert found.last.cut > 0
    assert float(after["time_s"]) < float(before["time_s"])


def test_it_is_one_minimal(found: Minimised) -> None:
    """None of all single reductions fails the same way, tried once more by force."""
    assert found.complete
    there = dataclasses.replace(found.before, row=found.before.row)
    with _replays(there) as replays:
        assert replays.fails_the_same(found.first)
        assert replays.fails_the_same(found.last)
        reductions = Reductions(replays.fixed, replays.met, replays.tracks)
        assert replays.fails_the_same(next(reductions.all(found.first)))
        assert not [one for one in reductions.all(found.last) if replays.fails_the_same(one)]


def test_the_same_every_time_and_bounded(found: Minimised, found_failure: Path) -> None:
    """The same candidate after as many replays; fewer replays give what was found until then."""
    record = failure(found_failure)
    assert minimised(record, located).last == found.last
    less = minimised(record, located, 2)
    assert (less.replays, less.complete) == (2, False)
    assert len(less.last.motions) == 1
    assert less.last.cost > found.last.cost


def test_planted_bodies_go(found_failure: Path) -> None:
    """Fifty vehicles on a road that nobody of the test uses."""
    record = failure(found_failure)
    assert record.trace is not None
    departures = record.trace.head["departures"]
    trips = [Trip(*trip) for trip in departures["trips"]]
    last = trips[-1]
    planted = [
        last._replace(id=f"planted{i}", time=round(60.0 + i, 3), edges=tuple(last.edges))
        for i in range(50)
    ]
    told = {**departures, "trips": [*trips, *planted]}
    trace = dataclasses.replace(record.trace, head={**record.trace.head, "departures": told})
    small = minimised(dataclasses.replace(record, trace=trace), located)
    assert len(small.first.background) >= 50
    assert not small.last.background


def test_a_vehicle_for_which_the_ego_braked_goes(tmp_path: Path) -> None:
    """Without it the ego comes earlier, and so does the other tester."""
    words = ["run", "--net", "crossing", "--kind", "car", "--agent", "timing"]
    done = command(tmp_path, *words, "--runs", "8", "-o", "cars.csv", "-q", "--exit-zero")
    assert done.returncode == 0, done.stderr
    small = minimised(failure(tmp_path / "cars.csv"), located)
    assert len(small.first.motions) == 3
    assert (len(small.last.motions), small.last.background) == (1, ())


def test_what_cannot_be_made_smaller_is_refused(
    found_failure: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No failure, no trace, an ego that decides otherwise the next time; nothing is written."""
    held = next(row["run"] for row in read_rows(found_failure) if row["outcome"] == "held")
    done = command(tmp_path, "minimise", str(found_failure), held, "-o", "a.cavtest")
    assert (done.returncode, "is no failure: held" in done.stderr) == (Exit.USAGE, True)
    bare = dataclasses.replace(failure(found_failure), trace=None)
    with pytest.raises(InputError, match="no trace with actions was kept"):
        minimised(bare, located)
    (tmp_path / "others.py").write_text(EGOS)
    batch = ["run", "--ego", "others:Moody", "--agent", "timing", "--runs", "30", "-o", "m.csv"]
    done = command(tmp_path, *batch, "-q", "--exit-zero", "--trace", "all")
    assert done.returncode == 0, done.stderr
    runs = [row["run"] for row in read_rows(tmp_path / "m.csv") if row["outcome"] == "violated"]
    said = [
        command(tmp_path, "minimise", "m.csv", run, "--trust", "-o", "a.cavtest").stderr
        for run in runs[:2]
    ]
    assert any("is another episode when it is played back" in words for words in said), said
    untrusted = command(tmp_path, "minimise", "m.csv", runs[0], "-o", "b.cavtest")
    assert "import 'others:Moody'; --trust allows it" in untrusted.stderr
    assert not (tmp_path / "b.cavtest").exists()


def test_an_unpreventable_failure_is_kept_too(networks: dict[str, Path], tmp_path: Path) -> None:
    """Its grade comes from the reference driver, who is not asked when it is played back."""
    words = ["run", "--net", str(networks["pedestrians"]), "--ego", "constant", "--runs", "12"]
    command(tmp_path, *words, "--agent", "proximity", "-o", "a.csv", "-q", "--exit-zero")
    rows = [row for row in read_rows(tmp_path / "a.csv") if row["avoidable"] == "0"]
    done = command(tmp_path, "keep", "a.csv", rows[0]["run"], "-o", "a.cavtest")
    assert done.returncode == 0, done.stderr
    small = command(tmp_path, "minimise", "a.cavtest", "--replays", "5")
    assert "would not have avoided it" in small.stdout


def test_a_file_is_enough_to_play_it(kept: Path, tmp_path: Path) -> None:
    """Elsewhere, without results, network and routes; compared bit for bit."""
    for name in ("all.cavtest", "small.cavtest"):
        (tmp_path / name).write_bytes((kept / name).read_bytes())
        done = command(tmp_path, "replay", name, "--html", "page.html")
        assert done.returncode == 0, done.stderr
        assert done.stdout.endswith("the same, played back\n")
        shown = command(tmp_path, "replay", name, "--recorded")
        assert "as recorded" in shown.stdout
    assert "no run is named" in command(tmp_path, "replay", "small.cavtest", "1").stderr


def test_bytes_depend_on_the_content_alone(kept: Path, found_failure: Path) -> None:
    """Written once more, they are the same; the members have no time and no owner."""
    before = (kept / "small.cavtest").read_bytes()
    run = str(failure(found_failure).run)
    command(kept, "minimise", str(found_failure), run, "-q", "-o", "small.cavtest")
    assert (kept / "small.cavtest").read_bytes() == before
    with zipfile.ZipFile(kept / "small.cavtest") as archive:
        names = archive.namelist()
        assert names == sorted(names)
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        about = json.loads(archive.read("test.json"))
        assert b"iframe" in archive.read("page.html")
    assert about["made_smaller"]["after"] == {"testers": 1, "background": 0, "segments": 1}
    assert about["sentence"].startswith("On crossing, a pedestrian at (")


def test_its_network_is_in_it(networks: dict[str, Path], tmp_path: Path) -> None:
    """It is played where the network is gone; a damaged copy is refused in one sentence."""
    shutil.copy(networks["crossing"], tmp_path / "mine.net.xml")
    words = ["run", "--net", "mine.net.xml", "--runs", "2", "-o", "a.csv", "-q", "--exit-zero"]
    assert command(tmp_path, *words).returncode == 0
    assert command(tmp_path, "keep", "a.csv", "1", "-o", "a.cavtest").returncode == 0
    (tmp_path / "mine.net.xml").unlink()
    shutil.rmtree(tmp_path / "a")
    with (
        zipfile.ZipFile(tmp_path / "a.cavtest") as archive,
        zipfile.ZipFile(tmp_path / "bad.cavtest", "w") as copy,
    ):
        for name in archive.namelist():
            data = archive.read(name)
            copy.writestr(name, data[:-9] if name.startswith("inputs/") else data)
    done = command(tmp_path, "replay", "bad.cavtest")
    assert (done.returncode, done.stderr.count("\n")) == (Exit.USAGE, 1)
    assert "is damaged" in done.stderr
    assert command(tmp_path, "replay", "a.cavtest").returncode == 0


def test_in_python(kept: Path, found_failure: Path, tmp_path: Path) -> None:
    """An episode of results or of a file is made small, told, kept and shown."""
    episode = cavsumo.load(kept / "all.cavtest")
    assert isinstance(episode, cavsumo.RecordedEpisode)
    small = episode.minimised()
    assert small.complete
    assert small.sentence in repr(small)
    assert small.episode.row["outcome"] == "violated"
    small.keep(tmp_path / "a.cavtest")
    small.html(tmp_path / "a.html")
    assert (tmp_path / "a.html").read_text("utf-8").count("<iframe") == 2
    again = cavsumo.minimise(found_failure, episode.run, output=tmp_path / "b.cavtest")
    assert again.sentence == small.sentence
    again.episode.keep(tmp_path / "c.cavtest")
    found = cavsumo.regress([tmp_path / "c.cavtest", tmp_path / "b.cavtest"], "sumo")
    assert list(found["status"]) == [FAILS, FAILS]
    with pytest.raises(InputError, match="which run"):
        cavsumo.minimise(found_failure)


@pytest.mark.parametrize("testers", ["recorded", "policy"])
def test_other_egos(kept: Path, testers: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The ego that failed, a mended one, and one that stops for ever, which is not mended."""
    monkeypatch.chdir(kept)
    monkeypatch.syspath_prepend(str(kept))
    files = [Path("all.cavtest"), Path("small.cavtest")]

    def statuses(name: str, **params: object) -> list[str]:
        ego = OtherEgo(name, params, testers)
        return [one.status for one in regressions(files, ego)]

    assert statuses("sumo") == [FAILS, FAILS]
    assert PASSES in statuses("sumo", **CAREFUL)
    assert FAILS not in statuses("sumo", **CAREFUL)
    assert statuses("others:StopsForEver") == [STANDS, STANDS]
    assert {*statuses("constant", speed=1.0)} <= {ELSEWHERE, PASSES}


def test_a_tester_as_policy_waits_for_the_ego(found: Minimised) -> None:
    """Held at a timestep until the ego has come as far; others go on by the clock."""
    from cavsumo.agents.recorded import Hold, RecordedAgent
    from cavsumo.model.bodies import Action

    agent = RecordedAgent()
    acts = [[Action(float(i), 0.0)] for i in range(4)]
    agent.remember({"starts": (), "waited": (), "actions": acts, "holds": [Hold(2, 10.0)]})
    agent.check_memory(agent.recall(), 1)
    agent.owned, along = (0,), iter([0.0, 0.0, 5.0, 9.9, 10.0, 12.0, 14.0])

    class Scene:
        def ego_progress(self, snapshot: float) -> float:
            return snapshot

    agent.reset(Scene(), (0,), None)  # type: ignore[arg-type]
    said = [agent.choose_action(where)[0].throttle for where in along]  # type: ignore[arg-type]
    assert said == [0.0, 1.0, 0.0, 0.0, 2.0, 3.0, 0.0]


def test_the_command_for_continuous_integration(kept: Path) -> None:
    """Exit statuses, JUnit, the same for any number of jobs; nothing is played in vain."""
    files = "all.cavtest", "small.cavtest"
    failed = command(kept, "regress", *files, "--ego", "sumo", "--junit", "a.xml")
    assert failed.returncode == Exit.VIOLATED
    assert failed.stdout.endswith("still fails: 2\n")
    suite = ET.parse(kept / "a.xml").getroot()[0]
    assert (suite.get("tests"), suite.get("failures")) == ("2", "2")
    assert [case.get("name") for case in suite] == list(files)
    again = command(kept, "regress", *files, "--ego", "sumo", "-j", "2", "-q")
    assert again.stdout == "still fails: 2\n"
    careful = [f"--ego-param={key}={value}" for key, value in CAREFUL.items()]
    mended = command(kept, "regress", "small.cavtest", "--ego", "sumo", *careful)
    assert (mended.returncode, PASSES in mended.stdout) == (Exit.OK, True)
    stops = command(kept, "regress", *files, "--ego", "others:StopsForEver")
    assert (stops.returncode, stops.stdout.count(STANDS)) == (Exit.VIOLATED, 3)
    slow = ["--ego", "constant", "--ego-param", "speed=0.5"]
    strict = command(kept, "regress", "small.cavtest", *slow, "--strict")
    assert (strict.returncode, ELSEWHERE in strict.stdout) == (Exit.VIOLATED, True)
    assert command(kept, "regress", "small.cavtest", *slow).returncode == Exit.OK
    gone = command(kept, "regress", *files, "--ego", "nowhere:Ego")
    assert (gone.returncode, gone.stderr.count("\n")) == (Exit.USAGE, 1)


def test_what_was_recorded_is_a_candidate(found_failure: Path) -> None:
    """Played from it, an episode is the recorded one."""
    record = failure(found_failure)
    assert record.trace is not None
    recording = record.trace.recording()
    with _replays(record) as replays:
        again = as_recorded(recording).recorded(replays.fixed)
        assert [*again.actions] == [*recording.actions]
        assert tuple(again.starts) == tuple(recording.starts)
        assert again.departures == recording.departures


def _replays(record: Record) -> Replays:
    """Replays of candidates of an episode."""
    from cavsumo.batch.playback import for_playback

    return Replays(located(for_playback(record)), record)


PYTEST = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--cavsumo-ego", "sumo"], "1 failed"),
        (["--cavsumo-ego", "sumo", "--cavsumo-ego-param", "actionStepLength=0"], "1 passed"),
        ([], "1 skipped"),
    ],
)
def test_the_plugin_of_pytest(kept: Path, words: list[str], said: str) -> None:
    """A kept test is a test; its failure is told in words."""
    line = [sys.executable, "-m", "pytest", "-p", "cavsumo.kept.pytest_plugin", "-q"]
    done = subprocess.run(
        [*line, "-p", "no:cacheprovider", *words, "small.cavtest"],
        cwd=kept,
        env=os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert said in done.stdout, done.stdout + done.stderr
    if "failed" in said:
        assert "still fails: reaction-zone was violated" in done.stdout
        assert "Traceback" not in done.stdout


@pytest.mark.parametrize(
    ("inside", "said"),
    [
        ('<poi id="p" x="0" y="0" imgFile="x"/>', "its network holds 'poi'"),
        ('<param key="device.ssm.FILE" value="x"/>', "the parameter 'device.ssm.FILE'"),
    ],
)
def test_sumo_writes_nothing_for_a_stranger(
    networks: dict[str, Path], tmp_path: Path, inside: str, said: str
) -> None:
    """A network that names a file is refused; with --trust it is played."""
    text = networks["pedestrians"].read_text(encoding="utf-8")
    assert text.count("</net>") == 1
    (tmp_path / "mine.net.xml").write_text(text.replace("</net>", f"{inside}</net>"))
    words = ["run", "--net", "mine.net.xml", "--runs", "1", "--trace", "all", "-o", "a.csv", "-q"]
    assert command(tmp_path, *words, "--exit-zero").returncode == 0
    assert command(tmp_path, "keep", "a.csv", "0", "-o", "a.cavtest").returncode == 0
    done = command(tmp_path, "replay", "a.cavtest")
    assert (done.returncode, said in done.stderr) == (Exit.USAGE, True), done.stderr
    assert command(tmp_path, "replay", "a.cavtest", "--trust").returncode == 0
