"""One step of a search, and how it stands in a scenario."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.bench_device import PRESS
from tickrig.host.text.names import near
from tickrig.host.text.steps import content_lines
from tickrig.host.text.values import parse_setting, parse_time_us
from tickrig.wire.can import CanFrame

CALL: Final = "call"
SEED: Final = "seed"
VERBS: Final = (CALL, "set", "press", "fault", "send", "wait", SEED)

LONGEST: Final = 10_000
"""Characters of a call."""

DIGITS: Final = 20
"""Of a seed."""

_LINE: Final = re.compile(r"\+(\S+)\s+(\w+)(?:\s+(.*))?")


@dataclass(frozen=True, slots=True, repr=False)
class HostStep:
    """Something that is done after a while.

    Attributes:
        wait_us: how long nothing is done before it.
        verb: `call` of a rule, `set`, `press`, `fault`, `send`, `wait` for nothing more, or
            `seed` of the chance in faults that begin from then on.
        what: the rule, or what stands behind the verb in a scenario: `stick_v_pct 50`,
            `drop=0.1`, `705#00` or bytes in hex, with the device before them where there are
            several wires: `drive/705#00`.
        for_us: how long a button is pressed, or a fault stays.
        arguments: of the rule.
    """

    wait_us: int
    verb: str
    what: str = ""
    for_us: int = 0
    arguments: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Write it as `__str__` does: what a search shows is to be read."""
        return f"<{self}>"

    def _repr_pretty_(self, printer: Any, cycle: bool) -> None:
        """Write it in what Hypothesis prints."""
        printer.text(repr(self))

    def __str__(self) -> str:
        """Write the line of a scenario.

        >>> print(HostStep(0, "fault", "drop=0.1", 300_000))
        +0us fault drop=0.1 for 300ms
        >>> print(HostStep(5_000, "call", "write", arguments={"data": b"a", "to": 3}))
        +5ms call write(data=b'a', to=3)
        """
        given = ", ".join(f"{name}={_literal(value)}" for name, value in self.arguments.items())
        what = f"{self.what}({given})" if self.verb == CALL else self.what
        lasting = f" for {_time(self.for_us)}" if self.for_us else ""
        return f"+{_time(self.wait_us)} {self.verb} {what}".rstrip() + lasting

    def do(self, bench: Bench) -> None:
        """Let the time pass, and do it to a bench; a `call` is of a machine alone.

        Args:
            bench: the bench.

        Raises:
            ValueError: the bench has no such input, button, fault or device.
        """
        bench.run_for(self.wait_us)
        if self.verb == "set":
            name, *words = self.what.split()
            bench.set(name, *map(parse_setting, words))
        elif self.verb == "press":
            bench.press(self.what, self.for_us or PRESS)
        elif self.verb == "fault":
            bench.fault(self.what, for_=self.for_us or None)
        elif self.verb == "send":
            owner, _, text = self.what.rpartition("/")
            frame = "#" in text
            traffic = (CanFrame.parse(text),) if frame else bytes.fromhex(text)
            (bench[owner] if owner else bench).link.send(traffic)
        elif self.verb == SEED:
            seed = int(self.what)
            bench._mode.act(lambda rig: rig.state.draw_by(seed))


def parse_steps(text: str, file: str) -> tuple[HostStep, ...]:
    """Read the steps of a scenario.

    Args:
        text: the whole file.
        file: its name, for messages.

    Raises:
        ValueError: `FILE:LINE: what came, what is allowed`.
    """
    steps = []
    for number, content in content_lines(text):
        try:
            steps.append(_parse(content))
        except ValueError as error:
            raise ValueError(f"{file}:{number}: {error}") from None
    return tuple(steps)


def _parse(content: str) -> HostStep:
    match = _LINE.fullmatch(content)
    if match is None:
        raise ValueError(f"{content!r:.60} is not '+TIME ACTION ...', as '+5ms call heat()'")
    wait_us, verb, rest = parse_time_us(match[1]), match[2], (match[3] or "").strip()
    if verb not in VERBS:
        raise ValueError(f"no action {verb!r}; {near(verb, VERBS)}")
    if verb == CALL:
        name, arguments = _parse_call(rest)
        return HostStep(wait_us, verb, name, arguments=arguments)
    if verb == SEED and not (rest.isdecimal() and len(rest) <= DIGITS):
        raise ValueError(f"a seed is a whole number from 0, not {rest!r:.60}")
    what, lasting, time = rest.partition(" for ")
    return HostStep(wait_us, verb, what, parse_time_us(time) if lasting else 0)


def _parse_call(text: str) -> tuple[str, dict[str, Any]]:
    """Read `name(argument=literal, ...)`; nothing is evaluated but literals."""
    try:
        call = ast.parse(text, mode="eval").body if len(text) <= LONGEST else None
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        call = None
    if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Name) or call.args:
        raise ValueError(f"{text!r:.60} is not a call, as 'write(data=b\"a\", to=3)'")
    try:
        arguments = {str(each.arg): ast.literal_eval(each.value) for each in call.keywords}
    except (ValueError, MemoryError, RecursionError):
        raise ValueError(f"{text!r:.60}: an argument is no plain value") from None
    return call.func.id, arguments


def _literal(value: object) -> str:
    """Write a plain value without a `#`, which would begin a comment."""
    return repr(value).replace("#", "\\x23")


def _time(t_us: int) -> str:
    for unit_us, unit in ((1_000_000, "s"), (1_000, "ms")):
        if t_us and t_us % unit_us == 0:
            return f"{t_us // unit_us}{unit}"
    return f"{t_us}us"
