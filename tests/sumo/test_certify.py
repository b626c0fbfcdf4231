"""Certificates: which test is played again, over which seeds and egos, and what that proves."""

from __future__ import annotations

import dataclasses
import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support import ROOT, content, rows

from cavsumo.batch.certify.certificate import as_json, certified, rounded_down, sentences
from cavsumo.batch.certify.ego_list import opponents
from cavsumo.batch.certify.tested_policy import Subject, of_policy, of_run, settings_of
from cavsumo.batch.certify.used_seeds import SUMO_SEEDS, fresh_seed, used
from cavsumo.batch.ended import Ended
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import prepare
from cavsumo.batch.replay import recorded
from cavsumo.batch.tally import Tally
from cavsumo.cli import main
from cavsumo.errors import Exit, InputError
from cavsumo.model.kinematics import wrap
from cavsumo.model.scenario import BatchPlan, Params, Scenario, plan_from
from cavsumo.model.seeds import episode_seed
from cavsumo.model.study import overruled
from cavsumo.results.reading import HEADER
from cavsumo.results.recorded_plan import recorded_plan
from cavsumo.results.rows import row_line
from cavsumo.results.statistics import lower_bound
from cavsumo.results.traces import Trace, trace_of

LEARNT = 5  # the third episode of the learner in the results
# An ego that fails in every episode whose seed is odd.
MOODY = """
class Moody:
    depart_speed = 8.0

    def reset(self, scene):
        if scene.seed % 2:
            raise RuntimeError("not today")

    def act(self, snapshot):
        from cavsumo.egos import Acceleration
        return Acceleration(0.0)
"""


@pytest.fixture(scope="module")
def found(networks: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a small batch: two agents, one of which learns, each with a parameter."""
    file = tmp_path_factory.mktemp("found") / "found.csv"
    words = f"run -n {networks['pedestrians']} -r none -o {file} -q --exit-zero --trace all -e 15"
    words += " --testers 2 --ego constant --agent late=timing --agent q-learning --runs 3"
    assert main([*words.split(), "--param", "late.aim=0.9", "--param", "epsilon=0.5"]) == Exit.OK
    return file


@pytest.fixture
def cheap(found: Path) -> Callable[..., list[dict[str, str]]]:
    """Call with words behind ``cavsumo certify RESULTS``: the rows of each ego."""

    def called(*words: str, status: int = Exit.OK, output: Path) -> list[dict[str, str]]:
        done = main(["certify", str(found), *words, "-q", "-o", str(output), "--exit-zero"])
        assert done == status
        return rows(output.with_name(f"{output.stem}-constant.csv"))

    return called


def plan_of(subject: Subject, found: Path, **settings: Any) -> BatchPlan:
    """The plan that certifies a test against the ego of the results."""
    plan, manifest = recorded_plan(found)
    own = {"ego": plan.scenario.ego} | settings
    return plan_from(overruled(settings_of(subject, manifest, 3, 77), own), "test")


def run_of(found: Path, run: int, *, kept: bool = True, open_loop: bool = False) -> Subject:
    """The test of a run."""
    return of_run(recorded(found, run), {}, kept=kept, open_loop=open_loop)


def traced(plan: BatchPlan, run: int, seed: int | None = None) -> Trace:
    """An episode of a plan, played with a seed of its own or another one."""
    again = dataclasses.replace(job(plan, run), record=True)
    if seed is not None:
        again = dataclasses.replace(again, seed=seed)
    with EpisodeRunner(prepare(plan)) as runner:
        found = trace_of(runner.play(again).outcome)
    assert found is not None
    return found


# What is played


def test_a_run_keeps_its_agent_what_it_knew_and_its_starts(found: Path) -> None:
    """Its label, its own parameters, the weights before it; only chance is drawn anew."""
    plain, learner = run_of(found, 2), run_of(found, LEARNT)
    before = recorded(found, LEARNT)
    assert before.trace is not None
    assert plain.agent == "late=timing"
    assert plain.params["aim"] == 0.9
    assert learner.params["epsilon"] == 0.5
    assert plain.known == {}
    assert learner.known == {"q-learning": tuple(before.trace.head["memory"])}
    assert learner.known["q-learning"][0]["episodes"] == 2
    assert plain.starts_seed == int(recorded(found, 2).row["seed"])
    assert run_of(found, 2, kept=False).starts_seed is None
    first = traced(plan_of(learner, found), 1)
    assert first.frames[0]["testers"] == before.trace.frames[0]["testers"]
    assert first.frames[-1] != before.trace.frames[-1]
    fresh = traced(plan_of(run_of(found, LEARNT, kept=False), found), 1)
    assert fresh.frames[0]["testers"] != before.trace.frames[0]["testers"]


def test_with_its_own_seed_it_is_the_very_episode_that_was_found(found: Path) -> None:
    """So nothing of the policy is lost: what it learned and how it explores are still there."""
    record = recorded(found, LEARNT)
    assert record.trace is not None
    again = traced(plan_of(run_of(found, LEARNT), found), 0, int(record.row["seed"]))
    assert again.frames == record.trace.frames


def test_without_a_trace_the_learner_lives_through_its_episodes(found: Path) -> None:
    """What it knew comes out the same as from the trace."""
    record = dataclasses.replace(recorded(found, LEARNT), trace=None)
    subject = of_run(record, {}, kept=True, open_loop=False)
    assert subject.known == run_of(found, LEARNT).known
    assert subject.starts is None


def test_recorded_actions_lead_to_the_same_trajectories(found: Path) -> None:
    """Open loop: whatever the ego does now, the testers do what they did, bit for bit."""
    record = recorded(found, LEARNT)
    assert record.trace is not None
    subject = run_of(found, LEARNT, open_loop=True)
    assert subject.agent == f"run{LEARNT}=recorded"
    for ego in ("constant", "time-gap"):
        trace = traced(plan_of(subject, found, ego=ego), 1)
        both = list(zip(record.trace.frames, trace.frames, strict=False))
        assert len(both) > 20
        for old, new in both:
            assert new["testers"] == old["testers"]
        assert trace.head["starts"] == record.trace.head["starts"]
    assert both[-1][0]["ego"] != both[-1][1]["ego"]


def test_the_actions_of_format_1_lead_to_nearly_the_same_trajectories(found: Path) -> None:
    """They are computed from the frames, and the starts are drawn again."""
    record = recorded(found, LEARNT)
    assert record.trace is not None
    old = Trace({**record.trace.head, "format": "cavsumo-trace-1"}, record.trace.frames)
    record = dataclasses.replace(record, trace=old)
    subject = of_run(record, {}, kept=True, open_loop=True)
    assert subject.told == ()
    trace = traced(plan_of(subject, found), 1)
    for before, after in zip(old.frames, trace.frames, strict=False):
        for name, state in before["testers"].items():
            *place, o = after["testers"][name]
            assert place == pytest.approx(state[:3], abs=1e-9)
            assert wrap(o - state[3]) == pytest.approx(0.0, abs=1e-9)


def test_an_agent_of_the_results_plays_what_it_learned(found: Path) -> None:
    """By its label, with its parameters; any other stands by itself."""
    plan, manifest = recorded_plan(found)
    subject = of_policy("q-learning", plan, manifest, found, {"learn": False})
    assert subject.known == {"q-learning": tuple(manifest["learned"]["q-learning"])}
    assert subject.params["learn"] is False
    assert subject.params["epsilon"] == 0.5
    assert subject.starts_seed is None
    assert "run 5" in subject.words
    assert of_policy("late", plan, manifest, found, {}).agent == "late=timing"
    alone = of_policy("soon=proximity", plan, manifest, found, {"distance_m": 20.0})
    assert (alone.agent, alone.params, alone.known) == (
        "soon=proximity",
        {"distance_m": 20.0},
        {},
    )


def test_every_episode_begins_with_the_same_knowledge(found: Path) -> None:
    """Episodes are independent only if none of them teaches the next."""
    plan = plan_of(run_of(found, LEARNT), found)
    known = run_of(found, LEARNT).known["q-learning"]
    assert [job(plan, i, memory=("later",)).memory for i in range(3)] == [known] * 3


def test_traffic_that_was_drawn_stays_what_it_was(found: Path) -> None:
    """It is the scenario's: one draw for all episodes is no chance to certify over."""
    plan, manifest = recorded_plan(found)
    busy = plan.scenario.model_copy(update={"traffic": (4.0, 2.0), "routes": None})
    manifest["plan"] = plan.model_copy(update={"scenario": busy, "seed": 5}).model_dump(mode="json")
    settings = settings_of(run_of(found, 0), manifest, 3, 77) | {"ego": "constant"}
    certifying = plan_from(settings, "test")
    assert (certifying.seed, certifying.scenario.traffic_seed) == (77, 5)
    found_site = prepare(BatchPlan.model_validate(manifest["plan"])).site
    assert prepare(certifying).site.demand == found_site.demand is not None


# Seeds


def test_seeds_are_none_of_those_used() -> None:
    """Not even as SUMO takes them, and however many attempts that takes."""
    first = fresh_seed(1, 50, [])
    taken = [episode_seed(first, 49) ^ SUMO_SEEDS]  # another number, the same seed for SUMO
    second = fresh_seed(1, 50, taken)
    assert second != first == fresh_seed(1, 50, [taken[0] + 1])
    assert fresh_seed(2, 50, []) not in (first, second)
    of = {episode_seed(second, i) % SUMO_SEEDS for i in range(50)}
    assert of.isdisjoint(number % SUMO_SEEDS for number in taken)


def test_seeds_that_run_out_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """There is an end to the search."""
    monkeypatch.setattr("cavsumo.batch.certify.used_seeds._sumo_seeds", lambda seed, runs: [0])
    with pytest.raises(InputError, match="no 9 seeds beside 1 that were used; try fewer --runs"):
        fresh_seed(1, 9, [SUMO_SEEDS])


def test_used_are_the_seeds_of_rows_plan_and_training(found: Path, tmp_path: Path) -> None:
    """Those planned and not played too, and those that weights were learned with."""
    planned = {episode_seed(1, i) for i in range(3)}
    assert used([found], {}).seeds == planned
    later = tmp_path / "later.csv"
    manifest = json.loads(found.with_suffix(".json").read_text(encoding="utf-8"))
    plan = {**manifest["plan"], "seed": 8, "params": {"weights": str(found.with_suffix(".json"))}}
    later.with_suffix(".json").write_text(json.dumps({**manifest, "plan": plan}), encoding="utf-8")
    later.write_text(HEADER + row_line({"run": 0, "seed": 12345}), encoding="utf-8")
    bare = tmp_path / "bare.json"
    bare.write_text('{"weights": {}}', encoding="utf-8")
    both = used([later], {"weights": str(bare)})
    assert both.seeds == planned | {12345} | {episode_seed(8, i) for i in range(3)}
    assert both.results == (later, found.with_suffix(".csv"))
    assert both.silent == (bare,)


def test_a_certificate_of_a_certificate_leaves_out_both(
    found: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What was certified may have been chosen by its results; it need not have been a test."""
    copy = tmp_path / "copy.csv"
    copy.write_text(found.read_text().replace("violated", "not_triggered"), encoding="utf-8")
    copy.with_suffix(".json").write_bytes(found.with_suffix(".json").read_bytes())
    shutil.copytree(found.with_suffix(""), tmp_path / found.stem)
    words = f"certify {copy} 0 --runs 2 -q --exit-zero -o {tmp_path / 'one.csv'}"
    assert main(words.split()) == Exit.OK
    assert "run 0 was no test: not_triggered" in capsys.readouterr().err
    one = tmp_path / "one-constant.csv"
    seeds = used([one], {})
    assert seeds.results == (one, copy)
    assert seeds.seeds > used([found], {}).seeds
    again = of_run(recorded(one, 1), {}, kept=True, open_loop=False)
    assert again.starts_seed == run_of(found, 0).starts_seed


# Egos


def test_egos_have_labels_and_parameters_of_their_own(networks: dict[str, Path]) -> None:
    """The ego of the results keeps what it had under its own name."""
    scenario = Scenario(net=networks["crossing"], ego="sumo", ego_params={"decel": 4.5})
    given: Params = {"fast.speed": 12.0, "pkg.mod:Class.gain": 2, "sumo.tau": 0.5}
    words = ["sumo", "fast=time-gap", "pkg.mod:Class", "plain=sumo"]
    assert opponents(words, given, scenario) == {
        "sumo": ("sumo", {"decel": 4.5, "tau": 0.5}),
        "fast": ("time-gap", {"speed": 12.0}),
        "pkg.mod:Class": ("pkg.mod:Class", {"gain": 2}),
        "plain": ("sumo", {}),
    }
    assert opponents([], {"tau": 1.0}, scenario) == {"sumo": ("sumo", {"decel": 4.5, "tau": 1.0})}


def test_all_sorts_of_egos_and_what_goes_wrong_counts_against_the_test(
    found: Path,
    controller: Callable[..., str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A name, a class that fails now and then, a program; an error is no test, and is shown."""
    moody = controller(MOODY)
    program = f"careful=exec:{sys.executable} {ROOT / 'examples/egos/stop_for_pedestrians.py'}"
    words = ["certify", str(found), "0", "--runs", "3", "--egos", f"constant,{moody}:Moody"]
    words += ["--ego", program, "-o", str(tmp_path / "many.csv"), "-q", "--json"]
    assert main(words) == Exit.NOT_RUN
    said = json.loads(capsys.readouterr().out)
    played = {one["label"]: one for one in said["egos"]}
    assert list(played) == ["constant", f"{moody}:Moody", "careful"]
    erring = rows(tmp_path / f"many-ego-{moody}-Moody.csv")
    odd = sum(int(row["seed"]) % 2 for row in erring)
    assert played[f"{moody}:Moody"]["errors"] == odd > 0
    assert {row["outcome"] for row in erring if int(row["seed"]) % 2} == {"error"}
    for one in said["egos"]:
        level = 1 - 0.05 / 3
        assert one["runs"] == 3
        assert one["triggered_at_least"] == lower_bound(one["tests"], 3, level)
        assert one["preventable_at_least"] == lower_bound(one["preventable"], 3, level)
        assert one["violated_at_least"] == lower_bound(one["failures"], 3, level)
        assert one["preventable"] <= one["failures"]
    assert played["constant"]["tests"] > played[f"{moody}:Moody"]["tests"]
    assert said["triggered_at_least"] == min(one["triggered_at_least"] for one in said["egos"])
    assert said["seeds_excluded"] == 3


@pytest.mark.parametrize("reference", ["human", "none"])
def test_preventable_failures_come_first_or_nobody_judged(
    networks: dict[str, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    reference: str,
) -> None:
    """The reference driver of the results judges; with none, the certificate says so."""
    file = tmp_path / "found.csv"
    words = f"run -n {networks['pedestrians']} -r none -o {file} -q --exit-zero -e 15 --runs 1"
    assert main([*words.split(), "--ego", "constant", "--reference", reference]) == Exit.OK
    certify = ["certify", str(file), "timing", "--runs", "3", "-q", "--exit-zero"]
    output = ["-o", str(tmp_path / "c.csv")]
    assert main([*certify, *output]) == Exit.OK
    said = capsys.readouterr().out
    judged = [row["avoidable"] for row in rows(tmp_path / "c-constant.csv") if row["avoidable"]]
    assert ("preventable" in said.splitlines()[0]) == (reference == "human") == bool(judged)
    assert ("No reference driver judged the failures" in said) == (reference == "none")
    assert main([*certify, "--json"]) == Exit.OK
    told = json.loads(capsys.readouterr().out)
    assert told["reference"] == reference
    preventable = told["egos"][0]["preventable"]
    assert preventable == (judged.count("1") if reference == "human" else None)


def test_starts_are_those_that_were_drawn(found: Path) -> None:
    """Where a tester waited before it was moved away from somebody."""
    record = recorded(found, 0)
    assert record.trace is not None
    head = record.trace.head
    waited = [[x + 1.0, *rest] for x, *rest in head["starts"]]
    moved = dataclasses.replace(record.trace, head={**head, "waited": waited})
    kept = of_run(dataclasses.replace(record, trace=moved), {}, kept=True, open_loop=False)
    assert kept.starts == [tuple(start[:3]) for start in waited]


def test_starts_are_kept_or_refused(
    networks: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Vehicles start where they meet an ego of its length; not so for a longer one."""
    file = tmp_path / "cars.csv"
    words = f"run -n {networks['junction']} -r none --kind car --runs 1 -e 1 -q -o {file}"
    assert main([*words.split(), "--exit-zero"]) == Exit.OK
    assert main(["certify", str(file), "0", "--runs", "1", "-q", "--exit-zero"]) == Exit.OK
    before = content(tmp_path)
    capsys.readouterr()
    words = f"certify {file} 0 --ego-param length=9 -q -o {tmp_path / 'c.csv'}"
    assert main(words.split()) == Exit.USAGE
    said = capsys.readouterr().err
    assert "ego sumo: the starts of run 0 cannot be kept" in said
    assert content(tmp_path) == before


# What comes of it


def test_rows_are_the_same_for_any_number_of_processes_and_after_a_resume(
    cheap: Callable[..., list[dict[str, str]]], tmp_path: Path
) -> None:
    """And each can be replayed from the results that were written."""
    once = cheap(str(LEARNT), "--runs", "3", "-j", "2", output=tmp_path / "once.csv")
    cheap(str(LEARNT), "--runs", "1", output=tmp_path / "parts.csv")
    parts = cheap(str(LEARNT), "--runs", "3", "--resume", output=tmp_path / "parts.csv")
    assert once == parts
    assert len({row["seed"] for row in once}) == 3
    assert main(["replay", str(tmp_path / "once-constant.csv"), "2"]) == Exit.OK
    manifest = recorded_plan(tmp_path / "once-constant.csv")[1]
    assert manifest["certifies"]["test"].startswith(f"run {LEARNT} of ")
    assert manifest["learned"] == {}


def test_the_table_and_the_status_of_a_test_that_chance_does_not_touch(
    found: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Timing against a constant ego on an empty road: always the same, and it says so."""
    monkeypatch.chdir(tmp_path)
    assert recorded(found, 0).row["outcome"] == "violated"
    assert main(["certify", str(found), "0", "--runs", "3"]) == Exit.VIOLATED
    said = capsys.readouterr()
    bound = rounded_down(0.05 ** (1 / 3))
    assert f"with probability at least {bound}, against this ego; it holds for no other" in said.out
    assert "constant: all 3 episodes came out the same: chance decides nothing" in said.out
    assert "its starts are kept" in said.err
    assert "was no test" not in said.err
    assert f"none of the 3 of {found}" in said.err
    assert list(tmp_path.iterdir()) == []


def test_the_files_of_a_certificate_are_named(
    found: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Those of each ego; the temporary ones of a certificate without -o are not."""
    words = ["certify", str(found), "0", "--runs", "1", "--exit-zero"]
    assert main(words) == Exit.OK
    assert "wrote" not in capsys.readouterr().err
    assert main([*words, "-o", str(tmp_path / "c.csv")]) == Exit.OK
    files = f"{tmp_path / 'c-constant.csv'}, {tmp_path / 'c-constant.json'}"
    assert f"cavsumo: wrote {files}" in capsys.readouterr().err


def test_a_table_never_rounds_a_bound_up() -> None:
    """95 of 100 prove 0.8977, and not 0.898."""
    assert rounded_down(lower_bound(95, 100, 0.95)) == "0.8977"
    assert rounded_down(lower_bound(59, 59, 0.95)) == "0.9504"
    assert rounded_down(1.0) == "1.0000"


def test_a_certificate_is_the_least_of_its_egos(tmp_path: Path) -> None:
    """Bonferroni: each of two at 0.975, both at once at 0.95."""
    ended = []
    for name, tests in (("a", 100), ("b", 95)):
        tally, file = Tally(), tmp_path / f"{name}.csv"
        outcomes = ["held"] * (tests - 2) + ["violated"] * 2 + ["error"] * (100 - tests)
        lines = [
            {"run": i, "agent": "x", "outcome": outcome, "trigger_time_s": 1.0}
            for i, outcome in enumerate(outcomes)
        ]
        for line in lines:
            tally.add({"violation_time_s": "", "impact_speed_mps": "", **line})
        file.write_text(HEADER + "".join(map(row_line, lines)), encoding="utf-8")
        ended.append(Ended(name, file, tally))
    found = certified(ended, {"a": ("sumo", {}), "b": ("sumo", {"tau": 2})}, 0.95)
    assert found.guarantees[0].triggered == pytest.approx(0.025 ** (1 / 100))
    assert found.triggered == found.guarantees[1].triggered == lower_bound(95, 100, 0.975)
    assert found.violated == lower_bound(2, 100, 0.975)
    assert as_json(found)["egos"][1]["errors"] == 5
    assert not any(one.alike for one in found.guarantees)
    assert "against each of these 2 egos" in sentences(found)[0]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("99", "no run 99 among 6 rows"),
        ("timming", "unknown run, agent or policy:FILE 'timming'; did you mean 'timing'?"),
        ("policy:no.npz", "policy 'no.npz': No such file"),
        ("late --starts kept", "--starts kept: 'late' is no run"),
        ("late --open-loop", "--open-loop: 'late' is no run"),
        ("0 --open-loop --starts fresh", "--open-loop: recorded actions need the starts"),
        ("0 --open-loop --param aim=1", "--open-loop: the recorded actions have no parameters"),
        ("0 --param aimm=1", "agent late=timing: unknown parameter 'aimm'; did you mean 'aim'?"),
        ("0 --egos constant,tiem-gap", "unknown ego 'tiem-gap'; did you mean 'time-gap'?"),
        ("0 --egos sumo,sumo", "--egos: 'sumo' is named twice"),
        ("0 --egos sumo,", "--egos: expected EGO or LABEL=EGO between the commas"),
        ("0 --egos sumo,Sumo=sumo", "--egos: two batches have the name"),
        ("0 --ego-param spede=3", "ego constant: unknown parameter 'spede'; did you mean 'speed'?"),
        ("0 --egos sumo,constant --ego-param speed=3", "--ego-param speed: of which ego?"),
        ("0 --ego-param sumo.speed=3", "unknown ego 'sumo'; valid: constant"),
        ("0 --apart no.csv", "manifest 'no.json': cannot be read"),
        ("0 --confidence 1", "--confidence: expected a share below 1"),
        ("0 --confidence nan", "--confidence: expected a share below 1"),
        ("0 --runs 0", "--runs: expected at least 1, got 0"),
        ("0 --seed -1", "--seed: expected a number from 0"),
        ("0 --jobs 0", "jobs: expected a number of at least 1"),
        ("0 --resume", "--resume: which results?"),
        ("0 -o no/c.csv", "no such folder 'no'"),
        ("0 -o c.txt", "expected a name that ends in .csv"),
    ],
)
def test_what_cannot_be_certified_is_one_sentence(
    words: str,
    said: str,
    found: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Exit status 2, and nothing is written."""
    monkeypatch.chdir(tmp_path)
    assert main(["certify", str(found), *words.split()]) == Exit.USAGE
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1, err
    assert list(tmp_path.iterdir()) == []


def test_the_results_are_never_written_over(
    found: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A name that makes the results' own of an ego's."""
    for suffix in (".csv", ".json"):
        (tmp_path / f"x-constant{suffix}").write_bytes(found.with_suffix(suffix).read_bytes())
    before = content(tmp_path)
    words = ["certify", str(tmp_path / "x-constant.csv"), "late", "-o", str(tmp_path / "x.csv")]
    assert main([*words, "-q", "--overwrite"]) == Exit.USAGE
    assert "is one of the results" in capsys.readouterr().err
    assert content(tmp_path) == before
