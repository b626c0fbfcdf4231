"""The inputs of a batch, kept compressed beside its traces: a replay needs no other files.

They lie in ``results/inputs`` of ``results.csv``: the network, the routes, additional files,
policies and weights, no programs. A name is readable and contains the first digits of the file's
SHA-256, by which the file is found: ``crossing-a72e56a374a8.net.xml.gz``. The compressed bytes
depend on the content alone.

Results come from strangers. A file is therefore read only from within the folder, up to a size, and
is used only if its whole checksum is the expected one.
"""

from __future__ import annotations

import gzip
import hashlib
import re
import shutil
import zlib
from collections.abc import Iterator
from pathlib import Path

from cavsumo.errors import ResultsError, plain
from cavsumo.model.own_folders import process_folder
from cavsumo.results.trace_file import is_trace

FOLDER = "inputs"
LARGEST = 512 * 2**20  # bytes; a larger file is not kept, and no more of one is decompressed
TOO_LARGE = f"has more than {LARGEST // 2**20} MiB and is not kept: a replay elsewhere needs it too"
LEVEL = 6  # of compression; on a network of 5 MB 9 takes two and a half times as long for 4 % less
CHUNK = 2**20
DIGITS = 12  # of a checksum in a name
STEM = 80  # characters of a name before its digits
SHA256 = re.compile(r"[0-9a-f]{64}")
NAME = rf"(?P<stem>[\w+-]*)-(?P<digits>[0-9a-f]{{{DIGITS}}})(?P<endings>[\w.+-]*)\.gz"
KEPT = re.compile(NAME, re.ASCII)


def inputs_folder(file: Path) -> Path:
    """The folder of the inputs that are kept with a results file, or with a trace."""
    return (file.parent if is_trace(file) else file.with_suffix("")) / FOLDER


def kept_name(file: Path, sha: str) -> str:
    """The name under which a file is kept."""
    stem, dot, endings = re.sub(r"[^\w.+-]", "_", file.name, flags=re.ASCII).partition(".")
    return f"{stem[:STEM]}-{sha[:DIGITS]}{dot}{endings[:STEM]}.gz"


def keep(folder: Path, file: Path, sha: str) -> bool:
    """Keep a file in a folder of inputs; returns whether it is small enough. Raises OSError.

    Raises ResultsError when the file has not this checksum any more.
    """
    if file.stat().st_size > LARGEST:
        return False
    if _kept(folder, sha) is not None:
        return True
    folder.mkdir(parents=True, exist_ok=True)
    new, digest = folder / f".{sha[:DIGITS]}.new", hashlib.sha256()
    new.unlink(missing_ok=True)  # it may be a link
    try:
        with (
            file.open("rb") as source,
            new.open("xb") as raw,
            gzip.GzipFile("", "wb", LEVEL, raw, mtime=0) as packed,
        ):
            while data := source.read(CHUNK):
                digest.update(data)
                packed.write(data)
        if digest.hexdigest() != sha:
            raise ResultsError(f"{str(file)!r}: was changed while the batch began")
        new.replace(folder / kept_name(file, sha))
    finally:
        new.unlink(missing_ok=True)
    return True


def remove_others(folder: Path, shas: set[str]) -> None:
    """Remove the kept files with other checksums from a folder of inputs, and nothing else."""
    digits = {sha[:DIGITS] for sha in shas}
    for file in folder.iterdir() if folder.is_dir() else ():
        found = KEPT.fullmatch(file.name)
        if found is not None and found["digits"] not in digits:
            file.unlink()


def unpacked(folder: Path, sha: str) -> Path | None:
    """A copy of the kept file with a checksum, in a temporary folder of this process.

    None for none in the folder; raises ResultsError for a file with another content.
    """
    kept = _kept(folder, sha)
    if kept is None:
        return None
    place = process_folder("inputs") / sha
    name = KEPT.fullmatch(kept.name)
    assert name is not None
    file = place / (name["stem"] + name["endings"])
    if file.is_file():
        return file
    digest = hashlib.sha256()
    try:
        for data in _content(kept):
            digest.update(data)
        if digest.hexdigest() != sha:
            raise ValueError("its content has another checksum")
        place.mkdir(exist_ok=True)
        new = place / ".new"
        with new.open("wb") as stream:
            stream.writelines(_content(kept))
        new.replace(file)
    except (OSError, EOFError, ValueError, zlib.error) as error:
        shutil.rmtree(place, ignore_errors=True)
        raise ResultsError(f"{str(kept)!r}: is damaged: {plain(error)}") from error
    return file


def _kept(folder: Path, sha: str) -> Path | None:
    """The file that is kept for a checksum; links that lead out of the folder are not followed."""
    if not SHA256.fullmatch(sha) or not folder.is_dir():
        return None
    for file in sorted(folder.iterdir()):
        found = KEPT.fullmatch(file.name)
        if found is not None and found["digits"] == sha[:DIGITS] and file.is_file():
            return file if file.resolve().parent == folder.resolve() else None
    return None


def _content(file: Path) -> Iterator[bytes]:
    """The content of a compressed file; raises ValueError beyond the largest size."""
    size = 0
    with gzip.open(file) as stream:
        while data := stream.read(CHUNK):
            size += len(data)
            if size > LARGEST:
                raise ValueError(f"it holds more than {LARGEST // 2**20} MiB")
            yield data
