"""Data kept on disk from one command to the next: they save time and never change a result.

Entries lie in the folder of the user, each in a file named after the hash of all that it depends
on. They are written atomically, so several processes may use the folder; an entry that is damaged,
or that cannot be read, is as none.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from contextlib import suppress
from pathlib import Path

CHECK = hashlib.sha256().digest_size  # bytes of the checksum before the data


def cache_folder() -> Path | None:
    """``$XDG_CACHE_HOME/cavsumo`` or ``~/.cache/cavsumo``; None where there is no home."""
    home = os.environ.get("XDG_CACHE_HOME", "")
    try:
        return (Path(home) if Path(home).is_absolute() else Path.home() / ".cache") / "cavsumo"
    except RuntimeError:
        return None


def kept(name: str) -> bytes | None:
    """The data of an entry, None if there is none or if its checksum is wrong."""
    folder = cache_folder()
    with suppress(OSError):
        data = (folder / name).read_bytes() if folder else b""
        check, body = data[:CHECK], data[CHECK:]
        if body and hashlib.sha256(body).digest() == check:
            return body
    return None


def keep(name: str, body: bytes) -> None:
    """Write an entry; if that is impossible, nothing is kept."""
    folder = cache_folder()
    if folder is None:
        return
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder, delete=False) as stream:
            try:
                stream.write(hashlib.sha256(body).digest() + body)
                stream.close()
                Path(stream.name).replace(folder / name)
            except OSError:
                Path(stream.name).unlink()


def keep_newest(pattern: str, most: int) -> None:
    """Remove all but the newest entries whose names match a pattern of ``Path.glob``."""
    folder = cache_folder()
    if folder is None:
        return
    with suppress(OSError):  # another process may remove them too
        by_age = sorted(folder.glob(pattern), key=lambda file: file.stat().st_mtime)
        for file in by_age[:-most]:
            file.unlink(missing_ok=True)
