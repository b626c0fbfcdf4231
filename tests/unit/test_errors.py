"""Messages of errors: in words, without the numbers of the system."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

import cavsumo
from cavsumo.errors import plain

FULL = errno.ENOSPC, os.strerror(errno.ENOSPC)


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError(*FULL, "a.xml"), "'a.xml': No space left on device"),
        (OSError(*FULL, Path("a.xml")), "'a.xml': No space left on device"),
        (OSError(*FULL, 5), "No space left on device"),
        (OSError(*FULL), "No space left on device"),
        (OSError("the disk is full"), "the disk is full"),
        (ValueError("no number"), "no number"),
    ],
)
def test_an_error_of_the_system_is_its_file_and_its_reason(error: Exception, said: str) -> None:
    """Any other error is its message."""
    assert plain(error) == said


@pytest.mark.parametrize("key", ["net", "routes"])
def test_a_file_that_the_system_refuses_is_an_input_error(
    key: str, networks: dict[str, Path]
) -> None:
    """In Python too: a name that is too long, as a folder that is closed, raises no OSError."""
    settings = {"net": str(networks["crossing"])} | {key: "x" * 300 + ".xml"}
    with pytest.raises(cavsumo.InputError, match="File name too long"):
        cavsumo.run(**settings)
