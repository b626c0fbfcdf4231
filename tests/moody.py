"""An ego as a program that does what it should not, when it is told to."""

from __future__ import annotations

import sys
from pathlib import Path

# Drives on, and at step 3 of an episode does what it was told to, or takes turns with what the file
# "faults" lists, until that is empty. Its numbers go into the file "pids".
MOODY = r"""
import json, os, signal, sys, time
from pathlib import Path

fault = sys.argv[1]
with open("pids", "a") as file:
    print(os.getpid(), file=file)
faults = Path("faults")

def say(text):
    os.write(1, text.encode())

ANSWERS = {
    "garbage": "hello?\n",
    "list": "[1.0]\n",
    "keys": '{"accel": 1}\n',
    "nan": '{"acceleration": NaN}\n',
    "infinite": '{"acceleration": Infinity}\n',
    "too much": '{"acceleration": 9.5}\n',
    "drive": '{"throttle": 0, "steering": 0}\n',
    "gives up": '{"error": "lost my map"}\n',
    "twice": '{"acceleration": 0}\n{"acceleration": 1}\n',
    "long": "x" * 10_000_000 + "\n",
    "late": '{"acceleration": 0}\n',
}

def misbehave():
    if fault == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    elif fault == "stopped":
        os.kill(os.getpid(), signal.SIGSTOP)
    elif fault == "exits":
        print("\n  no GPU found  \n", file=sys.stderr)
        sys.exit(3)
    elif fault == "silent":
        time.sleep(3600)
    elif fault == "closed":
        os.close(1)
        time.sleep(3600)
    elif fault == "floods":
        while True:
            os.write(2, b"x" * 65536)
    say(ANSWERS[fault])
    if fault == "late":
        say('{"acceleration": 1}\n')

for line in sys.stdin:
    message = json.loads(line)
    if message["type"] == "hello":
        if fault == "is mute":
            time.sleep(3600)
        version = 2 if fault == "speaks 2" else 1
        say(json.dumps({"type": "hello", "version": version}) + "\n")
    elif message["type"] == "reset":
        say('{"type": "ready"}\n')
    elif message["type"] == "observation":
        if message["step"] == 3 and faults.exists():
            fault, *rest = [*faults.read_text().split(), "none"]
            faults.write_text(" ".join(rest[:-1]))
        if message["step"] == 3 and fault != "none":
            misbehave()
        else:
            say('{"acceleration": 0}\n')
    else:
        Path("closed").touch()
        break
"""

FAULTS = [
    ("killed", "died of SIGKILL"),
    ("exits", r"ended with status 3 \(no GPU found\)"),
    ("stopped", "gave no answer within 0.5 s"),
    ("silent", "gave no answer within 0.5 s"),
    ("floods", "gave no answer within 0.5 s"),
    ("closed", "closed its stdin or stdout"),
    ("garbage", r"answered 'hello\?', expected a line of JSON"),
    ("list", r"answered '\[1.0\]', expected a JSON object"),
    ("keys", ".* expected either acceleration or throttle and steering"),
    ("nan", r"acceleration must lie in \[-9, 9\], got nan"),
    ("infinite", r"acceleration must lie in \[-9, 9\], got inf"),
    ("too much", r"acceleration must lie in \[-9, 9\], got 9.5"),
    ("drive", r"changed from Acceleration to Drive\(.*"),
    ("gives up", "gave up: 'lost my map'"),
    ("twice", """wrote '{"acceleration": 1}.*' after its answer"""),
    ("long", "answered with a line longer than 65536 bytes"),
]


def line(fault: str) -> str:
    """The ego's name, for a folder with moody.py in it."""
    return f"exec:{sys.executable} moody.py '{fault}'"


def pids(folder: Path) -> list[int]:
    """The numbers of the moody egos that were started."""
    file = folder / "pids"
    return [int(line) for line in file.read_text().splitlines()] if file.exists() else []


def edit(file: Path, old: str, new: str) -> None:
    """Put some text in the place of another."""
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")
