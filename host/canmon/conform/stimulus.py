"""Stimuli of the device by a command, an operator, or the control socket of an emulator."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Collection
from pathlib import Path
from typing import Any, Final, NamedTuple

import click

from tickrig.host.canmon.conform.conform_source import ConformSource
from tickrig.host.canmon.output.listening import until_interrupted
from tickrig.host.canopen.conform.bus.exchange import Disturbed, NotAllowed
from tickrig.host.canopen.conform.check import Level, Stimulus
from tickrig.host.canopen.conform.notation import LSS_TO_ALL
from tickrig.host.canopen.conform.verdict import NOTHING_JUDGED, CheckVerdict, Result
from tickrig.host.cli.messages import Refused, refused_at, say, until_unread
from tickrig.host.cli.start import INTERRUPTED, paint
from tickrig.host.control.client import ControlClient, ControlRefused
from tickrig.host.control.requests import Object
from tickrig.host.links.link import StampedLink
from tickrig.host.text.page_text import one_line
from tickrig.host.text.values import Setting, counted, parse_setting
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.errors import FieldError

# Stimuli that set inputs of an emulated device by signal name (docs/reference/bench/control.md).

_HEX = "hex:"
"""Prefix for the bytes of an octet string or a domain."""

_LINES: Final = 8
"""Number of lines per group. `di1` stands for lines 1 to 8, `di2` for lines 9 to 16."""
_CHANNEL: Final = re.compile(r"(di|do|ai)([1-9][0-9]{0,2})")
_INPUTS: Final = {"6000": "di", "6401": "ai"}
"""Objects of CiA 401 that show inputs, with the names of these inputs."""


class LinearConverter(NamedTuple):
    """Linear conversion between an input of a device and the CANopen object that shows this input.

    When the input changes from `low` to `high`, the value of the object changes from `first` to
    `last` in steps of `step`.
    """

    low: float
    high: float
    first: int
    last: int
    step: int


class SignalStimulus(ABC):
    """Base class for stimuli, which operate the node under test while checks run.

    A stimulus sets inputs, reads outputs and switches the power supply. A check requests these
    actions by the names of the signals.
    """

    def __call__(self, *words: str) -> str:
        """Execute a stimulus, and return the read value.

        Raises:
            NotAllowed: the device does not support the stimulus.
            Disturbed: the stimulus failed.
        """
        try:
            return self._act(*words)
        except (ControlRefused, KeyError) as error:
            known = any(_signal_name(word) in self.names() for word in words[1:2])
            kind = Disturbed if known else NotAllowed
            raise kind(f"{' '.join(words)}: {one_line(str(error))}") from None
        except (OSError, ValueError, FieldError) as error:
            text = getattr(error, "strerror", None) or str(error) or type(error).__name__
            raise Disturbed(f"{' '.join(words)}: {one_line(text)}") from None

    def _act(self, *words: str) -> str:
        match words:
            case ("input", name, value):
                self._input(name, value)
            case ("output", name):
                return self._output(name)
            case ("emergency", code, *_):
                self._set_emergency(int(code, 16))
            case ("emergency-clear", *_):
                self._set_emergency(0)
            case ("power", ("on" | "off") as state):
                self.switch(on=state == "on")
            case _:
                raise NotAllowed(f"{' '.join(words)}: the device has nothing of the kind")
        return ""

    def _input(self, name: str, value: str) -> None:
        """Set an input. A CiA 401 module also accepts an object, for eight lines or for counts."""
        module = "di1" in self.names() or self._channels("ai1")
        index, _, sub = name.partition(":")
        if module and index in _INPUTS:
            data = int.from_bytes(bytes.fromhex(value), "little", signed=_INPUTS[index] == "ai")
            name = f"{_INPUTS[index]}{int(sub, 16)}"
            value = f"{data:02X}" if _INPUTS[index] == "di" else f"{data}"
        channel = _CHANNEL.fullmatch(name) if module else None
        if channel and channel[1] == "di":
            self._set_lines(int(channel[2]), int(value, 16))
        elif channel and name not in self.names() and (others := self._channels(name)):
            self.set(others[0], self._quantity(others[0], int(value)))
        else:
            signal = _signal_name(name)
            self.set(signal, _value(value, self.unit(signal)))

    def _quantity(self, name: str, counts: int) -> float:
        """Return the value that a converter turns into these counts."""
        span = self.span(name)
        if span is None:
            raise ValueError(f"{name} takes {self.unit(name)}, and its counts are not known here")
        if counts not in range(span.first, span.last + 1, span.step):
            raise NotAllowed(f"the converter of {name} has no step of {counts} counts")
        part = (counts - span.first) / (span.last - span.first)
        return span.low + part * (span.high - span.low)

    def _channels(self, name: str) -> list[str]:
        """Return an analogue input that has a unit. `ai1_v` is the input `ai1`."""
        return [each for each in self.names() if each.startswith(f"{name}_")]

    def _set_lines(self, number: int, levels: int) -> None:
        """Set eight lines. Missing lines can only be low."""
        for bit in range(_LINES):
            line, level = f"di{_LINES * (number - 1) + bit + 1}", levels >> bit & 1
            if line in self.names():
                self.set(line, level)
            elif level:
                raise NotAllowed(f"the device has no input {line}")

    def _output(self, name: str) -> str:
        channel = _CHANNEL.fullmatch(name)
        if channel and channel[1] == "do" and "do" in self.names():
            levels = self.get("do")
            return f"{int(levels) >> _LINES * (int(channel[2]) - 1) & 0xFF:02X}"
        signal = _signal_name(name)
        return _hex(self.get(signal), self.unit(signal))

    def _set_emergency(self, code: int) -> None:
        """Start or clear an error. Only one error at a time is possible."""
        if code and self.get("emergency"):
            raise NotAllowed("a second error at once: the device takes one by hand")
        self.set("emergency", code)

    @abstractmethod
    def set(self, name: str, value: Setting) -> None:
        """Set an input. Raise ValueError if that is impossible."""

    @abstractmethod
    def get(self, name: str) -> Setting:
        """Return the value of a signal. Raise ValueError if there is no such signal."""

    @abstractmethod
    def names(self) -> Collection[str]:
        """Return the names of all signals of the device."""

    @abstractmethod
    def unit(self, name: str) -> str:
        """Return the unit of a signal, such as `mm`. For an object, return its data type.

        If neither is known, the result is empty.
        """

    @abstractmethod
    def span(self, name: str) -> LinearConverter | None:
        """Return the converter of an input, or None if it is unknown."""

    @abstractmethod
    def switch(self, *, on: bool) -> None:
        """Switch the power supply."""


def _signal_name(name: str) -> str:
    """Return the emulator's name for an object of a check.

    >>> _signal_name("6000:01"), _signal_name("2000:00"), _signal_name("stick")
    ('0x6000:1', '0x2000', 'stick')
    """
    index, colon, sub = name.partition(":")
    if not colon:
        return name
    return f"0x{index}:{int(sub, 16)}" if int(sub, 16) else f"0x{index}"


def _value(text: str, unit: str) -> Setting:
    """Read the bytes of an object as the type of the object, or as a number."""
    if unit not in DataType.__members__:
        return parse_setting(text)
    value = DataType[unit].decode(bytes.fromhex(text))
    return f"{_HEX}{value.hex()}" if isinstance(value, bytes) else value


def _hex(value: Setting, unit: str) -> str:
    """Return the value of an object in hex, as it is sent on the bus."""
    if unit not in DataType.__members__:
        return str(value)
    if isinstance(value, str) and value.startswith(_HEX):
        return value.removeprefix(_HEX).upper()
    return DataType[unit].encode(value).hex().upper()


_OPERATOR: Final = "ask"
CONTROL: Final = "control:"
_CANNOT: Final = 77
"""Exit status of a command that does not support an input, as in C test suites."""
_PATIENCE_S: Final = 30
"""Time-out of a command in seconds."""


def open_stimulus(text: str) -> Stimulus:
    """Return the stimulus that operates the inputs of the node under test.

    Args:
        text: value of the option `--stimulus`. For `ask`, the user is asked to operate the inputs.
            For `control:PATH` or the path of a control socket, the emulator that serves this socket
            operates them. Any other text is a command line. This command is executed to operate the
            inputs.

    Raises:
        Refused: the text is not a command line, or `ask` is used without a terminal.
    """
    if text == _OPERATOR:
        if not sys.stdin.isatty():
            raise Refused("--stimulus ask needs a terminal")
        return _ask_operator
    place = text.removeprefix(CONTROL)
    if place and (place != text or Path(place).is_socket()):
        return _ControlStimulus(Path(place))
    with refused_at("--stimulus"):
        words = shlex.split(place)
    if not words:
        raise Refused("--stimulus wants a command, ask, or the path of a control socket")
    if shutil.which(words[0]) is None:
        raise Refused(f"--stimulus {words[0]!r}: no such command, and no control socket")
    return CommandStimulus(words)


def _ask_operator(*words: str) -> str:
    """Ask the operator, who also types in values of outputs."""
    text = one_line(" ".join(words))
    if words[0] == "output":
        return str(click.prompt(f"What is {text}, in hex", err=True))
    if not click.confirm(f"Now: {text}. Done?", default=True, err=True):
        raise NotAllowed(f"{text}: the operator cannot do it")
    return ""


class CommandStimulus:
    """Stimulus that runs an external command each time a check operates or reads a signal.

    A check passes words that say what to operate or read. They become the last arguments of the
    command. No shell is used.

    Args:
        words: command and its arguments.
    """

    def __init__(self, words: list[str]) -> None:
        self._words = words

    def __call__(self, *words: str) -> str:
        """Call the command. Return the first line of its output.

        Raises:
            NotAllowed: the command ends with `_CANNOT`.
            Disturbed: the command cannot be run, does not end, or ends with an exit status other
                than 0.
        """
        line = " ".join([*self._words, *words])
        try:
            ended = subprocess.run(
                [*self._words, *words],
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=_PATIENCE_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise Disturbed(f"{line}: not done within {_PATIENCE_S} s") from None
        except OSError as error:
            raise Disturbed(f"{line}: {error.strerror}") from None
        if ended.returncode == _CANNOT:
            raise NotAllowed(f"{line}: the command has nothing of the kind")
        if ended.returncode:
            said = ended.stderr.decode("utf-8", "replace").strip().splitlines()
            why = f": {one_line(said[-1])}" if said else ""
            raise Disturbed(f"{line}: exit status {ended.returncode}{why}")
        return next(iter(ended.stdout.decode("utf-8", "replace").splitlines()), "").strip()


class _ControlStimulus(SignalStimulus):
    """Stimulus through the control socket of an emulator (docs/reference/bench/control.md).

    Args:
        path: path of the socket.

    Raises:
        Refused: the socket does not answer.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._units = path, dict[str, str]()
        self._spans: dict[str, LinearConverter] = {}
        try:
            self._learn(self._request("describe"))
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise Refused(f"--stimulus {path}: {reason}") from None
        except (AttributeError, KeyError, TypeError):
            raise Refused(f"--stimulus {path}: no emulator: what it describes is none") from None

    def _learn(self, described: Any) -> None:
        """Read names, units and converters (docs/reference/bench/control.md)."""
        for item in (*described.get("inputs", ()), *described.get("outputs", ())):
            self._units[item["name"]] = str(item.get("unit", ""))
            if "counts" in item:
                self._spans[item["name"]] = LinearConverter(
                    item["low"], item["high"], *item["counts"]
                )

    def set(self, name: str, value: Setting) -> None:
        """Set an input."""
        self._request("set", name=name, value=value)

    def get(self, name: str) -> Setting:
        """Return the value of a signal."""
        values: Any = self._request("get", names=[name])["values"]
        value: Setting = values[name]
        return value

    def names(self) -> Collection[str]:
        """Return the names reported by the emulator."""
        return self._units.keys()

    def unit(self, name: str) -> str:
        """Return the unit reported by the emulator."""
        return self._units.get(name, "")

    def span(self, name: str) -> LinearConverter | None:
        """Return the converter reported by the emulator."""
        return self._spans.get(name)

    def switch(self, *, on: bool) -> None:
        """Start or clear the fault `power_off`."""
        if on:
            self._request("clear", name="power_off")
        else:
            self._request("fault", spec="power_off")

    def _request(self, do: str, **fields: object) -> Object:
        with ControlClient(self._path) as client:
            return client.request(do, **fields)


# Nodes on a bus, found by listening only.

_LISTEN_US: Final = 1_500_000
"""Listening time, which is longer than most heartbeat periods. Silent nodes are not found."""

_FUNCTIONS: Final = (0x080, 0x180, 0x280, 0x380, 0x480, 0x580, 0x700)
"""Frames of slaves in the pre-defined connection set (CiA 301 v4.2, 7.3.5)."""


def list_nodes(source: ConformSource) -> int:
    """Print the nodes on a bus, because the user has given no node-ID. Return the exit status."""
    found: list[dict[int, str]] = [source.nodes] if source.virtual else []
    with until_interrupted():
        if not found:
            heard = nodes_heard(source.link).items()
            found.append({node_id: counted(frames, "frame") for node_id, frames in heard})
    if not found:
        return INTERRUPTED
    with until_unread():
        for node_id, text in found[0].items():
            click.echo(f"node {node_id}  {text}")
    if found[0]:
        return 0
    say(f"no frames within {_LISTEN_US / 1e6:.1f} s; a node that sends nothing itself is not found")
    return NOTHING_JUDGED


def nodes_heard(link: StampedLink, span_us: int = _LISTEN_US) -> dict[int, int]:
    """Listen to a bus for some time. Return the number of received frames by node-ID of the sender.

    Args:
        link: connection to the bus. Other readers of this link do not get the received frames.
        span_us: time to listen, in microseconds.
    """
    heard = Counter[int]()
    until_us = link.now_us + span_us
    while (left_us := until_us - link.now_us) > 0:
        for _, frame in link.receive_stamped(left_us)[1]:
            if (node_id := _node_of(frame)) is not None:
                heard[node_id] += 1
    return dict(sorted(heard.items()))


def _node_of(frame: CanFrame) -> int | None:
    """Return the node-ID of a frame's sender according to its CAN-ID, or None if it is unknown."""
    node_id = frame.can_id & 0x7F
    sent = not (frame.extended or frame.remote) and node_id
    return node_id if sent and frame.can_id & 0x780 in _FUNCTIONS else None


_DOES = {
    Level.READ_ONLY: "is only read",
    Level.COMMUNICATION: (
        "is started, stopped and reconfigured, objects below 6000h are written with what they"
        " must refuse; SYNC and PDOs are sent"
    ),
    Level.INTRUSIVE: (
        "is reset, reconfigured, stored and restored, objects below 6000h are written;"
        " SYNC, PDOs, LSS are sent"
    ),
}


class Consent:
    """Consent of the user to tests that change a node.

    The consent is given by `--yes`, or the user is asked on the terminal.

    Args:
        yes: whether `--yes` gives consent to all actions.
        virtual: whether the node is emulated in virtual time, so that nothing real moves.
        alone: whether the node under test is the only node on the bus.
    """

    def __init__(self, *, yes: bool, virtual: bool, alone: bool = False) -> None:
        self._yes, self._virtual, self._alone = yes, virtual, alone

    @property
    def can_ask(self) -> bool:
        """Whether there is a terminal for questions."""
        return sys.stdin.isatty() and sys.stderr.isatty()

    def begin(self, node_id: int, level: Level, others: dict[int, int]) -> None:
        """Report other nodes on the bus, and ask the user for consent to the changes of the run.

        Raises:
            Refused: the user answers no, or there is no terminal on which to ask.
        """
        if others:
            say(f"also on this bus: {', '.join(f'node {each}' for each in others)}")
        if level is Level.READ_ONLY or self._yes or self._virtual:
            return
        what = f"node {node_id} {_DOES[level]}: what it drives may move, other nodes may trip"
        if not self.can_ask:
            raise Refused(f"{what}. There is no terminal to ask: give --yes, or --read-only")
        say(what)
        if not self.confirm("Go on?"):
            raise Refused("not started")

    def confirm(self, question: str) -> bool:
        """Ask the user a yes-or-no question. Return True for yes.

        The user is not asked in these cases:

        - With the option `--yes`, the answer is yes.
        - If the node is emulated in virtual time, the answer is also yes, with one exception. One
          of the questions is whether to send LSS requests to all nodes of the bus. If there are
          other nodes on the bus, the answer to this question is no, because these nodes would also
          answer.
        - In any other case, if there is no terminal, the answer is no.
        """
        if self._yes:
            return True
        if self._virtual:
            return self._alone or question != LSS_TO_ALL
        if not self.can_ask:
            return False
        return click.confirm(one_line(question), default=False, err=True)


class Progress:
    """Progress line that `canmon conform` shows on the terminal while checks run.

    Args:
        shown: whether to show the line. It is False if standard error is not a terminal.
    """

    def __init__(self, *, shown: bool) -> None:
        self._shown, self._judged, self._failed = shown, 0, 0

    def begin(self, node_id: int) -> None:
        """Show the activity before the first result."""
        if self._shown:
            paint(sys.stderr, f"\r\x1b[Knode {node_id} is read")

    def take(self, result: Result) -> None:
        """Count a result."""
        self._judged += 1
        self._failed += result.outcome.verdict is CheckVerdict.FAIL
        if self._shown:
            failed = counted(self._failed, "failure")
            text = f"{counted(self._judged, 'check')}, {failed}: {result.check.id}"
            paint(sys.stderr, f"\r\x1b[K{one_line(text)}")

    def end(self) -> None:
        """Clear the line."""
        if self._shown:
            paint(sys.stderr, "\r\x1b[K")
