"""An ego as a program that reads a file and writes to others, and batches with it."""

from __future__ import annotations

import sys
from pathlib import Path

from cavsumo.cli import main

# Drives on. It reads the file that its first argument names and writes to those of the others: to
# "start*" as it starts (and empties it first), to "log*" in each episode, to "once*" in the first.
WRITER = r"""
import json, os, sys

read, *names = sys.argv[1:]
gain = float(open(read).read())
for name in names:
    if name.startswith("start"):
        open(name, "w").write(f"{os.getpid()}\n")
for line in sys.stdin:
    message = json.loads(line)
    answers = {"hello": {"type": "hello", "version": 1}, "reset": {"type": "ready"}}
    if message["type"] == "reset":
        for name in names:
            if name.startswith("log") or (name.startswith("once") and not os.path.exists("did")):
                open(name, "a").write(f"{os.getpid()}\n")
        open("did", "w").close()
    if message["type"] == "close":
        break
    reply = {"step": message.get("step"), "acceleration": gain}
    print(json.dumps(answers.get(message["type"], reply)), flush=True)
"""
SHORT = "-r none --agent noop --testers 1 --end 1 --trace all -q".split()
NAMES = ["start.txt", "log.txt", "once.txt"]
EGO = f"exec:{sys.executable} writer.py gain.txt {' '.join(NAMES)}"


def writer_in(folder: Path) -> Path:
    """The folder, with the program and what it reads."""
    (folder / "writer.py").write_text(WRITER, encoding="utf-8")
    (folder / "gain.txt").write_text("0.0")
    return folder


def run(net: Path, *words: str, output: str = "r.csv") -> int:
    """``cavsumo run`` with that ego."""
    return main(["run", "-n", str(net), "--ego", EGO, *SHORT, "-o", output, *words])
