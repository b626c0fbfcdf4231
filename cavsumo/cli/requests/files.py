"""Checks of the files that commands name; one sentence each."""

from __future__ import annotations

from pathlib import Path

from cavsumo.errors import InputError

PICTURES = (".png", ".svg", ".pdf")


def check_folder(option: str, file: Path) -> None:
    """Refuse to write where there is no folder."""
    if not file.parent.is_dir():
        raise InputError(f"{option} {str(file)!r}: no such folder {str(file.parent)!r}")


def check_picture(option: str, file: Path | None) -> None:
    """Refuse a file name that is not one of a picture."""
    if file is None:
        return
    if file.suffix.lower() not in PICTURES:
        raise InputError(f"{option} {str(file)!r}: expected a name ending in .png, .svg or .pdf")
    check_folder(option, file)
