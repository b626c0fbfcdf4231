"""A test as one file, ``.cavtest``: a zip with a trace, the files it is played from, and a page.

==================  ===============================================================================
test.json           format, sentence, and how the test was made smaller
trace.jsonl.gz      the trace (``results.traces``): scenario, starts, actions, departures, verdict
inputs/NAME.gz      network, routes, ..., as beside results (``results.inputs``)
page.html           the replay page
==================  ===============================================================================

The bytes depend on the content alone. Files come from strangers: nothing but these names is read,
each up to a size. An ego or an assertion that the trace names is used as ``batch.trust`` says, and
SUMO gets no input that may name files (``strangers``).
"""

from __future__ import annotations

import dataclasses
import hashlib
import io
import json
import stat
import zipfile
import zlib
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cavsumo.batch.located import located
from cavsumo.batch.replay import Record, recorded_alone
from cavsumo.errors import InputError, ResultsError, shown
from cavsumo.kept.names import CAVTEST
from cavsumo.kept.strangers import check_inputs
from cavsumo.model.checksums import checksum
from cavsumo.model.documents import json_of
from cavsumo.model.own_folders import OwnFolder, process_folder
from cavsumo.results.inputs import FOLDER, KEPT, LARGEST, keep, kept_name
from cavsumo.results.present import input_files
from cavsumo.results.trace_file import packed
from cavsumo.results.traces import Trace, trace_text

FORMAT = "cavsumo-test-1"
ABOUT, TRACE, PAGE = "test.json", "trace.jsonl.gz", "page.html"
MOST_B: Mapping[str, int] = {ABOUT: 1 << 20, TRACE: 1 << 27, PAGE: 1 << 27}
MOST_ALL_B = LARGEST  # bytes of all members together
MOST_MEMBERS = 100
BEGINNING = (1980, 1, 1, 0, 0, 0)  # the earliest time that a zip can tell
LEVEL = 6
CHUNK = 1 << 20


@dataclass(frozen=True)
class KeptTest:
    """A test from its file.

    Attributes:
        record: the episode, with the present paths of its files.
        about: what ``test.json`` says.
    """

    record: Record
    about: Mapping[str, Any]

    @property
    def sentence(self) -> str:
        """The test in words."""
        return str(self.about.get("sentence", ""))


def is_cavtest(file: Path) -> bool:
    """Whether this is the name of a kept test."""
    return file.name.endswith(CAVTEST)


def write_cavtest(file: Path, record: Record, page: str, about: Mapping[str, Any]) -> None:
    """Write a test; raises InputError when that is not possible, and leaves nothing half-written.

    Args:
        record: with its trace, and the present paths of its files.
        page: of the test.
        about: what to say of it beside its format.
    """
    data = _zipped(record, page, {"format": FORMAT, **about})
    new = file.with_name(f".{file.name}.new")
    try:
        new.write_bytes(data)
        new.replace(file)
    except OSError as error:
        new.unlink(missing_ok=True)
        raise InputError(f"test {str(file)!r}: cannot be written: {error.strerror}") from error


def _zipped(record: Record, page: str, about: Mapping[str, Any]) -> bytes:
    """The bytes of a test."""
    assert record.trace is not None
    members: dict[str, bytes] = {
        ABOUT: (json.dumps(about, indent=1, sort_keys=True) + "\n").encode(),
        TRACE: packed(_text(record.trace)),
        PAGE: page.encode("utf-8", "backslashreplace"),
        **_inputs(record),
    }
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w") as archive:
        for name in sorted(members):
            info = zipfile.ZipInfo(name, BEGINNING)
            info.create_system = 3  # as on Unix, also elsewhere
            info.external_attr = (stat.S_IFREG | 0o644) << 16
            again = name.endswith(".gz")
            info.compress_type = zipfile.ZIP_STORED if again else zipfile.ZIP_DEFLATED
            archive.writestr(info, members[name], compresslevel=LEVEL)
    return whole.getvalue()


def _text(trace: Trace) -> str:
    """The text of a trace."""
    return trace_text(trace.head, "".join(json.dumps(frame) + "\n" for frame in trace.frames))


def _inputs(record: Record) -> dict[str, bytes]:
    """The files that a test is played from, compressed as beside results."""
    found: dict[str, bytes] = {}
    own = OwnFolder("test")
    try:
        folder = Path(own.name)
        sums = dict(record.origin.get("sha256") or {})
        for name, file in input_files(record.plan).items():
            if name not in sums:
                continue
            if checksum(file) != sums[name]:
                raise InputError(f"{str(file)!r}: is another file than that of the episode")
            if not keep(folder, file, sums[name]):
                raise InputError(f"{str(file)!r}: has more than {LARGEST // 2**20} MiB")
            kept = kept_name(file, sums[name])
            found[f"{FOLDER}/{kept}"] = (folder / kept).read_bytes()
    finally:
        own.close()
    return found


# Opened


def read_cavtest(file: Path, allowed: Collection[str] | None = ()) -> KeptTest:
    """The test in a file; raises ResultsError in one sentence for one that is damaged or foreign.

    ``allowed``: the external egos and assertions that it may use; None for all (``batch.trust``),
    and for inputs with which SUMO does more than to simulate (``strangers``).
    """
    folder = unpacked(file)
    about = _about(file, folder)
    record = located(recorded_alone(folder / TRACE, allowed, anew=False))
    if allowed is not None:
        check_inputs(record, file)
    return KeptTest(dataclasses.replace(record, file=file), about)


def _about(file: Path, folder: Path) -> dict[str, Any]:
    """The content of its ``test.json``."""
    try:
        about = json_of((folder / ABOUT).read_text(encoding="utf-8"))
    except ValueError as error:
        raise ResultsError(f"test {str(file)!r}: {ABOUT}: {error}") from error
    if not isinstance(about, dict) or about.get("format") != FORMAT:
        said = about.get("format") if isinstance(about, dict) else about
        raise ResultsError(
            f"test {str(file)!r}: is of the format {shown(said)}, this version reads {FORMAT}"
        )
    return about


def unpacked(file: Path) -> Path:
    """A temporary folder of this process with the members of a test."""
    try:
        sha = hashlib.sha256(file.read_bytes()).hexdigest()
        folder = process_folder("tests") / sha
        if not folder.is_dir():
            _unpack(file, folder)
    except OSError as error:
        reason = error.strerror or error
        raise ResultsError(f"test {str(file)!r}: cannot be read: {reason}") from error
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, ValueError) as error:
        raise ResultsError(f"test {str(file)!r}: is damaged: {error}") from error
    return folder


def _unpack(file: Path, folder: Path) -> None:
    """Unpack a test; ValueError for members that no test has."""
    own = OwnFolder("test")
    try:
        new = Path(own.name) / "new"
        (new / FOLDER).mkdir(parents=True)
        with zipfile.ZipFile(file) as archive:
            members = archive.infolist()
            _check_members(members)
            size = 0
            for member in members:
                size += _copy(archive, member, new / member.filename, MOST_ALL_B - size)
        new.rename(folder)
    finally:
        own.close()


def _check_members(members: list[zipfile.ZipInfo]) -> None:
    """Refuse members with other names or of another sort than a test has."""
    names = [member.filename for member in members]
    if len(names) > MOST_MEMBERS or len({*names}) < len(names):
        raise ValueError(f"it holds {len(names)} members, some of them twice or too many")
    for member in members:
        name, sort = member.filename, stat.S_IFMT(member.external_attr >> 16)
        folder, _, last = name.rpartition("/")
        if not (name in MOST_B or (folder == FOLDER and KEPT.fullmatch(last))):
            raise ValueError(f"it holds {shown(name)}, which no test has")
        if sort not in (0, stat.S_IFREG):
            raise ValueError(f"{shown(name)} is no plain file")
        if member.flag_bits & 1:
            raise ValueError(f"{shown(name)} is encrypted")
    if missing := MOST_B.keys() - {*names}:
        raise ValueError(f"it holds no {' and no '.join(sorted(missing))}")


def _copy(archive: zipfile.ZipFile, member: zipfile.ZipInfo, place: Path, left: int) -> int:
    """Unpack a member up to its largest size, and to what is left of that of all; its size."""
    most, size = min(left, MOST_B.get(member.filename, MOST_ALL_B)), 0
    with archive.open(member) as source, place.open("xb") as copy:
        while data := source.read(CHUNK):
            size += len(data)
            if size > most:
                raise ValueError(f"{member.filename} holds more than {most} bytes")
            copy.write(data)
    return size
