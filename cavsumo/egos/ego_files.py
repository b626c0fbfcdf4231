"""The files in the command of an ego: its program, its inputs and its outputs.

A command does not tell which of its files are read and which are written. The rule: a file that
exists before the batch is an input, until it changes. The program itself, and the script of an
interpreter, always stay inputs: with another program the ego is another. Any other file that
appears or changes while egos run on this machine counts as their output; it is named in the
manifest and never a reason to refuse results.
"""

from __future__ import annotations

import platform
import re
from collections.abc import Mapping
from pathlib import Path

from cavsumo.egos.external.ego import command_words
from cavsumo.egos.specs import ego_files
from cavsumo.model.checksums import readable_checksum
from cavsumo.model.visible_files import is_visible

# Programs whose first file is what they execute, by the beginning of their names.
_RUNNERS = re.compile(
    r"(python|pypy|node|nodejs|deno|bun|java|ruby|perl|lua|luajit|julia|Rscript|octave|php|bash|dash"
    r"|sh|zsh|ksh|fish|env|uv|conda|poetry|wine|mono|dotnet|nice|stdbuf|taskset|timeout)[\d.]*(\.exe)?"
)
_INLINE = frozenset({"-m", "-c", "-e"})  # options after which no script is named
_BOOT = Path("/proc/sys/kernel/random/boot_id")


class OutputWatch:
    """Finds files of an ego that appear or change; each is read again only if it was touched.

    Args:
        spec: names the ego.
        inputs: the checksums of files as they were before.
    """

    def __init__(self, spec: str, inputs: Mapping[str, str]) -> None:
        self._spec, self._inputs = spec, dict(inputs)
        self._touched: dict[Path, tuple[int, ...]] = {}
        self._outputs: set[str] = set()

    def outputs(self) -> list[str]:
        """The files that have appeared or changed so far, in order."""
        for file in data_files(self._spec):
            touched = _touched(file)
            if str(file) not in self._outputs and self._touched.get(file) != touched:
                self._touched[file] = touched
                if readable_checksum(file) != self._inputs.get(str(file)):
                    self._outputs.add(str(file))
        return sorted(self._outputs)


def data_files(spec: str) -> tuple[Path, ...]:
    """The existing files among those that a command names after its program."""
    if spec.partition(":")[0] != "exec":
        return ()
    program = _program(spec)
    return tuple(file for file in ego_files(spec) if file not in program)


def _program(spec: str) -> frozenset[Path]:
    """The files of a command that define the ego: its first word, and a script that it executes."""
    first, *others = command_words(spec.partition(":")[2])
    script = next((file for file in map(Path, others) if is_visible(file)), None)
    elsewhere = not _RUNNERS.fullmatch(Path(first).name) or not _INLINE.isdisjoint(others)
    return frozenset({Path(first), *([] if script is None or elsewhere else [script])})


def _touched(file: Path) -> tuple[int, ...]:
    """The status of a file that changes with it; nothing for a file that no longer exists."""
    try:
        stat = file.stat()
    except OSError:
        return ()
    return stat.st_ino, stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns


def machine() -> str:
    """The identity of this machine since its start."""
    try:
        return _BOOT.read_text(encoding="ascii").strip()
    except OSError:
        return platform.node()
