"""Options of the command import-osm, checked before heavy imports."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cavsumo.cli.requests.files import check_folder
from cavsumo.errors import InputError
from cavsumo.network.osm.extract import parse_box
from cavsumo.network.osm.items import check_extract
from cavsumo.network.osm.netconvert import sumo_home

ENDINGS = (".net.xml", ".net.xml.gz")


@dataclass(frozen=True)
class ImportOptions:
    """Options of the command.

    Attributes:
        source: the extract.
        output: the network to write.
        bbox: west, south, east, north as written, or None for the whole extract.
        left_hand: traffic keeps left; None to decide by the extract.
        keep_pedestrian_signals: keep traffic lights that only stop cars for pedestrians.
        zebra: pedestrians have priority on crossings without traffic lights.
        overwrite: replace another network.
        time_limit_s: time limit of netconvert [s].
    """

    source: Path
    output: Path
    bbox: str | None
    left_hand: bool | None
    keep_pedestrian_signals: bool
    zebra: bool
    overwrite: bool
    time_limit_s: float


def check_import(order: ImportOptions) -> None:
    """Refuse a path that cannot become a network file, and a wrong extract."""
    output = order.output
    if not output.name.endswith(ENDINGS) or output.name in ENDINGS:
        raise InputError(f"output {str(output)!r}: expected a name that ends in .net.xml")
    check_folder("output", output)
    for file in (output, log_file(output)):
        if file.is_dir():
            raise InputError(f"output {str(output)!r}: its place is taken by a folder")
    sumo_home()
    if order.bbox is not None:
        parse_box(order.bbox)
    check_extract(order.source)


def log_file(output: Path) -> Path:
    """The log beside a network."""
    return output.with_name(output.name.removesuffix(".gz").removesuffix(".xml") + ".log")
