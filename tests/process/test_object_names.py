"""Names of objects in fresh Pythons."""

from __future__ import annotations

import subprocess
import sys

from own_objects import DEFINED


def test_a_name_is_the_same_in_every_session() -> None:
    """Whatever order Python keeps its sets in, and however often an object was named before."""
    code = (
        "from cavsumo.model.objects import sent\n"
        + DEFINED.format(limit=3)
        + "print(sent(Careful()).name, sent(Careful()).name, sent(lambda x: x).name)"
    )
    said = [
        subprocess.run(
            [sys.executable, "-c", code],
            env={"PYTHONHASHSEED": seed, "PYTHONPATH": ":".join(sys.path)},
            capture_output=True,
            text=True,
            check=True,
            timeout=120,
        ).stdout
        for seed in ("1", "2")
    ]
    assert said[0] == said[1]
    assert said[0].split()[0] == said[0].split()[1]
