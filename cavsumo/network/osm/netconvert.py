"""SUMO's netconvert: the options that make a testable network of OpenStreetMap's roads.

The program comes with the package eclipse-sumo and runs unchanged, in a temporary folder.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
from collections import Counter
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from textwrap import shorten
from xml.sax.saxutils import quoteattr

from cavsumo.errors import InputError, plain
from cavsumo.network.osm.items import EXTRA

ODBL = (
    "Contains map data (c) OpenStreetMap contributors, available under the ODbL 1.0 "
    "(https://www.openstreetmap.org/copyright)"
)
# Options without their leading hyphens, which an XML comment cannot hold. Roads only: mapped
# footways would double the pavements that are guessed along every road.
TYPEMAPS = ("osmNetconvert", "osmNetconvertUrbanDe", "osmNetconvertPedestrians")
OSM_OPTIONS = (
    "geometry.remove",
    "roundabouts.guess",
    "junctions.join",
    "tls.guess-signals",
    "tls.discard-simple",
    "tls.join",
    "tls.default-type=static",
    "osm.sidewalks",
    "sidewalks.guess",
    "crossings.guess",
    "keep-edges.by-vclass=passenger",
    "remove-edges.by-type=highway.service,highway.track",
    "keep-edges.components=1",
    "no-turnarounds.except-deadend",
    "output.street-names",
    "output.original-names",
)
TIME_LIMIT_S = 600.0
KIND_WIDTH = 60  # characters of a kind of warning
SHOWN = 3  # kinds of warnings in a summary
# Explanations of its errors for a user who imports a map.
MEANINGS = {"No edges loaded.": "the extract holds no road that cars may use"}


def sumo_home() -> Path:
    """The folder of eclipse-sumo; raises InputError when it is not installed.

    Not imported: that would change the environment of this process, pyproj's included.
    """
    spec = find_spec("sumo")
    home = Path(spec.origin).parent if spec and spec.origin else None
    if home is None or not any((home / "bin").glob("netconvert*")):
        raise InputError(f"netconvert comes with the package eclipse-sumo: {EXTRA}")
    return home


def sumo_environment(home: Path) -> dict[str, str]:
    """The environment in which a program of eclipse-sumo finds its data."""
    proj = str(home / "data" / "proj")
    return {**os.environ, "SUMO_HOME": str(home), "PROJ_LIB": proj, "PROJ_DATA": proj}


def netconvert_version() -> str:
    """The version of the package that brings netconvert."""
    return version("eclipse-sumo")


def typemap_option(folder: str) -> str:
    """The option that names the type maps in a folder."""
    return "type-files=" + ",".join(f"{folder}/data/typemap/{name}.typ.xml" for name in TYPEMAPS)


def netconvert(
    options: Iterable[str], folder: Path, time_limit_s: float = TIME_LIMIT_S
) -> list[str]:
    """Run netconvert in a folder; returns the lines of its output, without machine paths.

    Raises InputError in one sentence when it refuses, crashes or takes too long.
    """
    home = sumo_home()
    command = [str(home / "bin" / "netconvert"), *(f"--{option}" for option in options)]
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            env=sumo_environment(home),
            capture_output=True,
            timeout=time_limit_s,
        )
    except subprocess.TimeoutExpired:
        raise InputError(
            f"netconvert was stopped after {time_limit_s:g} s: cut a smaller part with --bbox"
        ) from None
    except OSError as error:
        raise InputError(f"netconvert cannot be run: {plain(error)}") from error
    said = (done.stderr + done.stdout).decode("utf-8", "replace")
    lines = said.replace(str(home), "$SUMO_HOME").replace(f"{folder}{os.sep}", "").splitlines()
    if done.returncode != 0:
        raise InputError(_failure(done.returncode, lines))
    return [line for line in lines if line.strip() and line != "Success."]


def _failure(status: int, lines: Sequence[str]) -> str:
    """The reason why a run of netconvert gave no network, in one sentence."""
    number = -status if status < 0 else status - 128 if 128 < status <= 159 else 256 - status
    if status < 0 or status > 128:  # wrappers make 139 or 245 of -11
        try:
            name = signal.Signals(number).name
        except ValueError:
            name = f"status {status}"
        return (
            f"netconvert {netconvert_version()} crashed ({name}) on this extract: another --bbox "
            "may leave out what it cannot digest"
        )
    errors = [line.removeprefix("Error: ") for line in lines if line.startswith("Error: ")]
    reason = errors[0] if errors else f"status {status}"
    return f"netconvert made no network: {MEANINGS.get(reason, reason)}"


def warning_kinds(lines: Iterable[str]) -> Counter[str]:
    """The number of warnings of each kind: equal words around different ids and numbers."""
    kinds: Counter[str] = Counter()
    for line in lines:
        if line.startswith("Warning: "):
            kind = re.sub(r"'[^']*'|(?<![\w.])-?\d[\d.]*", "...", line.removeprefix("Warning: "))
            kinds[kind] += 1
    return kinds


def warning_summary(lines: Iterable[str], log: Path) -> list[str]:
    """netconvert's warnings in three lines, none for no warnings."""
    kinds = warning_kinds(lines)
    if not kinds:
        return []
    most = sorted(kinds, key=lambda kind: (-kinds[kind], kind))
    words = {kind: shorten(kind, KIND_WIDTH, placeholder=" ...") for kind in most}
    shown = " | ".join(f"{kinds[kind]} x {words[kind]}" for kind in most[:SHOWN])
    more = f" | {len(kinds) - SHOWN} other kinds" if len(kinds) > SHOWN else ""
    return [
        f"netconvert gave {kinds.total()} warnings of {len(kinds)} kinds, which is usual:",
        f"  {shown}{more}",
        f"  all of them: {log}",
    ]


def with_notice(network: str, head: str, lines: Iterable[str]) -> str:
    """A network with a notice in place of netconvert's comment, which has paths and a date."""
    comment = "\n    ".join([f"<!-- {head}", *lines]) + "\n-->"
    text, count = re.subn(r"<!--.*?-->", lambda _: comment, network, count=1, flags=re.DOTALL)
    if count != 1:
        raise ValueError("a network of netconvert begins with a comment")
    return text


def in_comment(word: str) -> str:
    """A word as an XML comment can hold it, without two hyphens in a row."""
    clean = "".join(c if c.isprintable() else "?" for c in word)
    return re.sub(r"-(?=-)", "- ", clean)


def zebra_patch(crossings: Iterable[tuple[str, Sequence[str], float]]) -> str:
    """A patch that gives crossings priority over cars: node, edges crossed and width [m]."""
    rows = (
        f"    <crossing node={quoteattr(node)} edges={quoteattr(' '.join(edges))}"
        f' width="{width:.2f}" priority="true"/>\n'
        for node, edges, width in crossings
    )
    return f"<connections>\n{''.join(rows)}</connections>\n"
