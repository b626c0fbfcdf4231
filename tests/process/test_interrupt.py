"""Ctrl-C keeps what ran."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path


def test_an_interrupt_keeps_what_ran(networks: Mapping[str, Path], tmp_path: Path) -> None:
    """Interrupted after some rows: exit 130, whole rows, a manifest that says so, nobody left."""
    words = ["run", "-n", str(networks["crossing"]), "--runs", "100000", "-q"]
    process = subprocess.Popen([sys.executable, "-m", "cavsumo", *words], cwd=tmp_path)
    try:
        results = tmp_path / "results.csv"
        for _ in range(600):
            if results.is_file() and results.read_bytes().count(b"\n") > 3:
                break
            time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=30) == 130
    finally:
        process.kill()
    text = results.read_text(encoding="utf-8")
    assert text.endswith("\n")
    manifest = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert manifest["status"] == "interrupted"
    assert manifest["episodes"] == text.count("\n") - 1


def test_an_agent_that_cannot_drive_is_given_no_vehicle(
    networks: Mapping[str, Path], tmp_path: Path
) -> None:
    """Q-learning learns where to walk: with cars it is refused in one sentence."""
    words = ["run", "-n", str(networks["crossing"]), "--kind", "car", "--agent", "q-learning"]
    done = subprocess.run(
        [sys.executable, "-m", "cavsumo", *words], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 2
    assert "can only walk" in done.stderr
