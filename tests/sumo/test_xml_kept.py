"""SUMO's XML parser, which stays set up from one start of SUMO to the next."""

from __future__ import annotations

import libsumo
import pytest

from cavsumo.sumo import native
from cavsumo.sumo.native import keep_xml


def test_another_build_of_libsumo_goes_on_as_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    """One whose parser has other names."""
    monkeypatch.setattr(native, "SET_UP_XML", "other")
    keep_xml.__wrapped__(libsumo)
