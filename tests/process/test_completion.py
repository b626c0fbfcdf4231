"""Completion in a shell: commands, options, the names of each sort, and files."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from inline import cavsumo

from cavsumo.agents.names import AGENT_NAMES, SEARCH_METHODS
from cavsumo.assertions.names import ASSERTION_NAMES
from cavsumo.egos.names import EGO_NAMES
from cavsumo.egos.reference.names import REFERENCE_NAMES

# Completes the last word of each line, as bash does when a user presses Tab.
TAB = """
source ./script
while IFS= read -r line; do
  read -ra COMP_WORDS <<< "$line"
  [[ "$line" == *" " ]] && COMP_WORDS+=("")
  COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
  COMPREPLY=()
  _shtab_cavsumo 2> /dev/null
  echo "${COMPREPLY[*]}"
done
"""
COMPLETED = {
    "cavsumo me": {"merge"},
    "cavsumo run --asse": {"--assert", "--assert-param"},
    "cavsumo run --agent ": {*AGENT_NAMES},
    "cavsumo run --runs 3 --agent tim": {"timing"},
    "cavsumo run --assert ": {*ASSERTION_NAMES},
    "cavsumo run --ego ": {*EGO_NAMES},
    "cavsumo run --reference ": {"none", *REFERENCE_NAMES},
    "cavsumo run --signal gr": {"green"},
    "cavsumo run --net cr": {"crossing", "cross.net.xml"},
    "cavsumo run -o re": {"results.csv"},
    "cavsumo certify re": {"results.csv"},
    "cavsumo certify results.csv 0 --egos tim": {"time-gap"},
    "cavsumo check-ego con": {"constant"},
    "cavsumo search --method ": {*SEARCH_METHODS},
    "cavsumo search --net cr": {"crossing", "cross.net.xml"},
    "cavsumo estimate --method mon": {"monte-carlo"},
    "cavsumo inspect ju": {"junction"},
    "cavsumo report --format mark": {"markdown"},
    "cavsumo game solve --reading ": {"A", "B", "C"},
    "cavsumo agents prox": {"proximity"},
    "cavsumo egos ti": {"time-gap"},
    "cavsumo assertions red": {"red-light"},
}


def test_bash_completes_commands_options_names_and_files(tmp_path: Path) -> None:
    """Each word as far as it was typed; the script starts no Python."""
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("no bash")
    script = cavsumo(tmp_path, "--print-completion", "bash")
    assert (script.returncode, script.stderr) == (0, "")
    (tmp_path / "script").write_text(script.stdout, encoding="utf-8")
    for name in ("results.csv", "cross.net.xml"):
        (tmp_path / name).touch()
    done = subprocess.run(
        [bash, "-c", TAB], cwd=tmp_path, env={"PATH": "nowhere"}, input="\n".join([*COMPLETED, ""]),
        capture_output=True, text=True, check=True, timeout=60,
    )  # fmt: skip
    found = [set(line.split()) for line in done.stdout.splitlines()]
    assert dict(zip(COMPLETED, found, strict=True)) == COMPLETED


@pytest.mark.parametrize("shell", ["bash", "fish", "zsh"])
def test_every_shell_is_told_the_names(shell: str, tmp_path: Path) -> None:
    """The script parses in the shell where there is one."""
    script = cavsumo(tmp_path, "--print-completion", shell).stdout
    for name in (*AGENT_NAMES, *ASSERTION_NAMES, *EGO_NAMES, "junction", "--print-completion"):
        assert name in script
    if shutil.which(shell):
        subprocess.run([shell, "-n"], input=script, text=True, check=True, timeout=60)


def test_another_shell_is_refused(tmp_path: Path) -> None:
    """With those that there are."""
    done = cavsumo(tmp_path, "--print-completion", "csh")
    assert done.returncode == 2
    assert "invalid choice: 'csh' (choose from" in done.stderr
