"""The line of a program's last output that is quoted when it ends."""

from __future__ import annotations

import shutil
from collections.abc import Callable

import pytest

from cavsumo.egos.external.last_words import LONGEST, telling_line

PYTHON = """Traceback (most recent call last):
  File "/x/ego.py", line 3, in <module>
    import torch
ModuleNotFoundError: No module named 'torch'
"""
NODE = """node:internal/modules/cjs/loader:1210
  throw err;
  ^

Error: Cannot find module './x'
Require stack:
- /x/a.js
    at Module._resolveFilename (node:internal/modules/cjs/loader:1207:15)
    at node:internal/main/run_main_module:28:49 {
  code: 'MODULE_NOT_FOUND',
  requireStack: [ '/x/a.js' ]
}

Node.js v20.20.2
"""
NODE_THROWS = """/x/b.js:1
throw "boom"
^
boom
(Use `node --trace-uncaught ...` to show where the exception was thrown)

Node.js v20.20.2
"""
JAVA = """Exception in thread "main" java.lang.RuntimeException: cannot start
\tat M.main(M.java:1)
Caused by: java.lang.IllegalStateException: no model
\tat M.main(M.java:1)
\t... 7 more
"""
GO = """panic: no map

goroutine 1 [running]:
main.load(...)
\t/x/main.go:4
main.main()
\t/x/main.go:8 +0x1d
"""
RUST = """
thread 'main' panicked at p.rs:1:12:
no weights
stack backtrace:
   0: std::panicking::begin_panic::<&str>
             at /rustc/library/std/src/panicking.rs:761:5
note: Some details are omitted, run with `RUST_BACKTRACE=full` for a verbose backtrace.
"""
CPP = """terminate called after throwing an instance of 'std::runtime_error'
  what():  no weights
"""


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", ""),
        (" \n\n", ""),
        ("TypeError: tried again\nloaded 3 maps\n  no GPU found  \n\n", "no GPU found"),
        ("loaded 3 maps\nabort(3)", "abort(3)"),
        ("}", "}"),
        (PYTHON, "ModuleNotFoundError: No module named 'torch'"),
        (NODE, "Error: Cannot find module './x'"),
        (NODE.replace("    at node:", "}\n    at node:"), "Error: Cannot find module './x'"),
        (NODE_THROWS, "boom"),
        (JAVA, "Caused by: java.lang.IllegalStateException: no model"),
        (GO, "panic: no map"),
        (GO + "exit status 2\n", "panic: no map"),
        (RUST, "no weights"),
        (CPP, "what():  no weights"),
    ],
)
def test_the_line_with_the_reason_is_found(text: str, line: str) -> None:
    """The last one, or the message above the stack and whatever else a runtime prints."""
    assert telling_line(text) == line


def test_a_long_line_is_cut() -> None:
    """A megabyte without a line feed is not quoted whole."""
    assert telling_line("x" * 1_000_000) == "x" * LONGEST


def test_nodes_own_words_are_quoted(refused: Callable[..., str]) -> None:
    """A script that is not there: node says so, and its version behind it."""
    if shutil.which("node") is None:
        pytest.skip("there is no node here")
    said = refused("--ego", "exec:node nope.js")
    assert "ended with status 1 (Error: Cannot find module '" in said
    assert "nope.js')" in said
