"""``cavsumo import-osm``: a network from an OpenStreetMap extract, by netconvert."""

from __future__ import annotations

import dataclasses
import gzip
import shlex
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from cavsumo import __version__
from cavsumo.cli.requests.import_osm import ImportOptions, log_file
from cavsumo.cli.steps import SlowSteps, say_written
from cavsumo.errors import Exit, InputError
from cavsumo.network.facts import Facts, facts
from cavsumo.network.osm.extract import Box, RoadExtract, find_roads, parse_box, write_roads
from cavsumo.network.osm.handedness import Side, side, warning
from cavsumo.network.osm.netconvert import (
    ODBL,
    OSM_OPTIONS,
    in_comment,
    netconvert,
    netconvert_version,
    sumo_home,
    typemap_option,
    warning_summary,
    with_notice,
    zebra_patch,
)
from cavsumo.network.reader import read_network

EXTRACT, NET, PATCH, ZEBRA_NET = (
    "extract.osm.xml",
    "network.net.xml",
    "zebra.con.xml",
    "zebra.net.xml",
)
ZEBRA_OPTIONS = (
    f"sumo-net-file={NET}",
    f"connection-files={PATCH}",
    "output.street-names",
    "output.original-names",
    f"output-file={ZEBRA_NET}",
)


def import_osm(order: ImportOptions) -> int:
    """Make the network; files are written only after success."""
    with SlowSteps() as steps:
        steps.begin(f"reading {order.source}")
        box = None if order.bbox is None else parse_box(order.bbox)
        roads = find_roads(order.source, box)
        found = side(roads.hints, box or roads.bounds or (0, 0, 0, 0))
        about = list(_about_side(found, order.left_hand))
        if order.left_hand is None:
            order = dataclasses.replace(order, left_hand=found.left and found.certain)
        steps.begin("making a network with netconvert")
        network, said, made = _converted(order, box, roads)
    log = log_file(order.output)
    _publish(order, network, "".join(f"{line}\n" for line in said), log)
    remarks = [*about, *(f"note: {note}" for note in made.notes)]
    for line in [*remarks, *warning_summary(said, log)]:
        print(line if line.startswith(" ") else f"cavsumo: {line}", file=sys.stderr)
    say_written([log])
    print(_what_was_made(order.output, made))
    return Exit.OK


def _converted(
    order: ImportOptions, box: Box | None, roads: RoadExtract
) -> tuple[str, list[str], Facts]:
    """The network, netconvert's output, and the facts of the network."""
    with tempfile.TemporaryDirectory(prefix="cavsumo-") as name:
        folder = Path(name)
        with (folder / EXTRACT).open("w", encoding="utf-8", newline="\n") as stream:
            write_roads(order.source, roads, stream)
        options = _options(order, box)
        said = netconvert([*options, typemap_option(str(sumo_home()))], folder, order.time_limit_s)
        said += _zebra(folder, order.time_limit_s) if order.zebra else []
        network = _with_notice((folder / NET).read_text(encoding="utf-8"), order, options)
        (folder / NET).write_text(network, encoding="utf-8", newline="\n")
        return network, said, facts(read_network(folder / NET))


def _about_side(found: Side, asked: bool | None) -> Iterator[str]:
    """The note about the side of the road, chosen or derived."""
    if asked is not None or not found.certain:
        about = warning(found, bool(asked))
        if about is not None:
            yield f"warning: {about}"
        elif asked is None:
            yield (
                f"note: {found.words}, but that is not certain: imported for right-hand traffic; "
                "--left-hand or --right-hand says which it is"
            )
    elif found.left:
        yield f"note: {found.words}: imported for left-hand traffic; --right-hand is the other side"


def _options(order: ImportOptions, box: Box | None) -> list[str]:
    """netconvert's options without the type maps, whose path differs between machines."""
    left_out = {"tls.discard-simple"} if order.keep_pedestrian_signals else set()
    return [
        f"osm-files={EXTRACT}",
        *(option for option in OSM_OPTIONS if option not in left_out),
        *(["lefthand"] if order.left_hand else []),
        *([f"keep-edges.in-geo-boundary={','.join(map(str, box))}"] if box else []),
        "aggregate-warnings=-1",  # every one of them is for the log
        f"output-file={NET}",
    ]


def _zebra(folder: Path, time_limit_s: float) -> list[str]:
    """Give the crossings without traffic lights priority; returns netconvert's output."""
    network = read_network(folder / NET)
    crossings = [
        (
            str(edge.getFromNode().getID()),
            network.crossed_by(edge),
            float(edge.getLanes()[0].getWidth()),
        )
        for edge in network.crossings()
        # A patch of a junction with traffic lights would make netconvert fail.
        if not str(edge.getFromNode().getType()).startswith("traffic_light")
    ]
    if not crossings:
        return []
    (folder / PATCH).write_text(zebra_patch(crossings), encoding="utf-8", newline="\n")
    said = netconvert(ZEBRA_OPTIONS, folder, time_limit_s)
    (folder / ZEBRA_NET).replace(folder / NET)
    return said


def _with_notice(network: str, order: ImportOptions, options: list[str]) -> str:
    """The network with its licence and how it was made, without names of this machine."""
    zebra = f"then netconvert {' '.join(ZEBRA_OPTIONS)}"
    words = [in_comment(order.source.name), *(f"bbox={order.bbox}" for _ in [order.bbox] if _)]
    words += [
        word
        for word, asked in (
            ("left-hand", order.left_hand),
            ("keep-pedestrian-signals", order.keep_pedestrian_signals),
            ("zebra", order.zebra),
        )
        if asked
    ]
    head = (
        f"{ODBL}\n\nMade by cavsumo {__version__} with netconvert {netconvert_version()}, each "
        "option with two hyphens before it:"
    )
    lines = [
        f"cavsumo import-osm {' '.join(words)}",
        f"netconvert {' '.join([*options, typemap_option('$SUMO_HOME')])}",
        *([zebra] if order.zebra else []),
    ]
    return with_notice(network, head, lines)


def _publish(order: ImportOptions, network: str, log_text: str, log: Path) -> None:
    """Write the network and its log, each atomically."""
    data = network.encode("utf-8")
    if order.output.suffix == ".gz":
        data = gzip.compress(data, mtime=0)
    if order.output.exists() and not order.overwrite and order.output.read_bytes() != data:
        raise InputError(
            f"output {str(order.output)!r}: is another network, perhaps edited by hand; replace it "
            "with --overwrite"
        )
    try:
        _write(log, log_text.encode("utf-8"))
        _write(order.output, data)
    except OSError as error:
        raise InputError(f"output {str(order.output)!r}: {error.strerror}") from error


def _write(file: Path, data: bytes) -> None:
    """Replace a file atomically: a reader sees the old one or the new one."""
    part = file.with_name(f".{file.name}.part")
    try:
        part.write_bytes(data)
        part.replace(file)
    finally:
        with suppress(OSError):
            part.unlink()


def _what_was_made(output: Path, made: Facts) -> str:
    """One line about the network, and the next commands."""
    name = shlex.quote(str(output))
    side = ", left-hand traffic" if made.left_hand else ""
    lights = f"{made.traffic_lights} traffic light{'' if made.traffic_lights == 1 else 's'}"
    return (
        f"{output}: {made.edges} edges, {made.crossings} crossings, {lights}, "
        f"{made.width_m:.0f} x {made.height_m:.0f} m{side}\n"
        f"       cavsumo inspect {name}\n"
        f"       cavsumo run --net {name}"
    )
