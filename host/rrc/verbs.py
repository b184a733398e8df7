"""The work of the verbs of `rrc`."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from types import FrameType
from typing import Any, Final, Protocol

import click

from tickrig.host.cli.messages import Refused, SourceFailed, refuse_path, refused_at, say
from tickrig.host.cli.start import give_up_terminals, taking_signals
from tickrig.host.links.game_pad import EvdevPad
from tickrig.host.links.link import DeviceRefused, LinkClosed, LinkError, first_line
from tickrig.host.links.ready import ready
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.links.terminal import TerminalOutput, take_keys
from tickrig.host.rrc.chair import STEP_US, Chair, ChairStopped, DeadMan, Guard
from tickrig.host.rrc.cli import RrcCall
from tickrig.host.rrc.client import RrcClient
from tickrig.host.rrc.procedure import STEPS, Procedure, Quit, StepResult
from tickrig.host.text.page_text import json_text
from tickrig.host.text.values import counted, format_time, parse_time_with_unit_us
from tickrig.host.text.whole_file import write_whole
from tickrig.wire.instant import NEVER
from tickrig.wire.rrc.commands import Joystick, Limit
from tickrig.wire.rrc.replies import StatusA

_SHOWN_AS: Final = {"in_v_pct": "stick_v_pct", "in_w_pct": "stick_w_pct"}
"""Values of a status line that the emulator's inputs have under another name."""

_MOST_BEEPS: Final = 10
_SHOWN_US: Final = 100_000


class Ended:
    """Record of a signal such as SIGINT. Loops check this record and end after a signal.

    Attributes:
        number: number of the first signal that the process received, or 0 if it received none.
    """

    number = 0

    def received(self, number: int, frame: FrameType | None) -> None:
        """Record a signal."""
        self.number = self.number or number


@contextmanager
def open_chair(ended: Ended, *, stable: bool = True) -> Iterator[Chair]:
    """Context manager that yields the wheelchair at the port given on the command line.

    At the end, the chair is stopped.

    Args:
        ended: object that records signals such as SIGINT.
        stable: whether to switch stablemode on, unless an option of the command line prevents it.

    Raises:
        click.ClickException: the command failed. The message is one line, and the exit status is 1
            or 3.
        KeyboardInterrupt: the process received a signal. The error is raised after the chair was
            stopped.
    """
    call = click.get_current_context().find_object(RrcCall)
    assert call is not None
    if not call.url:
        raise Refused("no URL: rrc /dev/ttyACM0 VERB")
    chair: Chair | None = None
    with taking_signals(ended.received):
        try:
            with Chair(
                SerialLink(call.url), Guard(call.watchdog_us, call.stable and stable)
            ) as chair:
                yield chair
        except LinkError as error:
            raise SourceFailed(_lost(call, error, chair)) from error
        except (DeviceRefused, ChairStopped) as error:
            raise click.ClickException(str(error)) from error
    if ended.number:
        give_up_terminals()
        raise KeyboardInterrupt(ended.number)


def _lost(call: RrcCall, error: LinkError, chair: Chair | None) -> str:
    text = first_line(error)
    named = text if call.url in text else f"{call.url}: {text}"
    if chair is None or not chair.moved:
        return named
    if call.watchdog_us:
        return f"{named}; the watchdog stops VR2 within {call.watchdog_us // 1_000} ms"
    return f"{named}; no watchdog was set: stop the chair by its power button"


def described(status: StatusA) -> dict[str, int]:
    """Return the values of a status line by the names that the emulator uses."""
    return {_SHOWN_AS.get(name, name): value for name, value in asdict(status).items()}


def status(*, as_json: bool) -> None:
    """Print the connected device and its state."""
    with open_chair(Ended()) as chair:
        client = chair.client
        found = {"device": client.device(), "version": client.version(), "date": client.date()}
        sa = chair.status()
    values: dict[str, object] = {**found, "vr2": "off" if sa is None else "on"}
    values |= {} if sa is None else described(sa)
    if as_json:
        click.echo(json_text(values))
        return
    for name, value in values.items():
        click.echo(f"{name:<17}{value}")


class _DriveInput(Protocol):
    """The source of the values to drive.

    Attributes:
        hint: instructions for the user, for the line of the terminal.
        leaves: whether the user requested the end.
    """

    hint: str
    leaves: bool

    def poll(self, now_us: int) -> tuple[int, int]:
        """Return the translation and rotation to drive now, in per cent.

        The method raises ChairStopped if the terminal or the game pad is gone.
        """
        ...

    def close(self) -> None:
        """Release the keys or the pad."""


class _Script:
    """An input that drives without a dead-man key."""

    hint, leaves = "", False

    def __init__(self, v_pct: int, w_pct: int) -> None:
        self._drive = v_pct, w_pct

    def poll(self, now_us: int) -> tuple[int, int]:
        return self._drive

    def close(self) -> None:
        """Do nothing, because there is nothing to release."""


class _Keys:
    """An input that drives while SPACE arrives from the terminal."""

    hint, leaves = "   SPACE drives, q ends", False

    def __init__(self, v_pct: int, w_pct: int) -> None:
        self._drive, self._dead_man = (v_pct, w_pct), DeadMan()
        self._fd = sys.stdin.fileno()
        try:
            self.close = take_keys(self._fd)
        except OSError as error:
            raise Refused(f"the keyboard is no terminal: {error.strerror}") from error

    def poll(self, now_us: int) -> tuple[int, int]:
        try:
            keys = os.read(self._fd, 256)
        except OSError as error:
            raise ChairStopped(f"the terminal is gone: {error.strerror}") from error
        if b" " in keys:
            self._dead_man.press(now_us)
        if keys.strip(b" "):  # any other key releases it
            self._dead_man.release()
        self.leaves = self.leaves or b"q" in keys
        return self._drive if self._dead_man.holds(now_us) else (0, 0)


class _PadHand:
    """An input that drives by the left stick of a game pad while one of its buttons is held.

    Args:
        path: path of the pad.
        v_pct: largest translation, in per cent.
        w_pct: largest rotation, in per cent.
    """

    hint, leaves = "   a button drives", False
    _REST: Final = 0.1

    def __init__(self, path: str, v_pct: int, w_pct: int) -> None:
        self._pad, self._most = EvdevPad(path), (abs(v_pct), abs(w_pct))
        self.close = self._pad.close

    def poll(self, now_us: int) -> tuple[int, int]:
        """Return the values of the stick, which are 0 while no button is held."""
        try:
            hand = self._pad.poll(now_us)
        except LinkClosed as error:
            raise ChairStopped(str(error)) from error
        if not self._pad.held:
            return 0, 0
        forward, right = (x if abs(x) > self._REST else 0.0 for x in (hand.forward, -hand.turn))
        return round(forward * self._most[0]), round(right * self._most[1])


def open_pad(path: str, v_pct: int = 100, w_pct: int = 100) -> _PadHand:
    """Open a game pad. Raise Refused if that fails."""
    try:
        return _PadHand(path, v_pct, w_pct)
    except LinkClosed as error:
        raise Refused(str(error)) from error


def _drive_input(v_pct: int, w_pct: int, for_us: int | None, *, no_dead_man: bool) -> _DriveInput:
    call = click.get_current_context().find_object(RrcCall)
    if call is not None and call.pad is not None:
        return open_pad(call.pad, v_pct, w_pct)
    if no_dead_man or not sys.stdin.isatty():
        if for_us is None:
            raise Refused("nothing holds a dead-man key: call it on a terminal, or give --for TIME")
        return _Script(v_pct, w_pct)
    return _Keys(v_pct, w_pct)


class _Line:
    """One line of the terminal that is overwritten repeatedly. Without a terminal, it is not shown.

    A terminal that accepts no data does not delay the chair.

    Attributes:
        is_live: whether standard error is a terminal.
    """

    def __init__(self) -> None:
        self._output = TerminalOutput(2) if sys.stderr.isatty() else None
        self._text, self._due_us = "", 0
        self.is_live = self._output is not None

    def show(self, now_us: int, text: str) -> None:
        if self._output is not None and text != self._text and now_us >= self._due_us:
            self._output.write(f"\r{text}\x1b[K")
            self._text, self._due_us = text, now_us + _SHOWN_US

    def close(self) -> None:
        if self._output is not None:
            if self._text:
                self._output.write("\r\n", last=True)
            self._output.close()


def _shown(client: RrcClient) -> str:
    if client.latest_status is None:
        return ""
    sa = client.latest_status.value
    return (
        f"stick {sa.in_v_pct:+} {sa.in_w_pct:+}  out {sa.out_v_pct:+} {sa.out_w_pct:+}"
        f"  gauge {sa.gauge}  speed {sa.speed_mode}"
    )


def drive(*, v_pct: int, w_pct: int, speed: int, for_us: int | None, no_dead_man: bool) -> None:
    """Drive while the dead-man key is held."""
    ended = Ended()
    with (
        closing(_drive_input(v_pct, w_pct, for_us, no_dead_man=no_dead_man)) as control,
        closing(_Line()) as line,
        open_chair(ended) as chair,
    ):
        client = chair.client
        chair.require_on()
        chair.take_over(speed)
        end_us = NEVER if for_us is None else client.now_us + for_us
        while not (ended.number or control.leaves) and client.now_us < end_us:
            chair.drive(*control.poll(client.now_us))
            line.show(client.now_us, _shown(client) + control.hint)


_STICK_DRIVES: Final = "the stick drives, Ctrl-C ends"


def limit(*, speed: int, for_us: int | None, leave: bool, **limits: int) -> None:
    """Drive by the stick."""
    if leave and for_us is not None:
        raise Refused("--leave and --for: give one of them")
    ended = Ended()
    with closing(_Line()) as line, open_chair(ended) as chair:
        client = chair.client
        chair.require_on()
        chair.drive_by_stick(Limit(**limits), speed)
        if leave:
            chair.leave_driving()
            return
        if not line.is_live:  # in a script, or in the background of one
            say(_STICK_DRIVES)
        end_us = NEVER if for_us is None else client.now_us + for_us
        while not ended.number and client.now_us < end_us:
            client.run_for(STEP_US)
            chair.watch()
            line.show(client.now_us, f"{_shown(client)}   {_STICK_DRIVES}")


def _once(act: Callable[[RrcClient], object]) -> None:
    with open_chair(Ended()) as chair:
        act(chair.client)


def stick(
    *, low: tuple[int, int], high: tuple[int, int], exponent: tuple[int, int], **gears: int
) -> None:
    """Shape the stick."""
    with refused_at("stick"):
        shape = Joystick(*low, *high, *exponent, **gears)
    _once(lambda client: client.joystick(shape))


def speed(*, mode: int, lock: bool) -> None:
    """Choose the speed mode."""
    _once(lambda client: client.speedmode(mode, locked=lock))


def beep(*, times: tuple[str, ...]) -> None:
    """Sound the buzzer."""
    if len(times) > _MOST_BEEPS:
        raise Refused(f"{len(times)} times, an RRC takes at most {_MOST_BEEPS}")
    with refused_at("beep"):
        times_us = [parse_time_with_unit_us(each) for each in times]
        for word, time_us in zip(times, times_us, strict=True):
            if time_us % 10_000 or time_us > 2_550_000:
                raise ValueError(f"{word} is not 0..2550ms in steps of 10ms")
    _once(lambda client: client.beep(*times_us))


def poweroff() -> None:
    """Force VR2 to stop."""
    with open_chair(Ended()) as chair:
        chair.require_on()
        chair.client.poweroff()


def watch(*, for_us: int | None, every: bool, as_json: bool) -> None:
    """Print events and status changes."""
    ended = Ended()
    with open_chair(ended) as chair, suppress(BrokenPipeError):
        client = chair.client
        chair.status()
        began_us = client.now_us
        end_us = NEVER if for_us is None else began_us + for_us
        before: StatusA | None = None
        while not ended.number and client.now_us < end_us:
            client.run_for(STEP_US)
            chair.ask_if_silent()
            lines: list[tuple[int, dict[str, object]]] = [
                (each.at_us, {"event": each.value.name}) for each in client.events(0)
            ]
            for sa in client.statuses(0):
                if every or sa.value != before:
                    lines.append((sa.at_us, dict(described(sa.value))))
                before = sa.value
            for at_us, values in sorted(lines, key=lambda line: line[0]):
                _print(at_us - began_us, values, as_json=as_json)


def _print(at_us: int, values: dict[str, Any], *, as_json: bool) -> None:
    if as_json:
        click.echo(json_text({"at_us": at_us, **values}))
    else:
        shown = "  ".join(f"{name} {value}" for name, value in values.items())
        click.echo(f"{format_time(max(0, at_us)):>12}  {shown}")
    sys.stdout.flush()


class _TerminalOperator:
    """The person who reads standard error and types answers.

    Args:
        chair: chair that is stepped while the program waits for an answer, so that the watchdog is
            renewed.
        ended: signal that ends the procedure.
    """

    def __init__(self, chair: Chair, ended: Ended) -> None:
        self._chair, self._ended = chair, ended
        self._typed = b""

    def instruct(self, text: str) -> None:
        say(f"   {text}")

    def confirms(self, question: str) -> bool:
        click.echo(f"   {question} [y/n/q] ", nl=False, err=True)
        while True:
            self.waits()
            self._chair.client.run_for(STEP_US)
            answer, ended, rest = self._typed.partition(b"\n")
            if not ended:
                continue
            self._typed = rest
            word = answer.strip().lower()
            if word in (b"y", b"yes", b"n", b"no"):
                return word.startswith(b"y")
            if word in (b"q", b"quit"):
                raise Quit("ended by the operator")
            click.echo(f"   {question} type y, n or q: ", nl=False, err=True)

    def waits(self) -> None:
        if self._ended.number:
            raise Quit("interrupted")
        if ready([0], (), 0)[0]:
            data = os.read(0, 1_024)
            if not data:
                raise Quit("standard input has ended")
            self._typed += data


def test(*, json_path: str | None) -> None:
    """Run the test procedure."""
    if sys.platform == "win32":
        raise Refused("the test procedure needs a POSIX terminal")
    else:  # noqa: RET506 - mypy leaves out the branch of the other system
        _lead(json_path)


def _lead(json_path: str | None) -> None:
    if json_path is not None and not (folder := Path(json_path).parent).is_dir():
        raise Refused(f"results {json_path}: no directory {folder}")  # now, not at the end
    ended = Ended()
    results: list[StepResult] = []
    quits = ""

    def report(result: StepResult) -> None:
        verdict = "ok" if result.passed else f"FAILED: {result.reason}"
        sent = f"{result.sent}{result.check}"
        say(f"{len(results) + 1:>2} {result.step}{f' ({sent})' if sent else ''}: {verdict}")
        results.append(result)

    found: dict[str, str] = {}
    try:
        with open_chair(ended, stable=False) as chair:
            client = chair.client
            if client.stable:
                client.stablemode(on=False)
            found = {"device": client.device(), "version": client.version(), "date": client.date()}
            say(", ".join(found.values()))
            try:
                Procedure(chair, _TerminalOperator(chair, ended), report).run()
            except Quit as quit_:
                quits = str(quit_)
    finally:  # what was done is written, whatever ended it
        if json_path is not None and found:
            steps = [asdict(each) for each in results]
            complete = len(results) == STEPS
            _write_json(json_path, {**found, "complete": complete, "steps": steps})
    failed = sum(not each.passed for each in results)
    if quits:
        raise click.ClickException(f"not complete: {quits}; {counted(len(results), 'step')} done")
    if failed:
        raise click.ClickException(f"{failed} of {counted(len(results), 'step')} failed")
    say(f"all {counted(len(results), 'step')} passed")


def _write_json(path: str, document: object) -> None:
    if path == "-":
        click.echo(json_text(document))
        return
    try:
        write_whole(Path(path), json_text(document) + "\n")
    except OSError as error:
        refuse_path("results", error)
