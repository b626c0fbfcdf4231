"""The trained tester that comes with cavsumo, and the example that trained it."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from support import ROOT, rows

from cavsumo.agents.observations import entries
from cavsumo.agents.policy_file import read_policy
from cavsumo.cli import main
from cavsumo.results.statistics import Rate, rate

EXAMPLE = ROOT / "examples" / "train_tester"
TESTER = EXAMPLE / "tester.npz"
pytestmark = pytest.mark.usefixtures("inline")


def test_the_trained_tester_beats_the_random_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On the same 30 seeds that training did not see the intervals lie apart. No torch needed."""
    monkeypatch.chdir(ROOT)
    agent = f"policy:{TESTER.relative_to(ROOT)}"
    words = ["--agent", agent, "--agent", "random", "--runs", "30", "--seed", "7"]
    output = ["-o", str(tmp_path / "results.csv"), "--trace", "none", "-q", "--exit-zero"]
    assert main(["run", "-n", "networks/crossing.net.xml", *words, *output]) == 0

    def found(name: str) -> Rate:
        mine = [row for row in rows(tmp_path / "results.csv") if row["agent"] == name]
        return rate(sum(row["outcome"] in ("held", "violated") for row in mine), len(mine))

    trained, random = found(agent), found("random")
    assert trained.total == random.total == 30
    assert trained.low > random.high, (trained, random)  # type: ignore[operator]


def test_the_trained_tester_is_small() -> None:
    """A few kilobytes of numbers, and it says where it comes from."""
    assert TESTER.stat().st_size < 100_000
    assert read_policy(TESTER).header.metadata["trained on"] == "crossing.net.xml"


@pytest.fixture
def export(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The example's exporter, where stable-baselines3 is installed."""
    pytest.importorskip("stable_baselines3")
    spec = importlib.util.spec_from_file_location("export", EXAMPLE / "export.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_an_exported_policy_says_what_the_model_says(export: ModuleType) -> None:
    """On two hundred observations the scores agree to 1e-5, and so does the choice."""
    import gymnasium
    from stable_baselines3 import DQN
    from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

    table = entries(1, 1.4, 0.6)
    low, high = (np.array([e[i] for e in table], dtype=np.float32) for i in (1, 2))

    class Still(gymnasium.Env[np.ndarray, np.int64]):
        observation_space = gymnasium.spaces.Box(low, high)
        action_space = gymnasium.spaces.Discrete(5)

        def reset(self, *, seed=None, options=None):  # type: ignore[no-untyped-def]
            super().reset(seed=seed)
            return low, {}

    rng = np.random.default_rng(3)
    normaliser = VecNormalize(DummyVecEnv([Still]), norm_reward=False)
    normaliser.obs_rms.mean = rng.uniform(low, high)
    normaliser.obs_rms.var = rng.uniform(0.01, 9.0, len(table))
    normaliser.obs_rms.mean[-3:], normaliser.obs_rms.var[-3:] = high[-3:], 1e-9  # nobody else
    model = DQN("MlpPolicy", normaliser, policy_kwargs={"net_arch": [64, 64]}, seed=1, device="cpu")
    policy = export.exported(model, normaliser, 5, {})
    for _ in range(200):
        seen = rng.uniform(low, high).astype(np.float32)
        seen[-3:] = high[-3:]
        normal = normaliser.normalize_obs(seen[None])
        scores = model.q_net(model.policy.obs_to_tensor(normal)[0]).detach().numpy()[0]
        assert policy.outputs(seen) == pytest.approx(scores, abs=1e-5)
        others = seen.copy()
        others[-3:] = rng.uniform(low, high)[-3:]
        assert policy.outputs(others) == pytest.approx(scores, abs=1e-5), "others count for nothing"
        assert policy.targets(seen) == [int(model.predict(normal, deterministic=True)[0][0])]


def test_the_example_trains(tmp_path: Path) -> None:
    """A few decisions, from the environment to a policy file, a curve and its picture."""
    pytest.importorskip("stable_baselines3")
    net = ROOT / "networks" / "crossing.net.xml"
    few = ["--decisions", "30", "--every", "30", "--evaluations", "1"]
    done = subprocess.run(
        [sys.executable, str(EXAMPLE / "train.py"), "--net", str(net), "-o", "tester.npz", *few],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert "cavsumo run --net" in done.stdout
    made = sorted(file.name for file in tmp_path.iterdir())
    assert made == ["tester.csv", "tester.npz", "tester.svg"]
    assert read_policy(tmp_path / "tester.npz").header.metadata["decisions"] == 30
    assert len((tmp_path / "tester.csv").read_text().splitlines()) == 2
