"""The folder of an export: all of its files, or none."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from cavsumo.errors import InputError


def check_place(folder: Path) -> None:
    """Raise InputError unless a folder is there or can be made."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"--output {str(folder)!r}: is a file; expected a folder")
    if not folder.is_dir() and not folder.parent.is_dir():
        raise InputError(f"--output {str(folder)!r}: no such folder {str(folder.parent)!r}")


def write_all(folder: Path, texts: Mapping[str, str]) -> None:
    """Write files into a folder, which is made if need be: all of them or none.

    Raises InputError where that cannot be.
    """
    made, new_folder, name = list[tuple[Path, Path]](), not folder.is_dir(), ""
    try:
        folder.mkdir(exist_ok=True)
        for name, text in texts.items():
            made.append((folder / f".{name}.new", folder / name))
            made[-1][0].write_text(text, encoding="utf-8")
        for new, file in made:
            new.replace(file)
    except OSError as error:
        for new, _ in made:
            new.unlink(missing_ok=True)
        if new_folder:
            with suppress(OSError):
                folder.rmdir()
        said = f"{str(folder / name)!r}: cannot be written: {error.strerror}"
        raise InputError(said) from error
