"""Scripts of benchmarks/, played in the process of a test."""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from support import ROOT

from cavsumo.assertions import ASSERTIONS

Play = Callable[..., str]


@contextmanager
def scripts(patch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Iterator[Play]:
    """Call with a benchmark, its words and values of its constants: what it prints."""
    patch.syspath_prepend(str(ROOT / "benchmarks"))
    own = set(ASSERTIONS)
    loaded: list[str] = []

    def played(name: str, *words: str, **constants: Any) -> str:
        patch.delitem(sys.modules, name, raising=False)
        module = importlib.import_module(name)
        loaded.append(name)
        for constant, value in constants.items():
            assert hasattr(module, constant)
            patch.setattr(module, constant, value)
        patch.setattr(sys, "argv", [f"{name}.py", *words])
        module.main()
        return capsys.readouterr().out

    yield played
    for name in set(ASSERTIONS) - own:  # a benchmark may register one
        del ASSERTIONS._entries[name]
        ASSERTIONS.names._others.discard(name)
    for name in loaded:
        sys.modules.pop(name, None)


def numbers(line: str) -> list[float]:
    """The numbers in a line."""
    return [float(word) for word in re.findall(r"-?\d+\.?\d*(?:e[-+]\d+)?", line)]
