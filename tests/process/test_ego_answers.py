"""Which answer of an ego outside belongs to which question, and which episode is to blame."""

from __future__ import annotations

import contextlib
import json
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from support import rows, traces

from cavsumo.agents.base import Scene
from cavsumo.cli.command_line import main
from cavsumo.egos import Acceleration, Ego, make_ego
from cavsumo.egos.base import Mission
from cavsumo.egos.external import protocol
from cavsumo.errors import EgoError
from cavsumo.model.snapshot import Snapshot

# Answers each observation with its step as acceleration. By its first argument it writes one line
# too many: late, behind the answer to step 1 or 2, between two episodes, or at each reset. With
# a second one its answers name their steps. Each reset is a line of the file "resets".
SLOPPY = r"""
import json, os, sys, threading, time
from pathlib import Path

mode, named = sys.argv[1], sys.argv[2:] == ["named"]

def say(data):
    os.write(1, json.dumps(data).encode() + b"\n")

def answer(step):
    return {"acceleration": step} | ({"step": step} if named else {})

kept = None
for line in sys.stdin:
    message = json.loads(line)
    if message["type"] == "hello":
        say({"type": "hello", "version": 1})
    elif message["type"] == "reset":
        with open("resets", "a") as file:
            print(message["seed"], file=file)
        seen = Path("resets").read_text().split()
        if mode == "dies" and len(seen) == 2:
            sys.exit("no second episode")
        if kept is not None:
            say(kept)
        kept = None
        if mode == "greets":
            say({"acceleration": 9})
        say({"type": "ready"})
    elif message["type"] == "observation":
        if kept is not None:
            say(kept)  # the line of the step before, too late
            kept = answer(message["step"])
        else:
            say(answer(message["step"]))
            if mode == f"step {message['step']}" and not Path("spoilt").exists():
                Path("spoilt").touch()
                kept = answer(message["step"])
    if mode == "between" and message["type"] == "observation" and message["step"] == 2:
        def later():
            while not Path("concluded").exists():
                time.sleep(0.01)
            say({"acceleration": 9})
            Path("written").touch()
        if not Path("concluded").exists():
            threading.Thread(target=later).start()
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with the sloppy ego in it."""
    (tmp_path / "sloppy.py").write_text(SLOPPY, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def scene(straight_scene: Callable[..., Scene]) -> Scene:
    """The straight road with one pedestrian."""
    return straight_scene()


@pytest.fixture
def episode(scene: Scene, scene_snapshot: Callable[..., Snapshot]) -> Callable[[Ego], list[Any]]:
    """Call with an ego: an episode of three timesteps, from the reset to the conclusion."""

    def played(ego: Ego) -> list[Any]:
        ego.reset(scene)
        seen = [scene_snapshot(scene, (10.0, 8.0), step=i) for i in range(3)]
        answers = [ego.act(snapshot) for snapshot in seen]
        ego.conclude()
        return answers

    return played


GOOD = [Acceleration(0.0), Acceleration(1.0), Acceleration(2.0)]


@contextlib.contextmanager
def started(scene: Scene, *words: str) -> Iterator[Ego]:
    """The sloppy ego, ready to drive."""
    spec = f"exec:{sys.executable} sloppy.py {' '.join(repr(word) for word in words)}"
    ego = make_ego(spec, {"reply_s": 10.0})
    ego.prepare(Mission(Path("road.net.xml"), ("east",), scene.ego_path, (), scene.dt, 60.0))
    try:
        yield ego
    finally:
        ego.close()


Episode = Callable[[Ego], list[Any]]


@pytest.mark.parametrize("step", [1, 2])
def test_an_answer_too_many_is_a_fault_of_the_episode_that_asked(
    here: Path, scene: Scene, episode: Episode, step: int
) -> None:
    """Written late, it stands for the next answer, or waits for the next episode."""
    with started(scene, f"step {step}") as ego:
        said = r"at 0\.20 s \(end\): answered more often than it was asked: '{\"acceleration\": "
        with pytest.raises(EgoError, match=said):
            episode(ego)
        assert episode(ego) == GOOD


def test_an_answer_that_names_its_step_is_found_out_at_once(
    here: Path, scene: Scene, episode: Episode
) -> None:
    """The late second answer to step 1 comes when step 2 was asked for."""
    with started(scene, "step 1", "named") as ego:
        with pytest.raises(EgoError, match=r"at 0\.20 s: answered step 1 when asked for step 2"):
            episode(ego)
        assert episode(ego) == GOOD


def test_who_names_the_steps_is_reset_once_an_episode(
    here: Path, scene: Scene, episode: Episode
) -> None:
    """Without the names there is one more reset at the end, with the same seed."""
    for words, resets in ((["none"], 4), (["none", "named"], 2)):
        (here / "resets").unlink(missing_ok=True)
        with started(scene, *words) as ego:
            assert [episode(ego), episode(ego)] == [GOOD, GOOD]
        assert len((here / "resets").read_text().split()) == resets


def test_a_late_answer_with_a_name_is_no_fault_of_the_next_episode(
    here: Path, scene: Scene, episode: Episode
) -> None:
    """It comes when the next one is reset; that begins in a new conversation and is as it was."""
    with started(scene, "step 2", "named") as ego:
        assert [episode(ego), episode(ego)] == [GOOD, GOOD]
        assert "was written before this episode; begun anew" in ego.take_log()


def test_what_is_written_between_two_episodes_is_no_fault_of_either(
    here: Path, scene: Scene, episode: Episode
) -> None:
    """The next one begins in a new conversation, and the log says why."""
    with started(scene, "between") as ego:
        assert episode(ego) == GOOD
        assert ego.take_log() == ""
        (here / "concluded").touch()
        while not (here / "written").exists():
            pass
        assert episode(ego) == GOOD
        assert """[cavsumo: '{"acceleration": 9}""" in ego.take_log()


def test_who_always_writes_too_much_is_refused_in_the_end(
    here: Path, scene: Scene, episode: Episode
) -> None:
    """A new conversation is tried once."""
    with started(scene, "greets") as ego:
        for _ in range(2):
            with pytest.raises(EgoError, match=r"at 0\.00 s \(reset\): "):
                episode(ego)


def test_an_end_between_two_episodes_belongs_to_the_next(
    here: Path, scene: Scene, episode: Episode
) -> None:
    """All answers of the first were there when it ended."""
    with started(scene, "dies") as ego:
        assert episode(ego) == GOOD
        with pytest.raises(EgoError, match=r"\(reset\): ended with status 1 \(no second episode\)"):
            episode(ego)
        assert episode(ego) == GOOD


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (b'{"step": 4, "acceleration": 1}', "answered step 4 when asked for step 3"),
        (b'{"step": "3", "acceleration": 1}', "answered step '3' when asked for step 3"),
        (b'{"step": null, "acceleration": 1}', "answered step None when asked for step 3"),
    ],
)
def test_another_step_is_no_answer(line: bytes, words: str) -> None:
    """Numbers only, and the right one."""
    assert protocol.answer(b'{"step": 3, "acceleration": 1}', 3) == (Acceleration(1.0), True)
    assert protocol.answer(b'{"acceleration": 1}', 3) == (Acceleration(1.0), False)
    with pytest.raises(EgoError, match=words):
        protocol.answer(line, 3)
    with pytest.raises(EgoError, match="answered step True when asked for step 1"):
        protocol.answer(b'{"step": true, "acceleration": 1}', 1)


def _serve(listening: socket.socket) -> None:
    """Answer one batch; once, behind the answer to step 5, comes a second one later."""
    spoilt = False
    while True:
        try:
            connection, _ = listening.accept()
        except OSError:
            return
        with connection, connection.makefile("r") as lines:
            late = b""
            for line in lines:
                message = json.loads(line)
                answers = {"hello": {"type": "hello", "version": 1}, "reset": {"type": "ready"}}
                reply = answers.get(message["type"], {"acceleration": 0})
                if message["type"] != "close":
                    connection.sendall(late + json.dumps(reply).encode() + b"\n")
                late = b""
                if message.get("step") == 5 and not spoilt:
                    spoilt, late = True, b'{"acceleration": 0}\n'


def test_in_a_batch_the_row_of_the_episode_is_the_error(
    networks: dict[str, Path], here: Path
) -> None:
    """A server's second answer, at a port: the first row, and no other."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        server = threading.Thread(target=_serve, args=(listening,), daemon=True)
        server.start()
        words = ["run", "-n", str(networks["pedestrians"]), "-q", "-o", "r.csv", "--runs", "3"]
        words += "-r none --agent noop --testers 1 --end 0.6 --trace none".split()
        words += ["--ego", f"tcp:127.0.0.1:{listening.getsockname()[1]}"]
        assert main(words) == 3
    outcomes = [row["outcome"] for row in rows(here / "r.csv")]
    assert outcomes == ["error", "not_triggered", "not_triggered"]
    assert "acceleration" in rows(here / "r.csv")[0]["error"]
    assert traces(here / "r.csv") == {}
