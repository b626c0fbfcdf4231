"""Classes of egos against which a game can be won: the actions that each permits.

No class lets an ego stand still for ever. One that does can keep its reaction zone, which has no
length at speed 0, off every body, so nothing could be forced against it.
"""

from __future__ import annotations

from collections.abc import Mapping

EGO_CLASSES: Mapping[str, str] = {
    "constant": "keeps its speed",
    "unaware": "keeps its speed until a tester is on the carriageway, then as any",
    "any": "brakes and accelerates as it likes within limits, but never stops",
}
