"""A failure exported by the command, for tests of the formats of others."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path

from inline import cavsumo as command

from cavsumo.results.reading import read_rows
from cavsumo.results.traces import Trace, read_trace


def export_failure(folder: Path, results: Path, formats: Iterable[str]) -> Trace:
    """The trace of the first failure of some results, exported into a folder in each format."""
    row = next(row for row in read_rows(results) if row["outcome"] == "violated")
    for to in formats:
        done = command(folder, "export", str(results), row["run"], "--to", to, "-o", ".")
        assert done.returncode == 0, done.stderr
    return read_trace(results.parent / row["trace"])


def export_as_test(folder: Path, results: Path, trace: Trace, to: str, name: str) -> ET.Element:
    """The root of a file, by its name, of an episode that is exported as a test."""
    words = [str(results), trace.row["run"], "--to", to, "--as", "test"]
    assert command(folder, "export", *words, "-o", ".").returncode == 0
    return ET.parse(folder / name).getroot()
