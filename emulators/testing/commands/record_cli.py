"""The command `tickrig record`."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from tickrig.emulators.commands.run_options import type_option
from tickrig.host.cli.control import stopped_by_signals
from tickrig.host.cli.messages import Refused, refuse_path, refused_at, say, warnings_shown
from tickrig.host.cli.options import PATH
from tickrig.host.cli.start import loading

if TYPE_CHECKING:
    from tickrig.emulators.rig.emulated import Inputs
    from tickrig.emulators.serial.pty_port import PtyPort
    from tickrig.host.links.recording_link import RecordingLink

_BAUD: Final = 115_200
_RESET: Final = "reset"

_PORT_GONE: Final = 1
_RECORDING_ENDED: Final = 3


@click.command("record")
@click.argument("port")
@click.option("-o", "--out", type=PATH, required=True, metavar="FILE", help="The trace.")
@type_option("Device type, as of 'tickrig emu': rrc.")
@click.option("--link", type=PATH, help="Symbolic link to make to the host's terminal.")
@click.option("--baud", type=click.IntRange(1), help="Of the port.  [that of the type, or 115200]")
@click.pass_context
def record_command(  # noqa: PLR0913 - options
    context: click.Context,
    /,
    *,
    port: str,
    out: Path,
    type_name: str,
    link: Path | None,
    baud: int | None,
) -> None:
    """Record what passes between a host and the device at PORT, for `tickrig compare`.

    The host opens the terminal that is printed, or --link, instead of PORT: a device path
    or a URL of pyserial. Bytes pass unchanged and at once. What is done to the device by hand
    is typed here, and is in the trace: NAME=VALUE sets an input, as power_button=1;
    reset says that it was switched off and on. Ctrl-C ends.

    Exit status 1 if the port is gone, 3 if the recording is not whole.

    \b
    tickrig record /dev/ttyUSB0 --out run.trace --type rrc --link /tmp/rrc
    tickrig compare run.trace
    """  # noqa: D301 - click wants the backspace
    with loading():
        from tickrig.emulators.testing.commands.port_tap import PortTap  # noqa: PLC0415 - slow

    usual_baud, inputs = _known(type_name)
    with ExitStack() as stack:
        stack.enter_context(warnings_shown())
        pty = _open_pty(stack, link, baud or usual_baud)
        recorded = _open_port(port, baud or usual_baud, out, type_name)
        stack.callback(recorded.close)
        tap = PortTap(recorded, pty, _typing(recorded, inputs), _late)
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
    context.exit(_RECORDING_ENDED if recorded.recording_error else _PORT_GONE if tap.gone else 0)


def _known(type_name: str) -> tuple[int, Inputs | None]:
    """Return the baud rate and the inputs of a device type."""
    if not type_name:
        return _BAUD, None
    from tickrig.emulators.commands.device_type import DEVICES, configure  # noqa: PLC0415
    from tickrig.host.text.names import near  # noqa: PLC0415

    if type_name not in DEVICES.names():
        raise Refused(f"--type: no device {type_name!r}; {near(type_name, DEVICES.names())}")
    with refused_at("--type"):
        made = configure(type_name, {})
    return made.type.line.baud, made.device.inputs


def _open_port(port: str, baud: int, out: Path, type_name: str) -> RecordingLink[bytes]:
    from tickrig.host.links.link import LinkClosed  # noqa: PLC0415 - slow
    from tickrig.host.links.recording_link import RecordingLink  # noqa: PLC0415
    from tickrig.host.links.serial_link import SerialLink  # noqa: PLC0415

    try:
        line = SerialLink(port, baud)
    except LinkClosed as error:
        raise Refused(str(error)) from None
    try:
        return RecordingLink(line, out, name=type_name or "device", type=type_name)
    except OSError as error:
        line.close()
        refuse_path("trace", error)


def _open_pty(stack: ExitStack, link: Path | None, baud: int) -> PtyPort:
    from tickrig.emulators.serial.pty_port import PtyPort  # noqa: PLC0415 - slow

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
    say(f"stopped for {seconds:.1f} s: what passed meanwhile has the time when it was handed on")


def _terminal() -> int | None:
    """Return where the operator types."""
    signal.signal(signal.SIGTTIN, signal.SIG_IGN)  # a job in the background reads nothing
    try:
        return sys.stdin.fileno()
    except (OSError, ValueError, AttributeError):  # none, or closed
        return None


def _typing(link: RecordingLink[bytes], inputs: Inputs | None) -> Callable[[str], None]:
    """Return what takes a line that was typed."""

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
    """Read `NAME=VALUE`, of a group `NAME=VALUE,VALUE`; ValueError if it is none."""
    from tickrig.host.text.bench_header import NAME  # noqa: PLC0415 - slow
    from tickrig.host.text.values import parse_setting  # noqa: PLC0415

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
