"""The verb `net program`, which downloads firmware to a node."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Final

import click

from tickrig.host.canmon.model.decode.decoded import write_entry
from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.node_objects import Entry
from tickrig.host.canmon.net.session import (
    NetSession,
    NodeFailed,
    dry_run_option,
    net_session,
    of_node,
    print_plan,
)
from tickrig.host.canopen.commissioning.program import (
    COMMANDS,
    Program,
    ProgramFailed,
    ProgramStatus,
)
from tickrig.host.cli.messages import Refused, refusing, say
from tickrig.host.cli.options import NODE_ID, PATH, Choice
from tickrig.host.cli.start import paint

# A progress line on a terminal; none in a pipe.

_WIDTH = 30
_LEAST_S = 1
_S_US = 1_000_000


class ProgressBar:
    """Progress display of a program download, with the number of bytes, their total, and the rate.

    Args:
        total: total number of bytes.
        now_us: function that returns the present time of the bus in microseconds.
    """

    def __init__(self, total: int, now_us: Callable[[], int]) -> None:
        self._total, self._now_us, self._begun_us = total, now_us, now_us()
        self._shown = sys.stderr.isatty()
        self._text = ""

    def take(self, done: int) -> None:
        """Show the number of transferred bytes."""
        if not done:
            self._begun_us = self._now_us()
        text = self._line(done)
        if self._shown and text != self._text:
            self._text = text
            paint(sys.stderr, f"\r\x1b[K{text}")

    def end(self) -> None:
        """Clear the line."""
        if self._shown:
            paint(sys.stderr, "\r\x1b[K")

    def _line(self, done: int) -> str:
        share = done / self._total if self._total else 1.0
        full = round(share * _WIDTH)
        seconds = (self._now_us() - self._begun_us) / _S_US
        line = f"[{'#' * full}{'.' * (_WIDTH - full)}] {share:4.0%}  {done} of {self._total} bytes"
        if seconds < _LEAST_S or not done:
            return line
        rate = done / seconds
        return f"{line}  {rate / 1_000:.1f} kB/s  {(self._total - done) / rate:.0f} s left"


_MOST_BYTES: Final = 256 << 20
"""Largest size of firmware."""
_IDENTIFICATION: Final = re.compile(r"(?:0x)?([0-9a-f]{1,8})h?", re.IGNORECASE)
_NAMES: Final = {
    0x1F50: "program data",
    0x1F51: "program control",
    0x1F56: "program software identification",
    0x1F57: "flash status",
}
_RISK: Final = "The program stops: a drive releases its motor, a hanging load may fall"
_HALF: Final = (
    "the node has no whole program; a transfer cannot go on in its middle:"
    " the same command starts it again"
)


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("file", type=PATH, required=False)
@click.option(
    "--number",
    type=click.IntRange(1, 254),
    default=1,
    metavar="N",
    help="Number of the program.  [1]",
)
@click.option(
    "--control", type=Choice(list(COMMANDS)), help="Send only this command to the program."
)
@click.option(
    "--expect",
    metavar="ID",
    help="Identification (1F56h) of FILE, in hex; skip if the node runs FILE.",
)
@click.option("--no-start", is_flag=True, help="Leave the program stopped.")
@click.option(
    "--tries",
    type=click.IntRange(1, 99),
    default=3,
    metavar="N",
    help="Maximum number of transfers.  [3]",
)
@dry_run_option
@click.option("--yes", is_flag=True, help="Do not ask for confirmation.")
@click.pass_obj
def command(  # noqa: PLR0913, PLR0917 - options
    call: NetCall,
    node: int,
    file: Path | None,
    number: int,
    control: str | None,
    expect: str | None,
    no_start: bool,
    tries: int,
    dry_run: bool,
    yes: bool,
) -> None:
    """Download FILE to NODE by block transfer (CiA 302-3). Without FILE, show the program of NODE.

    The steps are: stop and clear (1F51h), download (1F50h), wait for the flash (1F57h), compare the
    identification (1F56h), start. After an interruption, repeat the same command. The transfer then
    starts again from the beginning, as CiA 301 requires. Lost blocks are sent again.

    \b
    canmon net can0 program 5
    canmon net can0 program 5 firmware.bin --dry-run
    canmon net can0 program 5 firmware.bin --expect 1A2B3C4D
    canmon net can0 program 5 --control start
    """  # noqa: D301 - click wants the backspace
    if file is not None and control is not None:
        raise Refused("FILE or --control: which? give one")
    if dry_run and file is None and control is None:
        raise Refused("--dry-run of what? give FILE or --control; without them nothing is written")
    data = b"" if file is None else _read(file)
    wanted = None if expect is None else _identification(expect)
    with net_session(call, node) as session:
        program = Program(session.bus, node, number, lambda text: say(f"node {node}: {text}"))
        try:
            with of_node(node, _title):
                status = program.status()
                if file is not None:
                    click.echo(f"node {node}: {status}")
                    runs = status.control == COMMANDS["start"] and status.identification == wanted
                    if runs and wanted is not None:
                        say(f"node {node}: it runs what is expected; nothing is to be done")
                        return
                    if dry_run:
                        print_plan(*_plan(status, number, len(data), start=not no_start))
                        return
                    what = f"{len(data)} bytes of {file.name} into program {number} of node {node}"
                    session.confirm(what, yes=yes, risk=_RISK)
                    _download(session, program, data, wanted, tries=tries, start=not no_start)
                elif control is not None:
                    if dry_run:
                        print_plan(_command_text(number, control))
                        return
                    risk = (
                        _RISK if control != "start" else "This may turn a motor: the program runs"
                    )
                    what = f"program {number} of node {node}: {control}"
                    session.confirm(what, yes=yes, risk=risk)
                    program.command(COMMANDS[control])
                    session.bus.gather(session.timeout_us)
            click.echo(f"node {node}: {program.status()}")
        except ProgramFailed as error:
            raise NodeFailed(f"node {node}: {error}") from None


def _plan(status: ProgramStatus, number: int, size: int, *, start: bool) -> list[str]:
    """Return the writes of a download, in order."""
    words = ["clear"] if status.control == COMMANDS["stop"] else ["stop", "clear"]
    steps = [_command_text(number, word) for word in words]
    steps.append(f"{_title((0x1F50, number))} = {size} bytes")
    return [*steps, _command_text(number, "start")] if start else steps


def _command_text(number: int, word: str) -> str:
    return f"{_title((0x1F51, number))} = {COMMANDS[word]} ({word})"


def _title(entry: Entry) -> str:
    """Return the name of an object of a program."""
    return f"{write_entry(entry)} {_NAMES.get(entry[0], '')}".rstrip()


def _read(file: Path) -> bytes:
    """Read the firmware. Raise Refused if it is unreadable, empty or too large."""
    with refusing("FILE"), file.open("rb") as opened:
        data = opened.read(_MOST_BYTES + 1)
    if not data:
        raise Refused(f"FILE {file}: it is empty")
    if len(data) > _MOST_BYTES:
        raise Refused(f"FILE {file}: more than {_MOST_BYTES >> 20} MiB: no firmware")
    return data


def _identification(text: str) -> int:
    match = _IDENTIFICATION.fullmatch(text)
    if match is None:
        raise Refused(f"--expect {text!r} is no identification of up to 8 hex digits, as 1A2B3C4D")
    return int(match[1], 16)


def _download(  # noqa: PLR0913 - steps
    session: NetSession,
    program: Program,
    data: bytes,
    wanted: int | None,
    *,
    tries: int,
    start: bool,
) -> None:
    """Run each step. If a step ends the program, print the message for this step."""
    work = session.work
    work.plan("stop", "clear", "download", "identification", *(["start"] if start else []))
    program.stop()
    work.done()
    program.clear()
    work.done()
    work.ending = _HALF
    bar = ProgressBar(len(data), lambda: session.bus.now_us)
    try:
        program.download(data, bar.take, tries)
    finally:
        bar.end()
    work.done()
    say(f"{len(data)} bytes written")
    work.ending = "the program is written, and not started"
    found = program.status().identification
    if wanted is not None and found != wanted:
        said = "none" if found is None else f"{found:08X}h"
        raise ProgramFailed(f"its identification (1F56h) is {said}, {wanted:08X}h was expected")
    work.done()
    if start:
        program.start()
        work.done()
    work.ending = ""
