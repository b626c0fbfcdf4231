"""docs/environments.md keeps its word: its tables are the code's, its examples run."""

from __future__ import annotations

import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from support import ROOT

from cavsumo.agents import observations
from cavsumo.envs import ego_observations, ego_rewards, events, tester
from cavsumo.envs.ego import EgoEnv
from cavsumo.envs.parallel import CavsumoParallelEnv
from cavsumo.envs.puppets import PuppetEgo
from cavsumo.model.bodies import CAR, PEDESTRIAN
from cavsumo.simulation import rewards

PAGE = (ROOT / "docs" / "environments.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


def rows(section: str) -> list[list[str]]:
    """The cells of a table, without its head."""
    lines = [line for line in section.splitlines() if line.startswith("| `")]
    return [[cell.strip().strip("`") for cell in line.strip("|").split("|")] for line in lines]


@pytest.mark.parametrize("which", ["tester", "ego"])
def test_the_tables_of_observations_are_the_codes(which: str) -> None:
    """Every entry with its bounds, in its order; indices become letters."""
    found = re.search(rf"<!-- {which} entries -->(.*?)<!-- end -->", PAGE, re.DOTALL)
    assert found
    documented = [(name, float(low), float(high)) for name, _, low, high, _ in rows(found[1])]
    if which == "tester":
        entries = observations.entries(1, PEDESTRIAN.v_max, CAR.steering_max)
    else:
        entries = ego_observations.entries(PuppetEgo().kind)
    letters = [
        (re.sub(r"^body\d+", "bodyI" if which == "tester" else "bodyK", name), low, high)
        for name, low, high in entries
    ]
    letters = [(re.sub(r"^path\d+", "pathD", name), low, high) for name, low, high in letters]
    code = [(n, pytest.approx(a, abs=0.005), pytest.approx(b, abs=0.005)) for n, a, b in letters]
    assert documented == list({name: (name, low, high) for name, low, high in code}.values())


def test_the_keywords_and_the_keys_of_info_are_all_told() -> None:
    """Every keyword of the three environments, every key of info."""
    told = {word for row in rows(PAGE) for word in re.findall(r"[a-z_]+", row[0])}
    for kind in (tester.TesterEnv, EgoEnv, CavsumoParallelEnv):
        keywords = set(inspect.signature(kind).parameters) - {"config", "settings"}
        assert keywords <= told
    assert set(events.KEYS) <= told


def test_the_numbers_of_the_rewards_are_the_codes() -> None:
    """What the page says is -1, +100 and so on."""
    assert (rewards.TIME_COST, rewards.ROAD_COST, rewards.GOAL) == (1.0, 1.0, 100.0)
    assert (ego_rewards.PROGRESS, ego_rewards.TIME_COST, ego_rewards.HARSH_COST) == (1, 1, 0.05)
    assert (ego_rewards.VIOLATION, ego_rewards.OFF_ROAD) == (100.0, 100.0)


@pytest.mark.parametrize("example", EXAMPLES, ids=range(len(EXAMPLES)))
def test_the_examples_run(example: str, tmp_path: Path) -> None:
    """Each in a Python of its own, from a checkout, with warnings as errors."""
    file = tmp_path / "example.py"
    file.write_text(example, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-W", "error::UserWarning", str(file)],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, done.stderr
