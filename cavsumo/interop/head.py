"""The part of a trace that goes into files of others as plain text beside the tracks.

It holds the settings, the verdict, the checksums, and the quantities for which a format has no
place (the ego's steering angle, the lights on its route), so that the file can be imported again;
the tracks are those of the file. It names files without their folders.
"""

from __future__ import annotations

from pathlib import PurePath
from typing import Any

from cavsumo.results.traces import Trace

HEAD = "cavsumo.head"
FILES = ("net", "routes")
KEPT = ("row", "plan", "sha256", "versions", "sumo_options", "starts")


def head_of(trace: Trace, way: str) -> dict[str, Any]:
    """The settings of an episode; ``way``: as recorded or as a test."""
    head = {key: trace.head[key] for key in KEPT if key in trace.head}
    scenario = dict(head["plan"]["scenario"])
    scenario |= {key: PurePath(scenario[key]).name for key in FILES if scenario.get(key)}
    scenario["additional"] = [PurePath(file).name for file in scenario.get("additional", ())]
    head["plan"] = {**head["plan"], "scenario": scenario}
    head["sha256"] = {PurePath(name).name: sha for name, sha in head["sha256"].items()}
    frames = {"steering": [frame["steering"] for frame in trace.frames]}
    if any(frame.get("lights") for frame in trace.frames):
        frames["lights"] = [frame.get("lights", "") for frame in trace.frames]
    return {"way": way, "frames": frames, **head}
