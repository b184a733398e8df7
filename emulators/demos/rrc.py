"""`tickrig demo rrc`: an RRC on a pty, driven by the host client, with a display of the traffic."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

from tickrig.emulators.bench.child import running
from tickrig.host.control.client import ControlClient
from tickrig.host.control.requests import Object
from tickrig.host.links.link import Link
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rrc import RrcClient, RrcRefused
from tickrig.wire.lines import LineSplitter
from tickrig.wire.rrc import commands as cmd
from tickrig.wire.rrc.replies import RrcEvent

_Echo = Callable[[str], None]
_Request = Callable[..., Object]
"""Function that makes a request to the emulator, as `ControlClient.request`."""

_PATIENCE_US: Final = 30_000_000
"""Time-out of an answer or an event on a busy machine."""

_MAX_REFUSALS: Final = 1_000
"""Largest number of refused renewals of a watchdog, before the event that ended it arrives."""

_STATUS_SHOWN: Final = 2
"""Number of status lines in a row that are printed; further lines are counted."""


class _AnswerSample(NamedTuple):
    """A sample command of the manual's test procedure, which has nine."""

    command: cmd.Command
    effect: str


_SAMPLES: Final = (
    _AnswerSample(cmd.Limit(50, 50), "the stick drives, at most 50 %"),
    _AnswerSample(cmd.Output(30, 0), "the host drives, forward at 30 %"),
    _AnswerSample(cmd.SpeedMode(4), "speed mode 4, its buttons not locked"),
    _AnswerSample(cmd.Joystick(reverse_mode=3), "stick shaping, backing toward the stick"),
    _AnswerSample(cmd.Watchdog(100), "VR2 stops after 1 s without a correct command"),
    _AnswerSample(cmd.Status(1), "a status line each 10 ms from now on"),
    _AnswerSample(
        cmd.StableMode(1), "CHECK wanted from now on, and no OK: 'device' behind a line confirms it"
    ),
    _AnswerSample(cmd.PowerOff(), "VR2 is stopped by force"),
    _AnswerSample(cmd.Beep((100,) * 4 + (10,) * 6), "two beeps of 1 s, three of 0.1 s"),
)

_MEANING: Final = {
    "EV:PowerOnTrigger": "the power button was seen",
    "EV:PowerOnSuccess": "VR2 runs; the RRC is in Standby",
    "EV:PowerOffWaitByHost": "VR2 stopped because the host said so",
    "EV:PowerOffWaitByWatchdog": "VR2 stopped: no command for 300 ms",
    "EV:PowerOffFinished": "VR2 is off",
    "EV:Initialized": "all settings are wiped, stablemode too",
    "ER:CommandUnknown": "refused",
    "RRC": "the device name",
}


class _DemoTranscript:
    """A `Link[bytes]` that prints each line that passes through another link."""

    def __init__(self, link: Link[bytes], echo: _Echo) -> None:
        self._link, self._echo, self._start_us = link, echo, link.now_us
        self._sent, self._received, self._statuses = LineSplitter(), LineSplitter(), 0

    @property
    def now_us(self) -> int:
        """Time on the link below."""
        return self._link.now_us

    def send(self, traffic: bytes, /) -> None:
        """Send and print data."""
        self._link.send(traffic)
        for line in self._sent.push(traffic):
            self._print(">", line.decode("latin-1"))

    def receive(self, timeout_us: int, /) -> bytes:
        """Receive and print lines, but only the first of many status lines."""
        data = self._link.receive(timeout_us)
        for line in self._received.push(data):
            self._statuses = self._statuses + 1 if line.startswith(b"SA:") else 0
            if self._statuses <= _STATUS_SHOWN:
                self._print("<", line.decode("latin-1"))
        return data

    def close(self) -> None:
        """Close the link below."""
        self._link.close()

    def _print(self, mark: str, line: str) -> None:
        time_s = (self._link.now_us - self._start_us) / 1e6
        meaning = _MEANING.get(line, "") if mark == "<" else ""
        self._echo(f"  {time_s:7.3f} {mark} {line or '(LF)':<28} {meaning}".rstrip())


def run_demo(echo: _Echo) -> None:
    """Start an emulated RRC, and run the demonstration on it, which takes about five seconds.

    Args:
        echo: function that is called with each line to print.

    Raises:
        RuntimeError: the emulator does not start.
        LinkError, DeviceRefused: the link or the device has reported an error.
    """
    with (
        running("tickrig.emulators.rrc.cli") as child,
        ControlClient(child.control, _PATIENCE_US / 1e6) as hand,
    ):
        echo(f"An RRC runs on {child.link.resolve()}, in a process of its own.")
        play(SerialLink(str(child.link)), hand.request, echo)


def play(link: Link[bytes], request: _Request, echo: _Echo) -> None:
    """Run the demonstration of the RRC on an emulator that is already running.

    Args:
        link: serial link to the RRC.
        request: function that sends a request to the control socket of the emulator.
        echo: function that is called with each line to print.

    Raises:
        LinkError, DeviceRefused: the link or the device has reported an error.
    """
    echo("> is what the host sends, < what the RRC answers, with the time in seconds.")
    transcript = _DemoTranscript(link, echo)
    with RrcClient(transcript, timeout_us=_PATIENCE_US, max_refusals=_MAX_REFUSALS) as rrc:
        for title in _chapters(rrc, transcript, request, echo):
            echo(f"\n{title}")
    status = request("status")
    echo(f"\nDone. Late ticks: {status['late_steps']}, lost bytes: {status['lost_bytes']}.")


def _chapters(rrc: RrcClient, link: Link[bytes], request: _Request, echo: _Echo) -> Iterator[str]:
    """Yield the title of each chapter, then play it."""
    yield "Begin as the manual advises: a dummy command, a pause, then talk."
    rrc.start()
    yield "The operator presses the power button."
    _switch_on(rrc, request)
    yield "The nine sample commands of the manual's test procedure."
    for sample in _SAMPLES:
        echo(f"  # {sample.effect}")
        _send(rrc, sample.command, echo)
    yield "The operator switches VR2 off and on again."
    request("press", name="power_button")
    rrc.wait_for(RrcEvent.INITIALIZED, _PATIENCE_US)
    rrc.run_for(300_000)
    _switch_on(rrc, request)
    yield "Output mode: the slowest speed mode first, then 30 % forward; the status shows it (1E)."
    rrc.status()
    rrc.drive_by_host(30, 0)
    rrc.run_for(50_000)
    yield "A watchdog of 300 ms. The client renews it while the program lives ..."
    rrc.watchdog(300_000)
    rrc.run_for(500_000)
    yield "... and now the program hangs for half a second."
    hung_us = link.now_us
    while link.now_us < hung_us + 500_000:
        link.receive(500_000)


def _send(rrc: RrcClient, command: cmd.Command, echo: _Echo) -> None:
    try:
        rrc.command(command)
    except RrcRefused:
        if not isinstance(command, cmd.PowerOff):
            raise
        echo("  # refused: this machine was busy for 1 s, and the watchdog stopped VR2 before")


def _switch_on(rrc: RrcClient, request: _Request) -> None:
    request("press", name="power_button")
    rrc.wait_for(RrcEvent.POWER_ON_SUCCESS, _PATIENCE_US)
