"""The checksum that identifies a file."""

from __future__ import annotations

import hashlib
from pathlib import Path

from cavsumo.errors import InputError
from cavsumo.model.visible_files import is_visible


def checksum(file: Path) -> str:
    """The SHA-256 of a file, which may be large."""
    try:
        with file.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{str(file)!r}: cannot be read: {error.strerror}") from error


def readable_checksum(file: Path) -> str | None:
    """The SHA-256 of a file; None for one that is not there or that this user cannot read."""
    if not is_visible(file):
        return None
    try:
        return checksum(file)
    except InputError:
        return None
