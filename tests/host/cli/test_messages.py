from __future__ import annotations

import logging
import subprocess
import sys

import pytest

from tickrig.host.cli.messages import warnings_shown


@pytest.mark.parametrize("part", ["host.rtc.ports.port", "emulators.record.recorder"])
def test_the_library_is_silent_unless_somebody_listens(part: str) -> None:
    program = "import logging, tickrig.{0}; logging.getLogger('tickrig.{0}').warning('beware')"
    process = subprocess.run(
        [sys.executable, "-c", program.format(part)], capture_output=True, check=True
    )
    assert process.stderr == b""


def test_a_command_tells_warnings_and_no_more(capsys: pytest.CaptureFixture[str]) -> None:
    logger = logging.getLogger("tickrig.host")
    with warnings_shown():
        logger.info("all is well")
        logger.warning("beware")
    logger.warning("unheard")
    assert capsys.readouterr().err == "beware\n"
