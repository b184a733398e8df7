"""A tap between a host and a real port, which records the traffic and forwards it at once."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Final

import click

from tickrig.emulators.commands.device_type import DEVICES, configure
from tickrig.emulators.rig.emulated import Inputs
from tickrig.emulators.serial.pty_port import PtyPort
from tickrig.host.cli.control import stopped_by_signals
from tickrig.host.cli.messages import (
    Refused,
    SourceFailed,
    refuse_path,
    refused_at,
    say,
    warnings_shown,
)
from tickrig.host.links.link import LinkClosed
from tickrig.host.links.ready import ready
from tickrig.host.links.recording_link import RecordingLink
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.text.bench_header import NAME
from tickrig.host.text.names import near
from tickrig.host.text.values import parse_setting

_LOOK_S: Final = 0.05
"""Period at which the tap checks whether to stop."""

_STOPPED_S: Final = 0.5
"""Delay from which a check counts as late, because the process was stopped or had no processor."""

_READ_BYTES: Final = 4_096


class _PortTap:
    """Passes bytes between the pty of a host and a port.

    One thread reads the port. The caller's thread reads the pty and the lines that an operator
    types. A host may close the pty and open it again.

    Args:
        link: link to the port, which is recorded.
        pty: the host's terminal.
        typed: function that is called with each line that an operator types.
        late: function that is called with the number of seconds in which the tap was not running.

    Attributes:
        sent: number of bytes that went to the device.
        received: number of bytes that came from the device.
        gone: reason for the loss of the port, or empty while the port exists.
    """

    def __init__(
        self,
        link: RecordingLink[bytes],
        pty: PtyPort,
        typed: Callable[[str], None],
        late: Callable[[float], None],
    ) -> None:
        self._link, self._pty, self._typed, self._late = link, pty, typed, late
        self.sent = self.received = 0
        self.gone, self._stopped = "", False
        self._lock = threading.Lock()
        self._line = b""

    def run(self, terminal: int | None) -> None:
        """Forward bytes between host and device, and record them, until the recording ends.

        It ends when `stop` is called or the port of the device is gone.

        Args:
            terminal: file descriptor of the operator's terminal, or None without a terminal.
        """
        reader = threading.Thread(target=self._read_port, daemon=True)
        reader.start()
        watched = [self._pty.fileno(), *([] if terminal is None else [terminal])]
        while not self._stopped and not self.gone:
            began_s = time.monotonic()
            can_be_read, _ = ready(watched, wait_s=_LOOK_S)
            self._read_pty()
            if (
                terminal is not None
                and terminal in can_be_read
                and not self._read_terminal(terminal)
            ):
                watched.remove(terminal)
            if (late_s := time.monotonic() - began_s - _LOOK_S) > _STOPPED_S:
                self._late(late_s)
        self._stopped = True
        reader.join()

    def stop(self) -> None:
        """Stop `run`."""
        self._stopped = True

    def _read_port(self) -> None:
        """Forward data of the device, in its own thread."""
        try:
            while not self._stopped:
                if data := self._link.receive(round(_LOOK_S * 1e6)):
                    self.received += len(data)
                    with self._lock:
                        self._pty.send(0, data)
        except LinkClosed as error:
            self.gone = self.gone or str(error)

    def _read_pty(self) -> None:
        """Forward data of the host, and send buffered data to the host."""
        try:
            with self._lock:
                data = self._pty.poll(self._link.now_us)
            if data:
                self._link.send(data)
                self.sent += len(data)
        except LinkClosed as error:
            self.gone = self.gone or str(error)

    def _read_terminal(self, terminal: int) -> bool:
        """Read typed lines; return False at the end."""
        try:
            data = os.read(terminal, _READ_BYTES)
        except OSError:  # it is gone, or this job is in the background
            data = b""
        *lines, self._line = (self._line + data).split(b"\n")
        for line in lines:
            self._typed(line.decode("utf-8", "replace").strip())
        return bool(data)


# `tickrig record`: the port, the terminal and the operator that its command line names.

_BAUD: Final = 115_200
_RESET: Final = "reset"

_FAILED: Final = 3


def record_port(port: str, out: Path, type_name: str, link: Path | None, baud: int | None) -> int:
    """Run `tickrig record` on a serial port, and return the exit status."""
    usual_baud, inputs = _known(type_name)
    with ExitStack() as stack:
        stack.enter_context(warnings_shown())
        pty = _open_pty(stack, link, baud or usual_baud)
        recorded = _open_port(port, baud or usual_baud, out, type_name)
        stack.callback(recorded.close)
        tap = _PortTap(recorded, pty, _typing(recorded, inputs), _late)
        stack.enter_context(stopped_by_signals(tap.stop))
        _greet(str(link or pty.path), port)
        began_us = recorded.now_us
        tap.run(_terminal())
        seconds = (recorded.now_us - began_us) / 1e6
    lost = f"; {pty.lost} bytes lost: no host read them" if pty.lost else ""
    say(f"recorded {seconds:.3f} s: {tap.sent} bytes to the device, {tap.received} from it{lost}")
    if tap.gone:
        say(f"the port is gone: {tap.gone}")
    if recorded.recording_error:
        say(f"the recording ended early: {recorded.recording_error}")
    return _FAILED if recorded.recording_error or tap.gone else 0


def _known(type_name: str) -> tuple[int, Inputs | None]:
    """Return the baud rate and the inputs of a device type."""
    if not type_name:
        return _BAUD, None

    if type_name not in DEVICES.names():
        raise Refused(f"--type: no device {type_name!r}; {near(type_name, DEVICES.names())}")
    with refused_at("--type"):
        made = configure(type_name, {})
    return made.type.line.baud, made.device.inputs


def _open_port(port: str, baud: int, out: Path, type_name: str) -> RecordingLink[bytes]:
    try:
        line = SerialLink(port, baud)
    except LinkClosed as error:
        raise SourceFailed(str(error)) from None
    try:
        return RecordingLink(line, out, name=type_name or "device", type=type_name)
    except OSError as error:
        line.close()
        refuse_path("trace", error)


def _open_pty(stack: ExitStack, link: Path | None, baud: int) -> PtyPort:
    def differs(setting: str) -> None:
        say(f"The host has set its terminal to {setting}; the port is at {baud} 8N1 (--baud).")

    try:
        pty = PtyPort(link)
    except OSError as error:
        refuse_path("link", error)
    stack.callback(pty.close)
    pty.watch_setting(baud, differs)
    return pty


def _greet(path: str, port: str) -> None:
    click.echo(path)
    sys.stdout.flush()
    say(f"Recording {port}; the host opens {path}. Type NAME=VALUE or reset; Ctrl-C ends.")


def _late(seconds: float) -> None:
    say(f"stopped for {seconds:.1f} s: traffic of this time has the time when it was forwarded")


def _terminal() -> int | None:
    """Return the descriptor of the operator's terminal."""
    signal.signal(signal.SIGTTIN, signal.SIG_IGN)  # a job in the background reads nothing
    try:
        return sys.stdin.fileno()
    except (OSError, ValueError, AttributeError):  # none, or closed
        return None


def _typing(link: RecordingLink[bytes], inputs: Inputs | None) -> Callable[[str], None]:
    """Return a function for typed lines."""

    def take(line: str) -> None:
        try:
            if line == _RESET:
                link.note_reset()
            elif line:
                for name, value in _changes(line, inputs):
                    link.note(name, value)
        except ValueError as error:
            say(str(error))

    return take


def _changes(line: str, inputs: Inputs | None) -> Iterator[tuple[str, int | float | str]]:
    """Read `NAME=VALUE`, or `NAME=VALUE,VALUE` for a group; raise ValueError for another form."""
    name, equals, rest = (word.strip() for word in line.partition("="))
    if not equals or not rest or not NAME.fullmatch(name):
        raise ValueError(f"{line!r:.60} is not NAME=VALUE, and not reset")
    if inputs is None:
        yield name, parse_setting(rest)
        return
    members = inputs.groups.get(name, (name,))
    values = [parse_setting(word.strip()) for word in rest.split(",")]
    if len(values) != len(members):
        raise ValueError(f"{name} takes {len(members)} values: {', '.join(members)}")
    checked = [inputs.check(*pair) for pair in zip(members, values, strict=True)]
    yield from zip(members, checked, strict=True)
