"""SUMO's drivers by the name of their car-following model: ``sumo:IDM`` and others.

Each is the ego ``sumo`` with that ``carFollowModel``. The models: Krauss 1998; Treiber, Hennecke,
Helbing 2000 (IDM); Salles, Kaufmann, Reuss 2020 (EIDM); Milanes, Shladover 2014 (ACC, CACC).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from cavsumo.egos.base import EGOS
from cavsumo.egos.sumo import SumoEgo
from cavsumo.errors import InputError


class SumoModelEgo(SumoEgo):
    """Base of the drivers whose name says the model.

    Attributes:
        model: SUMO's name of it.
    """

    model: ClassVar[str]

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        key: said for key, said in SumoEgo.PARAMETERS.items() if key != "carFollowModel"
    }

    def __init__(self, reaction_s: float | None = None, **attributes: Any) -> None:
        if "carFollowModel" in attributes:
            raise InputError(
                f"ego {self.name}: carFollowModel is in the name; expected --ego sumo for another"
            )
        super().__init__(self.model, reaction_s, **attributes)


@EGOS.register("sumo:Krauss")
class KraussEgo(SumoModelEgo):
    """Driven by SUMO: its default model, the fastest speed from which it can still stop."""

    name, model = "sumo:Krauss", "Krauss"


@EGOS.register("sumo:IDM")
class IdmEgo(SumoModelEgo):
    """Driven by SUMO: the Intelligent Driver Model."""

    name, model = "sumo:IDM", "IDM"


@EGOS.register("sumo:EIDM")
class EidmEgo(SumoModelEgo):
    """Driven by SUMO: IDM extended by errors of estimation and gentle starts."""

    name, model = "sumo:EIDM", "EIDM"


@EGOS.register("sumo:ACC")
class AccEgo(SumoModelEgo):
    """Driven by SUMO: adaptive cruise control."""

    name, model = "sumo:ACC", "ACC"


@EGOS.register("sumo:CACC")
class CaccEgo(SumoModelEgo):
    """Driven by SUMO: cooperative adaptive cruise control, ACC behind cars of another kind."""

    name, model = "sumo:CACC", "CACC"
