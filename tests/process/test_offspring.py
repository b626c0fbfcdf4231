"""Processes that hide from their parent, and folders of parents that were killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from support import alive, rows, until, workers_of

from cavsumo.cli.command_line import main
from cavsumo.model.own_folders import MARK, OwnFolder, sweep

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="other systems do not tell")

# Drives on, having left a daemon: forked twice, in a session of its own, its descriptors closed,
# signals ignored; by the first argument it also forgets its environment. Its number goes into the
# file "daemons". With a second one the ego kills the process that started it at step 3.
HAUNTED = r"""
import json, os, signal, sys, time

def daemon():
    if os.fork():
        return os.wait()
    os.setsid()
    if os.fork():
        os._exit(0)
    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        signal.signal(number, signal.SIG_IGN)
    os.closerange(0, 100)
    script = "import os, time; open('daemons', 'a').write(f'{os.getpid()}\\n'); time.sleep(600)"
    environment = {} if sys.argv[1] == "bare" else os.environ
    os.execve(sys.executable, [sys.executable, "-c", script], environment)

daemon()
while not os.path.exists("daemons") or not open("daemons").read().endswith("\n"):
    time.sleep(0.01)
for line in sys.stdin:
    message = json.loads(line)
    answers = {"hello": {"type": "hello", "version": 1}, "reset": {"type": "ready"}}
    if message.get("step") == 3 and sys.argv[2:] == ["murders"]:
        os.kill(os.getppid(), signal.SIGSEGV)
    if message.get("step") == 3 and sys.argv[2:] == ["waits"]:
        open("waiting", "w").close()
        time.sleep(600)
    if message["type"] == "close":
        open("closed", "w").close()
        break
    reply = {"step": message.get("step"), "acceleration": 0}
    print(json.dumps(answers.get(message["type"], reply)), flush=True)
"""
SHORT = "-r none --agent noop --testers 1 --end 1 --trace none --runs 1 -q -o r.csv".split()


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The working folder, with the haunted ego in it and its own folder for temporary files."""
    (tmp_path / "haunted.py").write_text(HAUNTED, encoding="utf-8")
    (tmp_path / "tmp").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "tmp"))
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    for pid in daemons(tmp_path):
        if alive(pid):
            os.kill(pid, signal.SIGKILL)


def daemons(folder: Path) -> list[int]:
    """The numbers of the daemons that were started."""
    file = folder / "daemons"
    return [int(line) for line in file.read_text().splitlines()] if file.exists() else []


def command(net: Path, *words: str) -> list[str]:
    """``cavsumo run`` with the haunted ego."""
    spec = f"exec:{sys.executable} haunted.py {' '.join(words)}"
    return ["run", "-n", str(net), "--ego", spec, *SHORT]


@pytest.mark.parametrize("environment", ["inherited", "bare"])
def test_daemons_of_an_ego_end_with_the_batch(
    networks: dict[str, Path], here: Path, environment: str
) -> None:
    """Also one that has forgotten its environment: the process that simulates adopts it."""
    assert main(command(networks["pedestrians"], environment)) == 0
    assert len(daemons(here)) == 1
    assert not any(alive(pid) for pid in daemons(here))
    assert list((here / "tmp").iterdir()) == []
    assert (here / "closed").exists(), "it is told that the batch is over"


def test_daemons_of_an_ego_end_with_a_process_that_crashes(
    networks: dict[str, Path], here: Path
) -> None:
    """Nobody adopts them then; the folder in their environment tells."""
    assert main(command(networks["pedestrians"], "inherited", "murders")) == 3
    assert "died of SIGSEGV" in rows(here / "r.csv")[0]["error"]
    assert daemons(here)
    assert not any(alive(pid) for pid in daemons(here))
    assert list((here / "tmp").iterdir()) == []


@pytest.mark.parametrize("environment", ["inherited", "bare"])
def test_daemons_of_an_ego_end_with_a_process_that_hangs(
    networks: dict[str, Path], here: Path, environment: str
) -> None:
    """It is killed, and its descendants before it."""
    words = [*command(networks["pedestrians"], environment, "waits"), "--deadline", "1"]
    assert main([*words, "--ego-param", "reply_s=60"]) == 3
    assert "no answer within 1 s, killed" in rows(here / "r.csv")[0]["error"]
    assert daemons(here)
    assert not any(alive(pid) for pid in daemons(here))


def test_daemons_end_with_a_check_of_their_ego(networks: dict[str, Path], here: Path) -> None:
    """check-ego starts egos in its own process too."""
    spec = f"exec:{sys.executable} haunted.py inherited"
    assert main(["check-ego", spec, "-n", str(networks["pedestrians"])]) == 0
    assert len(daemons(here)) > 1  # one that is ended at once may not have come to write its number
    assert not any(alive(pid) for pid in daemons(here))
    assert list((here / "tmp").iterdir()) == []


def test_what_a_killed_parent_leaves_is_swept_at_the_next_start(
    networks: dict[str, Path], here: Path
) -> None:
    """kill -9 in the middle of an episode: folders and the daemon stay, until somebody starts."""
    words = command(networks["pedestrians"], "inherited", "waits")
    line = [sys.executable, "-m", "cavsumo", *words, "--ego-param", "reply_s=600"]
    with subprocess.Popen(line) as process:
        until((here / "waiting").exists, "the ego waits")
        (worker,) = workers_of(process.pid)
        process.kill()
    until(lambda: not alive(worker), "the process that simulates is gone")
    (left,) = (here / "tmp").iterdir()
    assert left.name.startswith("cavsumo-worker-")
    assert alive(daemons(here)[0])
    (here / "tmp" / "cavsumo-worker-foreign").mkdir()  # of another program, or of version 0.1
    again = [sys.executable, "-m", "cavsumo", "run", "-n", str(networks["pedestrians"])]
    subprocess.run([*again, *SHORT[:-1], "s.csv"], check=True, timeout=120)
    assert [folder.name for folder in (here / "tmp").iterdir()] == ["cavsumo-worker-foreign"]
    assert not alive(daemons(here)[0])


def test_a_folder_in_use_is_left_alone(here: Path) -> None:
    """Before it is marked, while it is held, and by a process that runs beside."""
    where = here / "tmp"
    held = OwnFolder("worker")
    (where / "cavsumo-worker-new").mkdir()
    (where / "cavsumo-worker-link").symlink_to(here)
    sweep(where)
    assert {f.name for f in where.iterdir()} == {
        Path(held.name).name,
        "cavsumo-worker-new",
        "cavsumo-worker-link",
    }
    held.close()
    assert not Path(held.name).exists()
    (where / "cavsumo-worker-new" / MARK).touch()  # marked, and nobody holds it
    sweep(where)
    assert [f.name for f in where.iterdir()] == ["cavsumo-worker-link"]
    assert (here / "haunted.py").exists()


def test_sweeping_and_making_at_once_disturb_nobody(here: Path) -> None:
    """Folders are there as long as they are held, while others sweep all the time."""
    where, over = here / "tmp", threading.Event()

    def sweeping() -> None:
        while not over.is_set():
            sweep(where)

    threads = [threading.Thread(target=sweeping) for _ in range(3)]
    for thread in threads:
        thread.start()
    try:
        for _ in range(100):
            folder = OwnFolder("worker")
            assert (Path(folder.name) / MARK).exists()
            folder.close()
    finally:
        over.set()
        for thread in threads:
            thread.join()
    assert list(where.iterdir()) == []
