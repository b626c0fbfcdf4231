"""The line of a program's last output that gives the reason of its end.

Most programs print it in their last line. Some runtimes print more after it: node its version and
the stack, Java the stack, Go the goroutines, Rust a hint.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

LONGEST = 200  # characters of a line that is quoted
REACH = 20  # lines of a message above its last one

# Last lines of runtimes that print their message above.
_END = re.compile(
    r"Node\.js v\d|[)\]}]+,?$"  # node: its version, an object that it shows
    r"|\s+at |\s+\.\.\. \d+ more$"  # stacks of node and Java
    r"|exit status \d+$|\s+\S+\.go:\d+"  # Go
    r"|note: .*RUST_BACKTRACE"  # Rust
)
# Further lines of the same that are not indented, as most of them are.
_BEHIND = re.compile(
    r"\s|\(Use `node |goroutine \d+ |created by |[\w./*()]+\(.*\)$|stack backtrace:$"
)
_HEAD = re.compile(r"Uncaught |Caused by: |Exception in thread |[\w.$]*(Error|Exception)\b|panic: ")


def telling_line(text: str) -> str:
    """The line with the reason of a program's end, shortened; empty if there is none."""
    lines = [line for line in text.splitlines() if line.strip()]
    if not lines:
        return ""
    message = [i for i, line in enumerate(lines) if not _is_behind(line)]
    if not _END.match(lines[-1]) or not message:
        return _shown(lines[-1])
    return _shown(_first_line(lines, message[-1]))


def _is_behind(line: str) -> bool:
    """Whether a line is one that runtimes print after a message, such as a stack."""
    return bool(_END.match(line) or _BEHIND.match(line))


def _first_line(lines: Sequence[str], last: int) -> str:
    """The first line of a message of several lines, from the index of its last one."""
    for line in reversed(lines[max(0, last - REACH) : last + 1]):
        if _is_behind(line):
            break
        if _HEAD.match(line):
            return line
    return lines[last]


def _shown(line: str) -> str:
    """A line as a message quotes it."""
    return line.strip()[:LONGEST]
