"""What agents knew, read from damaged files: one sentence and exit status 2, never a defect."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support import content

from cavsumo.cli import main
from cavsumo.results.trace_file import PACKED, PLAIN, packed, read_trace_text

Q, BEST = 2, 5  # the last runs of the two learners
QUIET = ("-q", "--exit-zero")


@pytest.fixture(scope="module")
def learned(
    networks: dict[str, Path], tmp_path_factory: pytest.TempPathFactory, inline: None
) -> Path:
    """A batch of both learners, and the certificate of what one of them did."""
    folder = tmp_path_factory.mktemp("learned")
    words = ["run", "-n", str(networks["pedestrians"]), "-r", "none", "--end", "8", "--runs", "3"]
    words += ["--agent", "q-learning", "--agent", "best-response", "--param", "explore=2"]
    words += ["--param", "best-response.aim=violation"]  # one plan for all bodies
    words += ["--param", "replan=1", "--testers", "2", "--trace", "all"]
    file = folder / "found.csv"
    assert main([*words, "-o", str(file), *QUIET]) == 0
    again = ["certify", str(file), str(Q), "--open-loop", "--runs", "1"]
    assert main([*again, "-o", str(folder / "cert.csv"), *QUIET]) == 0
    return folder


@pytest.fixture
def damaged(
    learned: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[[str, Any, tuple[Any, ...]], None]:
    """Call with a file, a value and where to put it: the files, that one changed.

    A trace is written as its name says, compressed or as plain text.
    """
    folder = tmp_path / "here"
    shutil.copytree(learned, folder)
    monkeypatch.chdir(folder)

    def change(name: str, value: Any, place: tuple[Any, ...]) -> None:
        file, whole = Path(name), name.endswith(".json")
        found = file if file.exists() else file.with_name(f"{file.name}.gz")
        first, feed, rest = read_trace_text(found).partition("\n")
        document = at = json.loads(first + feed + rest if whole else first)
        *ways, last = place
        for key in ways:
            at = at[key]
        at[last] = value
        text = json.dumps(document) + ("" if whole else f"\n{rest}")
        file.write_bytes(packed(text) if name.endswith(".gz") else text.encode())

    return change


@pytest.mark.parametrize(
    ("run", "value", "place"),
    [
        (Q, [None], (1, "weights", "late")),
        (Q, "nan", (1, "weights", "late")),
        (Q, 1e308, (0, "weights", "late")),
        (Q, -1e300, (0, "episodes")),
        (Q, 7, (1,)),
        (BEST, "x", (0, "planned")),
        (BEST, 0.5, (0, "counts", "ages", 0, 0, 0)),
        (BEST, 1e308, (1, "counts", "sums", 0, 0)),
        (BEST, [[]], (1, "counts", "taken")),
    ],
)
def test_a_damaged_memory_of_a_trace_is_refused(
    damaged: Callable[..., None],
    capsys: pytest.CaptureFixture[str],
    run: int,
    value: Any,
    place: tuple[Any, ...],
) -> None:
    """The file and the key are named."""
    agent = "q-learning" if run == Q else "best-response"
    trace = f"found/run{run:06d}{PACKED}"
    damaged(trace, value, ("memory", *place))
    assert main(["replay", trace]) == 2
    said = capsys.readouterr().err
    assert said == f"cavsumo: trace {trace!r}: memory: is not what agent {agent} can have known\n"


@pytest.mark.parametrize("ending", [PLAIN, PACKED])
def test_knowledge_of_another_number_of_agents_is_refused(
    damaged: Callable[..., None], capsys: pytest.CaptureFixture[str], ending: str
) -> None:
    """Two agents have one body each; in a trace of either sort."""
    trace = f"found/run{Q:06d}{ending}"
    damaged(trace, [], ("memory",))
    assert main(["replay", trace]) == 2
    assert "memory: is not what agent q-learning can have known" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("file", "value", "place", "words"),
    [
        ("found.json", {}, ("learned", "q-learning", 0), "certify found.csv q-learning"),
        ("found.json", {}, ("learned", "q-learning", 0), "run --resume -o found.csv"),
        ("cert.json", "x", ("plan", "known", "run2", 0, "actions", 0), "replay cert.csv 0"),
        ("cert.json", [], ("plan", "known", "run2", 0, "actions", 3), "replay cert.csv 0"),
        ("cert.json", 1e30, ("plan", "known", "run2", 0, "starts", 0, 0), "replay cert.csv 0"),
    ],
)
def test_damaged_knowledge_of_a_manifest_is_refused(
    damaged: Callable[..., None],
    capsys: pytest.CaptureFixture[str],
    file: str,
    value: Any,
    place: tuple[Any, ...],
    words: str,
) -> None:
    """Certified, continued or replayed; nothing is written."""
    for found in Path().glob("cert-sumo*"):
        found.rename(str(found).replace("cert-sumo", "cert"))
    damaged(file, value, place)
    before = content(Path())
    more = [] if words.startswith("replay") else ["--runs", "4", *QUIET]
    assert main([*words.split(), *more]) == 2
    assert "is not what agent" in capsys.readouterr().err
    assert content(Path()) == before


@pytest.mark.parametrize(
    ("value", "place", "said"),
    [
        (1e15, ("starts", 0, 0), "a start at 1e+15, "),
        (10**30, ("plan", "scenario", "bodies_per_agent"), "does not divide testers 2"),
    ],
)
def test_numbers_of_a_trace_that_lead_nowhere_are_refused(
    damaged: Callable[..., None],
    capsys: pytest.CaptureFixture[str],
    value: Any,
    place: tuple[Any, ...],
    said: str,
) -> None:
    """Before anything is simulated."""
    trace = f"found/run{Q:06d}{PACKED}"
    damaged(trace, value, place)
    assert main(["replay", trace, "--playback"]) == 2
    assert said in capsys.readouterr().err
