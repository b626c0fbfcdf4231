"""Drawn traffic is the same in any process."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from cavsumo import cli
from cavsumo.results.reading import read_manifest, read_rows

SHARES = """
import hashlib, sys
from cavsumo.model.scenario import plan_from
from cavsumo.batch.prepared import prepare
for name in sys.argv[2:]:
    site = prepare(plan_from({"net": name, "traffic": 12, "seed": int(sys.argv[1])}, "t")).site
    print(hashlib.sha256(site.demand.encode()).hexdigest())
"""


def run(folder: Path, monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    """The exit status of ``cavsumo run`` in a folder."""
    monkeypatch.chdir(folder)
    return cli.main(["run", "-q", "--exit-zero", "--trace", "none", *words])


def test_the_same_seed_gives_the_same_bytes_in_any_process(networks: dict[str, Path]) -> None:
    """Whatever Python's hash seed is; another seed gives other traffic."""

    def shares(seed: int, hashing: str) -> str:
        files = [str(networks[name]) for name in sorted(networks)]
        return subprocess.run(
            [sys.executable, "-c", SHARES, str(seed), *files],
            env=os.environ | {"PYTHONHASHSEED": hashing},
            capture_output=True,
            text=True,
            check=True,
            timeout=120,
        ).stdout

    first, again, other = shares(1, "1"), shares(1, "77"), shares(2, "1")
    assert first == again
    assert all(a != b for a, b in zip(first.split(), other.split(), strict=True))


@pytest.mark.slow
def test_rows_do_not_depend_on_the_processes(
    tmp_path: Path, networks: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One process or two, or resumed: the same rows, and the manifest knows the traffic."""
    net = ["--net", str(networks["crossing"]), "--traffic", "6,3"]
    assert run(tmp_path, monkeypatch, *net, "--runs", "2", "-o", "a.csv") == 0
    assert run(tmp_path, monkeypatch, *net, "--runs", "2", "-j", "2", "-o", "b.csv") == 0
    assert run(tmp_path, monkeypatch, *net, "--runs", "1", "-o", "c.csv") == 0
    assert run(tmp_path, monkeypatch, "--resume", "--runs", "2", "-o", "c.csv") == 0
    rows = [
        [{k: v for k, v in row.items() if k != "wall_s"} for row in read_rows(tmp_path / name)]
        for name in ("a.csv", "b.csv", "c.csv")
    ]
    assert rows[0] == rows[1] == rows[2]
    assert not any(row["error"] for row in rows[0])
    assert re.fullmatch("[0-9a-f]{64}", read_manifest(tmp_path / "a.csv")["sha256"]["traffic"])
