"""Trace files: their names and bytes.

A trace is text, see ``traces``, and is kept compressed by gzip. The bytes depend on the text alone:
there is no time and no name in them. Plain text, as 0.1 wrote it, is read too; which of the two a
file holds is known by its first bytes, not by its name. Traces come from strangers, so no more of
one is decompressed than the largest text.
"""

from __future__ import annotations

import zlib
from pathlib import Path

from cavsumo.errors import ResultsError
from cavsumo.model.documents import decoded, read_bytes

PLAIN = ".jsonl"
PACKED = f"{PLAIN}.gz"
LARGEST_B = 1 << 29  # of the text; a body in a timestep takes 95, so that is an hour with 150
# Of 160 kB leaves 1 33 %, 2 32 % in 1.6 ms, 6 29 % in 5.8 ms, 9 29 % in 7.9 ms.
LEVEL = 2
GZIP = 31  # zlib's number of its largest window, in the format of gzip
MAGIC = b"\x1f\x8b"  # first bytes of a gzip file, and of no JSON


def is_trace(file: Path) -> bool:
    """Whether this is the name of a trace, and not of results."""
    return file.name.endswith((PLAIN, PACKED))


def trace_name(csv_file: Path, run: int, ending: str = PACKED) -> str:
    """The path of an episode's trace, relative to the results file."""
    return f"{csv_file.stem}/run{run:06d}{ending}"


def packed(text: str) -> bytes:
    """The text of a trace, compressed."""
    packer = zlib.compressobj(LEVEL, zlib.DEFLATED, GZIP)
    return packer.compress(text.encode("utf-8")) + packer.flush()


def unpacked(data: bytes, name: str = "trace") -> str:
    """The text of a trace, given compressed or plain; raises ResultsError, beginning with a name.

    The name says which trace it is.
    """
    if not data.startswith(MAGIC):
        return decoded(data, name, ResultsError)
    unpacker = zlib.decompressobj(GZIP)
    try:
        text = unpacker.decompress(data, LARGEST_B + 1)
    except zlib.error as error:
        raise ResultsError(f"{name}: cannot be decompressed: {error}") from error
    if len(text) > LARGEST_B:
        raise ResultsError(f"{name}: holds more than {LARGEST_B} bytes, expected at most so many")
    if not unpacker.eof or unpacker.unused_data:
        where = "ends too early" if not unpacker.eof else "goes on behind its end"
        raise ResultsError(f"{name}: cannot be decompressed: it {where}")
    return decoded(text, name, ResultsError)


def read_packed(file: Path, what: str = "trace") -> bytes:
    """The bytes of a trace file, as they are; raises ResultsError for one that is too large."""
    return read_bytes(file, what, ResultsError, LARGEST_B)


def read_trace_text(file: Path) -> str:
    """The text in a trace file; raises ResultsError in one sentence."""
    return unpacked(read_packed(file), f"trace {str(file)!r}")
