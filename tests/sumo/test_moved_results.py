"""Results that are moved: played, reported, certified, merged and continued anywhere.

The network and the routes are deleted where they were, and the working folder is an empty one.
"""

from __future__ import annotations

import csv
import errno
import json
import os
import re
import shutil
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from support import content, rows, traces

import cavsumo
from cavsumo.batch.certify.used_seeds import used
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.cli import main
from cavsumo.results.reading import FIRST, read_manifest
from cavsumo.results.trace_file import packed, read_trace_text

RUN = 1  # which the ego fails
PLAYED = ("run", "--net", "networks/crossing.net.xml", "--runs", "2", "--trace", "all")
QUIET = ("-q", "--exit-zero")
PARTS = ("part1", "part2")
# The header of version 0.1.
OLD = (
    "run,agent,ego,testers,reset,embodiment,sumo_width_m,seed,forecast,forecast_value,outcome,"
    "breach,blame,assertion,verdicts,robustness,tester,trigger_time_s,violation_time_s,time_s,"
    "steps,min_gap_m,min_ttc_s,max_drac_mps2,pet_s,ego_speed_mps,impact_speed_mps,max_decel_mps2,"
    "avoidable,reference,last_chance_s,margin_s,avoidable_note,cost,accel_rms_mps2,turning_rad,"
    "reward,contacts,tester_contacts,sumo_collisions,background_collisions,emergency_stops,"
    "teleports,trace,error,wall_s"
).split(",")


@pytest.fixture(scope="module")
def moved(
    networks: dict[str, Path],
    routes: dict[str, Path],
    tmp_path_factory: pytest.TempPathFactory,
    inline: None,
) -> Path:
    """The folder of a batch, its two shards and the page of a run, moved after it was played."""
    home, away = tmp_path_factory.mktemp("home"), tmp_path_factory.mktemp("away") / "batch"
    for folder, files in (("networks", networks), ("routes", routes)):
        (home / folder).mkdir()
        shutil.copy(files["crossing"], home / folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(home)
        Path("batch").mkdir()
        assert main([*PLAYED, "-o", "batch/results.csv", *QUIET]) == 0
        for i in ("1", "2"):
            words = ["--shard", f"{i}/2", "-o", f"batch/part{i}.csv"]
            assert main([*PLAYED, *words, *QUIET]) == 0
        assert main(["replay", "batch/results.csv", str(RUN), "--html", "batch/before.html"]) == 0
    shutil.move(home / "batch", away)
    shutil.rmtree(home)
    return away


@pytest.fixture
def elsewhere(tmp_path: Path, moved: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty working folder beside the moved results, which stay as they are."""
    before = content(moved)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    assert content(moved) == before


@pytest.fixture
def closed(moved: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The results, of files that lay in a folder which is closed to this user."""
    folder = elsewhere / "theirs"
    for file in (_copied(moved, elsewhere), *map(partial(_copied, moved, elsewhere), PARTS)):
        own = file.with_suffix(".json")
        own.write_text(_moved_to(folder, own.read_text("utf-8")), "utf-8")
        for trace in file.with_suffix("").glob("run*.jsonl.gz"):
            trace.write_bytes(packed(_moved_to(folder, read_trace_text(trace))))
    stat = os.stat

    def refused(path: Any, *args: Any, **how: Any) -> os.stat_result:
        if not isinstance(path, int) and Path(os.fsdecode(path)).is_relative_to(folder):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), path)
        return stat(path, *args, **how)

    monkeypatch.setattr(os, "stat", refused)
    return elsewhere / "results.csv"


@pytest.mark.parametrize(
    "words",
    [
        "replay results.csv 1",
        "replay results/run000001.jsonl.gz --playback",
        "replay results.csv 1 --recorded --html page.html",
        "report results.csv --html report.html -o t.txt",
        "certify results.csv 1 --runs 1 -q --exit-zero",
        "merge part1.csv part2.csv -o whole.csv -q",
        "run --resume -o results.csv --runs 3 -q --exit-zero",
    ],
)
def test_the_old_folder_may_be_closed_to_this_user(
    closed: Path, capsys: pytest.CaptureFixture[str], words: str
) -> None:
    """Somebody else's home: the inputs carried are used, and nothing is said."""
    assert main(words.split()) == 0
    said = capsys.readouterr().err
    assert "denied" not in said
    assert "without" not in said


@pytest.mark.parametrize("words", [(), ("--playback",), ("--recorded",)])
def test_a_row_is_played_again(
    moved: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...]
) -> None:
    """Bit for bit, anew and back; its page is that from before the move, byte for byte."""
    html = elsewhere / "page.html"
    assert main(["replay", str(moved / "results.csv"), "1", "--html", str(html), *words]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("run 1 (timing): violated, ")
    assert said.err == f"cavsumo: wrote {html}\n"
    assert html.read_bytes() == (moved / "before.html").read_bytes()


def test_a_trace_is_played_with_the_inputs_beside_it(
    moved: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The folder of traces alone, sent to somebody."""
    shutil.copytree(moved / "results", elsewhere / "sent")
    assert main(["replay", "sent/run000001.jsonl.gz"]) == 0
    assert capsys.readouterr().out.endswith(" frames: the same\n")


def test_traces_that_are_not_compressed_are_read_everywhere(
    moved: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As 0.1 left them: replayed, shown, reported, certified, loaded and merged."""
    for stem in ("results", "part1", "part2"):
        file = _copied(moved, elsewhere, stem)
        for trace in file.with_suffix("").glob("*.jsonl.gz"):
            trace.with_suffix("").write_text(read_trace_text(trace), encoding="utf-8")
            trace.unlink()
        file.write_text(file.read_text("utf-8").replace(".jsonl.gz", ".jsonl"), "utf-8")
    one = "results/run000001.jsonl"
    assert main(["replay", one]) == main(["replay", one, "--playback"]) == 0
    assert main(["replay", "results.csv", "1", "--recorded", "--fcd", "f.xml"]) == 0
    assert main(["report", "results.csv", "--html", "report.html", "-o", "t.txt"]) == 0
    assert "No replay pages" not in capsys.readouterr().err
    words = ["certify", "results.csv", str(RUN), "--runs", "1", "--open-loop", "-o", "c.csv"]
    assert main([*words, *QUIET]) == 0
    assert cavsumo.load("results.csv").replay(RUN, recorded=True).row["outcome"] == "violated"
    assert main(["merge", "part1.csv", "part2.csv", "-o", "whole.csv", "-q"]) == 0
    assert content(Path("whole")) == content(moved / "results")  # compressed again


def test_python_plays_them_too(moved: Path, elsewhere: Path) -> None:
    """``cavsumo.load`` from any working folder."""
    results = cavsumo.load(moved / "results.csv")
    assert results.replay(RUN).row["outcome"] == "violated"
    assert len(results.replay(RUN, recorded=True).frames) > 0


def test_python_plays_the_scenario_again(moved: Path, elsewhere: Path) -> None:
    """On the network that the results carry; without it, the file is named."""
    results = cavsumo.load(moved / "results.csv")
    again = cavsumo.run(results.scenario, runs=2, trace="all", progress=False)
    assert rows(again.file) == rows(results.file)
    assert again.manifest["plan"]["scenario"] == results.manifest["plan"]["scenario"]
    bare = _copied(moved, elsewhere)
    shutil.rmtree(elsewhere / "results" / "inputs")
    with pytest.raises(cavsumo.InputError, match="no such file"):
        cavsumo.run(cavsumo.load(bare).scenario, runs=1)


def test_a_report_has_its_pages(
    moved: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The map and the page of the failure."""
    assert main(["report", str(moved / "results.csv"), "--html", "report.html", "-o", "t.txt"]) == 0
    assert "No replay pages" not in capsys.readouterr().err
    assert (elsewhere / "report_replays" / "run000001.html").is_file()
    assert "drawn without its network" not in (elsewhere / "report.html").read_text("utf-8")


def test_a_report_says_which_pages_it_cannot_make(
    moved: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without its inputs: on stderr and in the page."""
    file = _copied(moved, elsewhere)
    shutil.rmtree(elsewhere / "results" / "inputs")
    assert main(["report", str(file), "--html", "report.html", "-o", "t.txt"]) == 0
    said, _, rest = capsys.readouterr().err.partition("\n")
    words = "No replay pages, for lack of the network: "
    assert said.startswith(f"cavsumo: --html: {words}")
    assert "needs 'crossing.net.xml' (sha256 a72e56a374a8)" in said
    assert "No replay pages" not in rest
    assert words in (elsewhere / "report.html").read_text("utf-8")
    shutil.rmtree(elsewhere / "results")
    (elsewhere / "results").mkdir()
    shutil.copytree(moved / "results" / "inputs", elsewhere / "results" / "inputs")
    text = file.read_text("utf-8")
    file.write_text(re.sub(r"results/run\d+\.jsonl\.gz", "", text), "utf-8")
    assert main(["report", str(file), "--html", "report.html", "-o", "t.txt"]) == 0
    assert "pages of 1 of the listed runs: no trace of them was kept" in capsys.readouterr().err


def test_a_test_is_certified(moved: Path, elsewhere: Path) -> None:
    """Run by run and by its agent; what it writes has the inputs too."""
    words = ["certify", str(moved / "results.csv"), str(RUN), "--runs", "2", "-o", "c.csv"]
    assert main([*words, *QUIET]) == 0
    assert _inputs(elsewhere / "c-sumo.csv") == _inputs(moved / "results.csv")
    scenario = read_manifest(elsewhere / "c-sumo.csv")["plan"]["scenario"]
    assert scenario["net"] == "networks/crossing.net.xml"


def test_shards_are_merged_with_their_inputs(
    moved: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The rows, traces and inputs of the one run; without inputs a sentence each."""
    parts = [str(moved / f"part{i}.csv") for i in (1, 2)]
    assert main(["merge", *parts, "-o", "whole.csv", "-q"]) == 0
    assert capsys.readouterr().err == ""
    whole, single = elsewhere / "whole.csv", moved / "results.csv"
    untold = [{**row, "trace": ""} for row in rows(whole)]
    assert untold == [{**row, "trace": ""} for row in rows(single)]
    assert traces(whole) == traces(single)
    assert _inputs(whole) == _inputs(single)
    for i in (1, 2):
        _copied(moved, elsewhere, f"part{i}")
        shutil.rmtree(elsewhere / f"part{i}" / "inputs")
    assert main(["merge", "part1.csv", "part2.csv", "-o", "bare.csv", "-q"]) == 0
    said = capsys.readouterr().err
    assert said.count("which is not here; ") == said.count("; the whole is without it\n") == 2


def test_a_batch_is_continued(moved: Path, elsewhere: Path, tmp_path: Path) -> None:
    """Two rows stay as they are; the plan and the new trace name files as they were named."""
    file = _copied(moved, elsewhere)
    before = file.read_bytes(), traces(file)
    assert main(["run", "--resume", "-o", str(file), "--runs", "3", *QUIET]) == 0
    assert file.read_bytes().startswith(before[0])
    after = traces(file)
    assert len(after) == 3
    assert after.items() >= before[1].items()
    heads = [json.loads(text.partition("\n")[0]) for text in after.values()]
    assert len({json.dumps((head["plan"]["scenario"], head["sha256"])) for head in heads}) == 1
    assert _inputs(file) == _inputs(moved / "results.csv")


def test_a_process_elsewhere_says_that_it_does_not_see_the_copies(
    moved: Path,
    elsewhere: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A dask worker on another machine: one sentence with the name and the remedy."""
    file = _copied(moved, elsewhere)
    here = PreparedBatch.check_here

    def on_another_machine(prepared: PreparedBatch) -> None:
        for place in prepared.plan.scenario.places.values():
            place.rename(place.with_suffix(".away"))
        try:
            here(prepared)
        finally:
            for place in prepared.plan.scenario.places.values():
                place.with_suffix(".away").rename(place)

    monkeypatch.setattr(PreparedBatch, "check_here", on_another_machine)
    assert main(["run", "--resume", "-o", str(file), "--runs", "3", *QUIET]) == 2
    said = capsys.readouterr().err
    assert said.startswith("cavsumo: 'networks/crossing.net.xml' is not at ")
    assert said.endswith("put the file where it was, where all processes see it\n")


def test_an_edited_network_is_not_continued_on(
    moved: Path, elsewhere: Path, networks: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    """A file at the recorded place is meant; another content is another batch."""
    file = _copied(moved, elsewhere)
    (elsewhere / "networks").mkdir()
    text = networks["crossing"].read_text("utf-8") + "<!-- edited -->\n"
    (elsewhere / "networks" / "crossing.net.xml").write_text(text, "utf-8")
    assert main(["run", "--resume", "-o", str(file), "--runs", "3", *QUIET]) == 2
    assert "sha256: networks/crossing.net.xml was " in capsys.readouterr().err
    assert main(["replay", str(file), "1"]) == 0  # which is of what was recorded


def test_weights_are_carried(
    networks: dict[str, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """What an agent learned elsewhere: replayed, shown and its seeds are still excluded."""
    words = ["run", "--net", str(networks["pedestrians"]), "--routes", "none", "--end", "5"]
    words += ["--agent", "q-learning", "--runs", "2", *QUIET]
    school, late = tmp_path / "school", tmp_path / "late"
    for folder in (school, late):
        folder.mkdir()
    monkeypatch.chdir(school)
    assert main([*words, "-o", "school.csv"]) == 0
    param = ["--param", "weights=school.json", "--seed", "5", "-o", "../late/results.csv"]
    param += ["--trace", "all"]
    assert main([*words, *param]) == 0
    monkeypatch.chdir(late)
    shutil.rmtree(school)
    capsys.readouterr()
    for how in ([], ["--playback"], ["--recorded", "--html", "page.html"]):
        assert main(["replay", "results.csv", "1", *how]) == 0
    assert main(["report", "results.csv", "--html", "report.html", "-o", "t.txt"]) == 0
    said = capsys.readouterr().err.splitlines()
    assert [line for line in said if not line.startswith("cavsumo: wrote ")] == []
    certify = ["certify", "results.csv", "q-learning", "--runs", "1", "-q", "--exit-zero"]
    assert main(certify) == 0
    found = used([Path("results.csv")], {})
    assert len(found.seeds) == 4
    assert [str(file) for file in found.results] == ["results.csv", "school.csv"]


def test_files_that_only_sumo_knows_of_are_named(
    networks: dict[str, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """They are not kept: the batch says so, a replay elsewhere has them put beside the results."""
    home, away = tmp_path / "home", tmp_path / "away"
    home.mkdir()
    monkeypatch.chdir(home)
    (home / "more.add.xml").write_text(
        '<additional><include href="types.add.xml"/>'
        '<e1Detector id="d" lane="westbound_1" pos="5" file="out.xml"/></additional>'
    )
    (home / "types.add.xml").write_text('<additional><vType id="x" vClass="bus"/></additional>')
    words = ["run", "-n", str(networks["pedestrians"]), "-r", "none", "-a", "more.add.xml"]
    assert main([*words, "--end", "5", "--runs", "1", "-o", "results.csv", *QUIET]) == 0
    assert capsys.readouterr().err == (
        "cavsumo: 'more.add.xml' has SUMO read 'types.add.xml', which the results do not keep: a "
        "replay elsewhere needs both beside them\n"
    )
    home.rename(away)
    monkeypatch.chdir(tmp_path)
    (away / "more.add.xml").rename(tmp_path / "more.add.xml")
    assert main(["replay", "away/results.csv", "0"]) == 2
    assert "types.add.xml" in capsys.readouterr().err
    (tmp_path / "more.add.xml").rename(away / "more.add.xml")
    assert main(["replay", "away/results.csv", "0"]) == 0


# Of version 0.1


def test_results_of_version_0_1_are_read(
    moved: Path,
    elsewhere: Path,
    networks: dict[str, Path],
    routes: dict[str, Path],
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Without the columns and the inputs that 0.2 added; they are not continued."""
    assert set(OLD) == FIRST  # a column that is new since is declared to be (``Column.since``)
    file = _copied(moved, elsewhere)
    shutil.rmtree(elsewhere / "results" / "inputs")
    with (moved / "results.csv").open(newline="") as source, file.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, OLD, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(csv.DictReader(source))
    assert [row["arrived"] for row in rows(file)] == ["", ""]
    assert cavsumo.load(file).rows["driven_m"].isna().all()
    assert main(["report", str(file)]) == 0
    named = ["--net", str(networks["crossing"]), "--routes", str(routes["crossing"])]
    assert main(["replay", str(file), "1", *named]) == 0
    assert main(["merge", str(file), "-o", "whole.csv", "-q"]) == 0
    assert rows(elsewhere / "whole.csv")[0]["frozen"] == ""
    for name, folder in ((networks, "networks"), (routes, "routes")):
        (elsewhere / folder).mkdir()
        shutil.copy(name["crossing"], elsewhere / folder)
    capsys.readouterr()
    before = file.read_bytes()
    assert main(["run", "--resume", "-o", str(file), "--runs", "3", *QUIET]) == 2
    assert "were written by an earlier version" in capsys.readouterr().err
    assert file.read_bytes() == before


def _copied(moved: Path, folder: Path, stem: str = "results") -> Path:
    """Results of the moved folder in another one, to be changed."""
    for end in (".csv", ".json"):
        shutil.copy(moved / f"{stem}{end}", folder)
    shutil.copytree(moved / stem, folder / stem)
    return folder / f"{stem}.csv"


def _moved_to(folder: Path, text: str) -> str:
    """A manifest or a trace whose network and routes lay in a folder."""
    for sort in ("networks", "routes"):
        assert f'"{sort}/crossing.' in text
        text = text.replace(f'"{sort}/crossing.', f'"{folder}/{sort}/crossing.')
    return text


def _inputs(file: Path) -> dict[str, bytes]:
    """The kept inputs of results."""
    return content(file.with_suffix("") / "inputs")
