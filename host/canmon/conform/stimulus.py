"""Who moves the inputs of the device: a command, an operator, or an emulator's control socket."""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
from collections.abc import Collection
from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.canmon.conform.signal_stimulus import SignalStimulus, Span
from tickrig.host.canopen.conform.bus.step_failed import Disturbed, NotAllowed
from tickrig.host.canopen.conform.plan import Stimulus
from tickrig.host.cli.refused import Refused, refused_at
from tickrig.host.control.client import ControlClient
from tickrig.host.control.requests import Object
from tickrig.host.text.page_text import one_line
from tickrig.host.text.values import Setting

OPERATOR: Final = "ask"
CONTROL: Final = "control:"
CANNOT: Final = 77
"""Exit status by which a command says that it has no such input, as in test suites of C."""
PATIENCE_S: Final = 30
"""A command that moves an input is done by then."""


def open_stimulus(text: str) -> Stimulus:
    """Return who moves the inputs.

    Args:
        text: `ask`, `control:PATH` or the path of a control socket, else the words of a command.

    Raises:
        Refused: it is none of them.
    """
    if text == OPERATOR:
        if not sys.stdin.isatty():
            raise Refused("--stimulus ask wants somebody at a terminal")
        return ask_operator
    place = text.removeprefix(CONTROL)
    if place and (place != text or Path(place).is_socket()):
        return ControlStimulus(Path(place))
    with refused_at("--stimulus"):
        words = shlex.split(place)
    if not words:
        raise Refused("--stimulus wants a command, ask, or the path of a control socket")
    if shutil.which(words[0]) is None:
        raise Refused(f"--stimulus {words[0]!r}: no such command, and no control socket")
    return CommandStimulus(words)


def ask_operator(*words: str) -> str:
    """Let a person do it; what is read of an output is typed."""
    text = one_line(" ".join(words))
    if words[0] == "output":
        return str(click.prompt(f"What is {text}, in hex", err=True))
    if not click.confirm(f"Now: {text}. Done?", default=True, err=True):
        raise NotAllowed(f"{text}: the operator cannot do it")
    return ""


class CommandStimulus:
    """Calls a command with the words behind its own; no shell is between.

    Args:
        words: the command.
    """

    def __init__(self, words: list[str]) -> None:
        self._words = words

    def __call__(self, *words: str) -> str:
        """Call it, and return the first line that it prints.

        Raises:
            NotAllowed: it ends with `CANNOT`.
            Disturbed: it cannot be run, does not end, or ends with another status than 0.
        """
        line = " ".join([*self._words, *words])
        try:
            ended = subprocess.run(
                [*self._words, *words],
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=PATIENCE_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise Disturbed(f"{line}: not done within {PATIENCE_S} s") from None
        except OSError as error:
            raise Disturbed(f"{line}: {error.strerror}") from None
        if ended.returncode == CANNOT:
            raise NotAllowed(f"{line}: the command has nothing of the kind")
        if ended.returncode:
            said = ended.stderr.decode("utf-8", "replace").strip().splitlines()
            why = f": {one_line(said[-1])}" if said else ""
            raise Disturbed(f"{line}: exit status {ended.returncode}{why}")
        return next(iter(ended.stdout.decode("utf-8", "replace").splitlines()), "").strip()


class ControlStimulus(SignalStimulus):
    """The control socket of an emulator (docs/reference/bench/control.md).

    Args:
        path: of the socket.

    Raises:
        Refused: nobody answers there.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._units = path, dict[str, str]()
        self._spans: dict[str, Span] = {}
        try:
            described = self._request("describe")
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise Refused(f"--stimulus {path}: {reason}") from None
        try:
            self._learn(described)
        except (AttributeError, KeyError, TypeError):
            raise Refused(f"--stimulus {path}: no emulator: what it describes is none") from None

    def _learn(self, described: Any) -> None:
        """Take names, units and converters, as docs/reference/bench/control.md has them."""
        for item in (*described.get("inputs", ()), *described.get("outputs", ())):
            self._units[item["name"]] = str(item.get("unit", ""))
            if "counts" in item:
                self._spans[item["name"]] = Span(item["low"], item["high"], *item["counts"])

    def set(self, name: str, value: Setting) -> None:
        """Set an input."""
        self._request("set", name=name, value=value)

    def get(self, name: str) -> Setting:
        """Return the value of a signal."""
        values: Any = self._request("get", names=[name])["values"]
        value: Setting = values[name]
        return value

    def names(self) -> Collection[str]:
        """Return the names that the emulator tells."""
        return self._units.keys()

    def unit(self, name: str) -> str:
        """Return the unit that the emulator names."""
        return self._units.get(name, "")

    def span(self, name: str) -> Span | None:
        """Return what the emulator tells of a converter."""
        return self._spans.get(name)

    def switch(self, *, on: bool) -> None:
        """Let the fault `power_off` come or go."""
        if on:
            self._request("clear", name="power_off")
        else:
            self._request("fault", spec="power_off")

    def _request(self, do: str, **fields: object) -> Object:
        with ControlClient(self._path) as client:
            return client.request(do, **fields)
