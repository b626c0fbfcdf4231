"""A plugin of pytest: ``pytest --cavsumo-ego mine:Ego tests/*.cavtest``.

Each kept test is a test: it passes when the ego passes it now, is skipped when it no longer meets
the testers, and fails else. Light to import, as pytest imports it wherever cavsumo is installed.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from cavsumo.kept.names import CAVTEST

if TYPE_CHECKING:
    from cavsumo.kept.regression import OtherEgo

OPTIONS = {
    "ego": "the ego that plays kept tests (.cavtest), as for cavsumo run --ego",
    "testers": "what their testers follow: recorded (default) or policy",
}


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options ``--cavsumo-ego``, ``--cavsumo-testers``, ``--cavsumo-ego-param``."""
    group = parser.getgroup("cavsumo", "kept tests of cavsumo")
    for name, words in OPTIONS.items():
        group.addoption(f"--cavsumo-{name}", help=words)
        parser.addini(f"cavsumo_{name}", words)
    words = "a parameter of that ego"
    group.addoption("--cavsumo-ego-param", action="append", metavar="KEY=VALUE", help=words)
    parser.addini("cavsumo_ego_param", words, type="linelist")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """A collector for a kept test."""
    if file_path.suffix != CAVTEST:
        return None
    collector: pytest.Collector = KeptTestFile.from_parent(parent, path=file_path)
    return collector


class KeptTestFile(pytest.File):
    """The file of a kept test, with one test in it."""

    def collect(self) -> Iterator[pytest.Item]:
        """The test."""
        yield KeptTestItem.from_parent(self, name=self.path.stem)


class KeptTestItem(pytest.Item):
    """A kept test that is played against the ego of the options."""

    def runtest(self) -> None:
        """Play it."""
        ego = ego_of(self.config)
        if ego is None:
            pytest.skip("no --cavsumo-ego is given to play it against")
        from cavsumo.kept import regression

        (found,) = regression.regressions([self.path], ego)
        if found.status == regression.ELSEWHERE:
            pytest.skip(f"{found.status}: {found.told}")
        if found.status != regression.PASSES:
            raise StillFails(f"{found.status}: {found.told}\n{found.sentence}")

    def repr_failure(self, excinfo: Any, style: Any = None) -> Any:
        """The reason of a failure in words, without a stack."""
        from cavsumo.errors import CavsumoError

        if isinstance(excinfo.value, StillFails | CavsumoError):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, None, str]:
        """Where the test is."""
        return self.path, None, f"kept test {self.name}"


class StillFails(Exception):
    """The ego does not pass a kept test."""


def ego_of(config: pytest.Config) -> OtherEgo | None:
    """The ego of the options, else of the configuration file; None if neither names one."""
    name = _option(config, "ego")
    if not name:
        return None
    from cavsumo.kept.regression import RECORDED, OtherEgo
    from cavsumo.model.checks import assignment

    given = config.getoption("--cavsumo-ego-param") or config.getini("cavsumo_ego_param")
    params = dict(assignment("--cavsumo-ego-param", word) for word in given)
    return OtherEgo(str(name), params, str(_option(config, "testers") or RECORDED))


def _option(config: pytest.Config, name: str) -> Any:
    """An option, else the entry of the configuration file."""
    return config.getoption(f"--cavsumo-{name}") or config.getini(f"cavsumo_{name}")
