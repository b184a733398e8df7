"""Options of the whole test run."""

from __future__ import annotations

import pytest

from tests.hil.rig_file import RIG, BadRigFile, read_rig_file


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--hil",
        metavar="RIG.TOML",
        help="run the tests in tests/hil on the real port that this file names",
    )


def pytest_configure(config: pytest.Config) -> None:
    path = config.getoption("--hil")
    if path is None:
        return
    try:
        config.stash[RIG] = read_rig_file(path)
    except BadRigFile as error:
        raise pytest.UsageError(str(error)) from None
