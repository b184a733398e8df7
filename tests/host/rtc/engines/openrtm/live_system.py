"""A system of `tickrig rtc run` in a process of its own, with a name server and rtshell."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.host.rtc.engines.openrtm.name_server import DEADLINE_S, OmniNames, eventually

CONTEXT = f"{socket.gethostname()}.host_cxt"
TOOL = """
import sys
import rtctree.rtc
sys.path += rtctree.rtc.__path__  # rtexit wants the stubs of OpenRTM-aist-Python beside these
from rtshell.{0} import main
sys.argv[0] = '{0}'
sys.exit(main())
"""


class LiveSystem:
    """A system that runs.

    Attributes:
        names: its name server.
        process: of the command.
        control: its control socket.
    """

    def __init__(self, names: OmniNames, process: subprocess.Popen[str], control: Path) -> None:
        self.names, self.process, self.control = names, process, control

    def tool(self, name: str, *words: str) -> tuple[int, str, str]:
        """Run a tool of rtshell; `@` in a word is the naming context of this machine.

        Returns:
            Its exit status, what it wrote, and what it wrote to standard error.
        """
        where = f"/{self.names.address}/{CONTEXT}"
        command = [sys.executable, "-c", TOOL.format(name)]
        command += [word.replace("@", where) for word in words]
        env = {**os.environ, "RTCTREE_NAMESERVERS": self.names.address, "NO_COLOR": "1"}
        done = subprocess.run(
            command, capture_output=True, text=True, env=env, timeout=DEADLINE_S, check=False
        )
        return done.returncode, done.stdout, done.stderr

    def ours(self, *words: str) -> None:
        """Run a verb of `tickrig rtc`."""
        command = [sys.executable, "-m", "tickrig", "rtc", *words, "--at", str(self.control)]
        subprocess.run(command, stdout=subprocess.DEVNULL, timeout=DEADLINE_S, check=True)

    def listed(self) -> dict[str, str]:
        """Return what `rtls -l` says of each component: its state, or `-`."""
        code, out, error = self.tool("rtls", "-l", "@")
        assert (code, error) == (0, "")
        return {line.split()[-1]: line.split()[0] for line in out.splitlines()}

    def end(self, number: signal.Signals = signal.SIGTERM) -> tuple[int, str]:
        """End the command with a signal; the answer is its exit status, and what it said."""
        self.process.send_signal(number)
        _, said = self.process.communicate(timeout=DEADLINE_S)
        return self.process.returncode, said


RTC_RUN = "tickrig rtc run"


def start_system(names: OmniNames, folder: Path, *words: str, command: str = RTC_RUN) -> LiveSystem:
    """Start a system; see `tickrig rtc run`."""
    script, *verbs = command.split()
    program = f"from tickrig.commands import {script.replace('-', '_')} as main; main()"
    control, pipes = folder / "ctl", subprocess.PIPE
    options = ["--openrtm", names.address]
    options += [] if script == "rh3" else ["--control", str(control)]
    process = subprocess.Popen(
        [sys.executable, "-c", program, *verbs, *options, *words],
        stdin=pipes,
        stdout=pipes,
        stderr=pipes,
        text=True,
    )
    return LiveSystem(names, process, control)


@contextmanager
def live_system(folder: Path, *words: str, command: str = RTC_RUN) -> Iterator[LiveSystem]:
    """Run a system beside a name server; see `start_system`."""
    names = OmniNames(folder)
    names.start()
    try:
        system = start_system(names, folder, *words, command=command)
        try:
            yield system
        finally:
            system.process.kill()
            system.process.communicate()
    finally:
        names.kill()


def has_components(system: LiveSystem, *wanted: str) -> None:
    """Wait until components have their names."""
    names = {f"{name}.rtc" for name in wanted}

    def there() -> bool:
        code, out, _ = system.tool("rtls", "@")
        return code == 0 and names <= set(out.split())

    eventually(there, f"no {wanted}")
