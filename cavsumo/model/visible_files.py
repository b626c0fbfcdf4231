"""Files that results and scenarios name, which may lie where this user is not let in."""

from __future__ import annotations

from pathlib import Path


def is_visible(file: Path) -> bool:
    """Whether a file is there as far as this user can see.

    It is not behind a folder that is closed to the user, nor under a name that the system does not
    take; ``Path.is_file`` raises for these.
    """
    try:
        return file.is_file()
    except OSError:
        return False
