"""A running system for tests, served by a thread of its own, in a time that passes at once."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Self

from click.testing import CliRunner

from tests.host.rtc.chain import Chain
from tickrig.emulators.commands.cli import main
from tickrig.host.control.server import ControlServer
from tickrig.host.rtc.commands.system_control import SystemControl
from tickrig.host.rtc.system.schedule import RealTime

ROUND_US = 500


class ServedClock:
    """Serves for a moment in place of each wait."""

    def __init__(self) -> None:
        self.server: ControlServer | None = None

    def wait_until(self, t_us: int, /) -> int:
        if self.server is not None:
            self.server.serve(ROUND_US)
        return 0


class Served(Chain):
    """ConsoleIn0 to ConsoleOut0, both Active, with ConfigSample0 and SeqOut0 beside them."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        for name in ("ConfigSample", "SeqOut"):
            self.manager.create(name)
        self.manager.run_for(1_000)
        self.path, clock = path, ServedClock()
        self.runner = RealTime(self.manager, clock)
        self.server = clock.server = ControlServer(path, SystemControl(self.manager, self.runner))
        self._thread = threading.Thread(target=self.runner.run)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self.runner.stop()
        self._thread.join()
        self.server.close()

    def rtc(self, *words: str, exit_code: int = 0) -> str:
        """Run `tickrig rtc`, and return what it printed."""
        env = {"TICKRIG_RTC": str(self.path)}
        result = CliRunner().invoke(main, ["rtc", *words], env=env)
        assert result.exit_code == exit_code, result.output
        assert "Traceback" not in result.output
        return result.output
