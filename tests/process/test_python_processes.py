"""The Python interface and processes: scripts, batches at the same time, objects in workers."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
from pathlib import Path

from own_objects import of_objects
from support import rows, traces, untold

import cavsumo
from cavsumo import Results
from cavsumo.api.results import TemporaryFolder


def test_importing_cavsumo_loads_nothing_heavy() -> None:
    """Neither numpy nor libsumo nor pandas, until a name is used; the names are listed."""
    heavy = "{'numpy', 'libsumo', 'pandas', 'pydantic', 'rich', 'cloudpickle'}"
    code = (
        f"import sys, cavsumo; found = {heavy} & set(sys.modules); assert not found, found\n"
        "assert set(cavsumo.__all__) <= set(dir(cavsumo))\n"
        "cavsumo.InputError; assert 'numpy' not in sys.modules\n"
        "from cavsumo import *; run, load, Scenario\n"
        "assert 'libsumo' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


def test_a_fork_leaves_the_temporary_folder_alone() -> None:
    """It is that of the process that played."""
    folder = TemporaryFolder()
    child = os.fork()
    if child == 0:
        folder.close()
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
    assert folder.path.is_dir()
    folder.close()
    assert not folder.path.exists()


def test_batches_at_the_same_time_do_not_end_each_other() -> None:
    """One that is over early ends its own processes only."""
    begun: list[Results] = []

    def play(runs: int) -> None:
        begun.append(cavsumo.run("pedestrians", routes="none", end=10.0, runs=runs))

    threads = [threading.Thread(target=play, args=(runs,)) for runs in (1, 15)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(map(len, begun)) == [1, 15]
    assert all(played.rows["error"].isna().all() for played in begun)


def test_a_script_needs_no_guard(tmp_path: Path) -> None:
    """Two processes play, with an ego of the script's, and the script itself runs once."""
    (tmp_path / "script.py").write_text(
        "import cavsumo\n"
        "print('once')\n"
        "class Keeper:\n"
        "    depart_speed = 5.0\n"
        "    def act(self, snapshot):\n"
        "        return cavsumo.Acceleration(max(-4.0, min(2.0, 6.0 - snapshot.ego.v)))\n"
        "played = cavsumo.run('pedestrians', ego=Keeper(), runs=4, jobs=2, end=2.0)\n"
        "print(len(played), played.rows['error'].isna().all())\n"
    )
    words = [sys.executable, "script.py"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert (done.stdout, done.stderr) == ("once\n4 True\n", "")


def test_objects_play_the_same_in_any_number_of_processes(tmp_path: Path) -> None:
    """They keep state, every episode has a fresh copy, and rows and files name them."""
    one, two = of_objects(), of_objects(jobs=2, output=tmp_path / "two.csv")
    assert untold(rows(one.file)) == untold(rows(two.file))
    assert list(traces(one.file).values()) == list(traces(two.file).values())
    assert one.rows["error"].isna().all()
    assert one.rows["agent"].tolist() == ["Sprinter", "Counting", "timing"] * 2
    assert re.fullmatch(r"object:Tiring@[0-9a-f]{12}", one.rows["ego"][0])
    assert re.match(r"object:apart@\w+=held object:Patient@\w+=held", one.rows["verdicts"][0])
    assert one.manifest["plan"]["agents"][0].startswith("Sprinter=object:Sprinter@")
    again = cavsumo.run(one.scenario, agents="timing", runs=1)
    assert again.objects == one.objects[2:]
    assert one.manifest["learned"]["Counting"] == [one.rows["steps"][[1, 4]].sum()] * 2
    kept = one.replay(4, recorded=True).frames
    assert one.replay(4).frames.equals(kept)
