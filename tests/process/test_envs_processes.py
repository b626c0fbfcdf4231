"""Environments in processes of their own, and the package in a fresh Python."""

from __future__ import annotations

import math
import subprocess
import sys
import warnings
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv
from support import SHORT

from cavsumo.errors import AgentError, SimulationError

IDS = ("cavsumo/Tester-v0", "cavsumo/Ego-v0")
Make = Callable[..., Any]


def test_importing_or_naming_the_package_registers_the_environments() -> None:
    """In a fresh Python: by import, and by ``module:id`` alone."""
    code = (
        "import gymnasium, sys\n"
        f"env = gymnasium.make('cavsumo.envs:cavsumo/Tester-v0', **{SHORT!r})\n"
        "env.reset(seed=1); env.close()\n"
        "import importlib; importlib.reload(sys.modules['cavsumo.envs'])\n"
        "print([name for name in gymnasium.registry if 'cavsumo' in name])\n"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error::UserWarning", "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.stdout.strip() == str(list(IDS)), done.stderr


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_environments_play_side_by_side_in_processes(method: str, make: Make) -> None:
    """One simulation a process: same seeds give the same bits, here and there, others do not."""
    single = make()
    first, _ = single.reset(seed=3)  # a child that is forked now must not harm this one
    action = np.full(6, 0.5, dtype=np.float32)
    second = single.step(action)[0]
    makers = [lambda: gymnasium.make("cavsumo.envs:cavsumo/Tester-v0", **SHORT)] * 2
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # newer Pythons warn of fork itself
        vector = AsyncVectorEnv(makers, context=method)
    try:
        shown, info = vector.reset(seed=[3, 4])
        assert np.array_equal(shown[0], first)
        assert not np.array_equal(shown[0], shown[1])
        assert info["seed"].tolist() == [3, 4]
        assert np.array_equal(vector.step(np.stack([action, action]))[0][0], second)
    finally:
        vector.close()
    single.step(action)


def test_processes_of_their_own_keep_environments_apart(make: Make) -> None:
    """Stepped in turns both show what one alone shows; a crash ends an episode, not the program."""
    here, one, other = make(), make(process="own"), make(process="own")
    action = np.full(6, 0.25, dtype=np.float32)
    here.reset(seed=2)
    alone = [here.step(action) for _ in range(3)]
    one.reset(seed=2)
    other.reset(seed=3)
    for step in alone:
        shown, reward, *_ = one.step(action)
        assert np.array_equal(shown, step[0])
        assert reward == step[1]
        assert not np.array_equal(other.step(action)[0], step[0])
    with pytest.raises(AgentError, match="finite"):
        one.step(np.full(6, math.nan))
    one.unwrapped._play.episodes._child._process.kill()
    with pytest.raises(SimulationError, match="died of signal 9; reset starts another"):
        one.step(action)
    one.reset(seed=2)
    assert np.array_equal(one.step(action)[0], alone[0][0])
