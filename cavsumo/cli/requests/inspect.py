"""Options of the command inspect, checked before heavy imports."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cavsumo.cli.requests.files import check_picture
from cavsumo.errors import InputError
from cavsumo.model.named_networks import check_network, network_file
from cavsumo.network.network_file import root_of


@dataclass(frozen=True)
class InspectOptions:
    """Options of the command.

    Attributes:
        net: the network.
        junction: id of the only junction to show, None for the best.
        top: number of junctions to show.
        as_json: as JSON instead of a table.
        picture: file to draw the first junction into.
    """

    net: Path
    junction: str | None
    top: int
    as_json: bool
    picture: Path | None


def check_inspect(look: InspectOptions) -> None:
    """Refuse wrong numbers, names and files."""
    if look.top < 1:
        raise InputError(f"--top: expected at least 1, got {look.top}")
    check_picture("--picture", look.picture)
    check_network(look.net)
    root_of(network_file(look.net))
