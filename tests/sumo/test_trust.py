"""Strangers' traces and results: nothing that they name runs, is imported, connected to or read."""

from __future__ import annotations

import json
import shutil
import socket
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from support import content

from cavsumo.cli import main
from cavsumo.errors import Exit, ResultsError
from cavsumo.results.reading import inside, read_rows
from cavsumo.results.trace_file import packed, read_trace_text

PLANTED = "from pathlib import Path\nPath('imported').touch()\n"
PLANTED += "class Ego:\n    def act(self, snapshot):\n        raise ValueError\n"
PLANTED += "def slow(snapshot):\n    return 1.0\n"
SORTS = ("exec", "module", "tcp", "assertion")


@dataclass(frozen=True)
class Sent:
    """A stranger's batch in the working folder, with whatever would show that it was obeyed."""

    folder: Path
    csv_file: Path
    trace: Path
    run: str
    server: socket.socket

    def change(self, **scenario: Any) -> None:
        """Write settings of the scenario into manifest and traces."""
        manifest = self.csv_file.with_suffix(".json")
        plan = json.loads(manifest.read_text(encoding="utf-8"))
        plan["plan"]["scenario"] |= scenario
        manifest.write_text(json.dumps(plan), encoding="utf-8")
        for file in self.csv_file.with_suffix("").glob("*.jsonl.gz"):
            first, _, rest = read_trace_text(file).partition("\n")
            head = json.loads(first)
            head["plan"]["scenario"] |= scenario
            file.write_bytes(packed(json.dumps(head) + "\n" + rest))

    def name(self, sort: str) -> None:
        """Have the batch name something of its own."""
        port = self.server.getsockname()[1]
        egos = {
            "exec": "exec:touch ran",
            "module": "planted:Ego",
            "tcp": f"tcp:127.0.0.1:{port}",
        }
        if sort in egos:
            self.change(ego=egos[sort], ego_params={})
        else:
            self.change(assertions=["planted:slow"], assertion_params={})

    def point(self, trace: str) -> None:
        """Have every row name this trace."""
        text = self.csv_file.read_text(encoding="utf-8")
        for row in read_rows(self.csv_file):
            if row["trace"]:
                text = text.replace(row["trace"], trace)
        self.csv_file.write_text(text, encoding="utf-8")

    def untouched(self) -> bool:
        """Whether nothing ran, was imported or was connected to."""
        try:
            self.server.accept()[0].close()
        except BlockingIOError:
            made = {"ran", "imported"} & {file.name for file in self.folder.iterdir()}
            return not made and "planted" not in sys.modules
        return False


@pytest.fixture
def sent(found_failure: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Sent]:
    """A batch that was played elsewhere, opened in a folder in which a module is planted."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    for file in (found_failure, found_failure.with_suffix(".json")):
        shutil.copy(file, tmp_path / file.name)
    shutil.copytree(found_failure.with_suffix(""), tmp_path / found_failure.stem)
    (tmp_path / "planted.py").write_text(PLANTED, encoding="utf-8")
    csv_file = Path(found_failure.name)
    row = next(row for row in read_rows(csv_file) if row["outcome"] == "violated")
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.setblocking(False)
        yield Sent(tmp_path, csv_file, Path(row["trace"]), row["run"], server)
    sys.modules.pop("planted", None)


def commands(sent: Sent) -> dict[str, list[str]]:
    """Every command that plays what results or a trace hold."""
    csv_file, trace = str(sent.csv_file), str(sent.trace)
    return {
        "replay": ["replay", csv_file, sent.run],
        "replay trace": ["replay", trace],
        "replay --playback": ["replay", trace, "--playback"],
        "replay --html": ["replay", trace, "--html", "page.html"],
        "replay --fcd": ["replay", csv_file, sent.run, "--fcd", "fcd.xml"],
        "certify": ["certify", csv_file, sent.run, "--runs", "1", "-q"],
        "certify --open-loop": ["certify", csv_file, sent.run, "--open-loop", "--runs", "1", "-q"],
        "certify agent": ["certify", csv_file, "timing", "--runs", "1", "-q", "-o", "c.csv"],
    }


@pytest.mark.parametrize("sort", SORTS)
def test_what_plays_again_refuses_what_only_the_file_names(
    sent: Sent, sort: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """One sentence that says what it would do and how to allow it; nothing happens."""
    sent.name(sort)
    before = content(sent.folder)
    uses = {"exec": "run 'touch ran'", "module": "import 'planted:Ego'"}
    uses |= {"tcp": "connect to '127.0.0.1:", "assertion": "import 'planted:slow'"}
    for name, words in commands(sent).items():
        assert main(words) == Exit.USAGE, name
        said = capsys.readouterr()
        assert uses[sort] in said.err, name
        assert said.err.endswith("--trust allows it\n"), name
        assert said.err.count("\n") == 1, name
        assert said.out == "", name
        assert sent.untouched(), name
    assert content(sent.folder) == before


@pytest.mark.parametrize("sort", SORTS)
def test_what_shows_a_record_needs_no_trust(sent: Sent, sort: str) -> None:
    """Frames as recorded, the report with its pages, and merge: done, and nothing happens."""
    sent.name(sort)
    csv_file, trace = str(sent.csv_file), str(sent.trace)
    shown = [
        ["replay", trace, "--recorded", "--html", "one.html"],
        ["replay", csv_file, sent.run, "--recorded", "--html", "two.html", "--fcd", "fcd.xml"],
        ["replay", csv_file, sent.run, "--recorded"],
        ["report", csv_file, "--html", "report.html", "--junit", "junit.xml", "-o", "report.txt"],
        ["merge", csv_file, "-o", "whole.csv"],
    ]
    for words in shown:
        assert main(words) == Exit.OK, words
        assert sent.untouched(), words
    assert list((sent.folder / "report_replays").glob("*.html"))
    for name in ("one.html", "two.html", "fcd.xml", "whole.csv"):
        assert (sent.folder / name).stat().st_size > 1000


def test_the_site_that_is_shown_is_the_one_that_was_played(sent: Sent) -> None:
    """An ego from outside changes the words of the page and no picture."""
    words = ["replay", str(sent.trace), "--recorded", "--html"]
    assert main([*words, "ours.html"]) == Exit.OK
    sent.change(ego="planted:Ego", ego_params={})
    assert main([*words, "theirs.html"]) == Exit.OK
    ours, theirs = (Path(n).read_text(encoding="utf-8") for n in ("ours.html", "theirs.html"))
    changed = [
        (a, b) for a, b in zip(ours.splitlines(), theirs.splitlines(), strict=True) if a != b
    ]
    assert len(changed) == 1
    assert "planted:Ego" in changed[0][1]


def test_trust_plays_it(sent: Sent, capsys: pytest.CaptureFixture[str]) -> None:
    """The module is imported when the user says so: the control of the tests above."""
    sent.name("module")
    assert main(["replay", str(sent.csv_file), sent.run, "--trust"]) == Exit.VIOLATED
    assert "act raised ValueError" in capsys.readouterr().err
    assert (sent.folder / "imported").exists()


def test_certify_needs_no_trust_for_an_ego_that_is_repeated(
    sent: Sent, capsys: pytest.CaptureFixture[str]
) -> None:
    """Named on the command line it is the user's; beside another one it is not used at all."""
    sent.name("module")
    words = ["certify", str(sent.csv_file), sent.run, "--runs", "1", "-q", "--exit-zero"]
    assert main([*words, "--ego", "constant"]) == Exit.OK
    assert sent.untouched()
    assert main([*words, "--ego", "planted:Ego"]) == Exit.NOT_RUN
    assert (sent.folder / "imported").exists()
    sent.name("assertion")
    capsys.readouterr()
    assert main([*words, "--ego", "planted:Ego"]) == Exit.USAGE
    assert "import 'planted:slow'" in capsys.readouterr().err


def _opened(sent: Sent) -> list[list[str]]:
    """Every command that reads the traces that rows name."""
    csv_file = str(sent.csv_file)
    return [
        ["replay", csv_file, sent.run],
        ["replay", csv_file, sent.run, "--recorded", "--html", "page.html"],
        ["report", csv_file],
        ["report", csv_file, "--html", "report.html"],
        ["merge", csv_file, "-o", "whole.csv"],
        ["certify", csv_file, sent.run, "--runs", "1", "-q"],
    ]


@pytest.mark.parametrize("way", ["up", "absolute", "link", "linked folder", "backslash"])
def test_a_trace_outside_the_folder_is_not_read(
    sent: Sent,
    way: str,
    tmp_path_factory: pytest.TempPathFactory,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A genuine trace elsewhere, so that only its place is wrong: one sentence, nothing written."""
    away = tmp_path_factory.mktemp("away") / "secret.jsonl"
    shutil.copy(sent.trace, away)
    if way == "link":
        (sent.folder / "link.jsonl").symlink_to(away)
    elif way == "linked folder":
        (sent.folder / "linked").symlink_to(away.parent)
    up = f"../{away.parent.name}/{away.name}"
    names = {"up": up, "absolute": str(away), "link": "link.jsonl"}
    names |= {"linked folder": f"linked/{away.name}", "backslash": up.replace("/", "\\")}
    sent.point(names[way])
    before = content(sent.folder)
    for words in _opened(sent):
        assert main(words) == Exit.USAGE, words
        said = capsys.readouterr().err
        assert "leads out of their folder" in said, words
        assert said.count("\n") == 1, words
        assert content(sent.folder) == before, words


def test_an_egos_log_outside_the_folder_is_not_merged(
    sent: Sent, tmp_path_factory: pytest.TempPathFactory, capsys: pytest.CaptureFixture[str]
) -> None:
    """A link in its place is not followed."""
    away = tmp_path_factory.mktemp("away") / "secret"
    away.write_text("secret", encoding="utf-8")
    (sent.csv_file.with_suffix("") / "run000000.ego.log").symlink_to(away)
    assert main(["merge", str(sent.csv_file), "-o", "whole.csv"]) == Exit.USAGE
    assert "leads out of their folder" in capsys.readouterr().err
    assert not (sent.folder / "whole.csv").exists()


@pytest.mark.parametrize("name", ["a\0b", "C:\\x", "\\\\host\\x", "/x", "a/../../x", ".."])
def test_names_that_are_none(tmp_path: Path, name: str) -> None:
    """Refused on every system alike."""
    with pytest.raises(ResultsError, match=r"no name of a file|leads out"):
        inside(tmp_path / "r.csv", name)


def test_names_inside_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the folder itself is reached by a link, or from within."""
    (tmp_path / "real").mkdir()
    (tmp_path / "way").symlink_to(tmp_path / "real")
    name = "r/run000001.jsonl"
    assert inside(tmp_path / "way" / "r.csv", name) == tmp_path / "way" / name
    monkeypatch.chdir(tmp_path)
    assert inside(Path("r.csv"), name) == Path(name)
