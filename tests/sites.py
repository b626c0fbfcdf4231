"""Constants that many tests need, each made once: sites of networks, encounters."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from support import ROOT

from cavsumo.network.site import Site, derive_site
from cavsumo.testing import assertion_checks
from cavsumo.testing.scripts import Others, ScriptNetwork, nobody

IMPORTED_BY = ("cavsumo.network.site_cache", "cavsumo.testing.scripts")


@contextmanager
def derived_once() -> Iterator[None]:
    """Have a site that was derived before, which is a constant, used again."""
    known: dict[tuple[Any, ...], Site] = {}

    def derived(net: Path, *wanted: Any) -> Site:
        if net.parent != ROOT / "networks":
            return derive_site(net, *wanted)
        key = net, *wanted
        if key not in known:
            known[key] = derive_site(net, *wanted)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        for name in IMPORTED_BY:
            patch.setattr(importlib.import_module(name), "derive_site", derived)
        yield


@contextmanager
def encounters_once() -> Iterator[None]:
    """Have the encounters that the assertions' contract shows made once for each ground."""
    known: dict[tuple[Any, ...], Any] = {}
    made = assertion_checks.encounter

    def encounter(ground: ScriptNetwork, seed: int, others: Others = nobody) -> Any:
        key = ground.site.net, ground.dt, seed, others
        if key not in known:
            known[key] = made(ground, seed, others)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(assertion_checks, "encounter", encounter)
        yield
