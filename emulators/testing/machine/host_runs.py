"""Runs of a host, each from the same snapshot of its bench."""

from __future__ import annotations

import ast
import inspect
import random
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from copy import deepcopy
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any, Final, Self

from tickrig.emulators.testing.bench.bench import PRESS, Bench
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.host_clock.host_code import HostHangsError
from tickrig.emulators.testing.machine.bench_machine import BenchMachine, World
from tickrig.host.text.names import near
from tickrig.host.text.steps import content_lines
from tickrig.host.text.values import parse_setting, parse_time_us, us_of
from tickrig.wire.can import CanFrame
from tickrig.wire.instant import NEVER

# One step of a search, and how it stands in a scenario.

_CALL: Final = "call"
SEED: Final = "seed"
_WAIT: Final = "wait"
_VERBS: Final = (_CALL, "set", "press", "fault", "send", _WAIT, SEED)

_LONGEST: Final = 1_000_000
"""Largest number of characters of a call."""

_DIGITS: Final = 20
"""Largest number of digits of a seed."""

_LINE: Final = re.compile(r"\+(\S+)\s+(\w+)(?:\s+(.*))?")


@dataclass(frozen=True, slots=True, repr=False)
class HostStep:
    """One step of a search for failures of a host: a pause, then an action.

    Attributes:
        wait_us: pause before the action, in microseconds.
        verb: type of the action: `call` calls a rule, `set`, `press`, `fault` and `send` act on the
            bench, `wait` is only a pause, and `seed` sets the seed of faults that begin after this
            step.
        what: name of the rule, or the text that follows the verb in a scenario: `stick_v_pct 50`,
            `drop=0.1`, `705#00`, or bytes in hex. If the bench has several wires, the name of the
            device is in front: `drive/705#00`.
        for_us: duration of the press of a button, or of a fault, in microseconds.
        arguments: arguments of the rule.
    """

    wait_us: int
    verb: str
    what: str = ""
    for_us: int = 0
    arguments: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return the same text as `__str__`, so that the output of a search is readable."""
        return f"<{self}>"

    def _repr_pretty_(self, printer: Any, cycle: bool) -> None:
        """Print the step in the output of Hypothesis."""
        printer.text(repr(self))

    def __str__(self) -> str:
        """Return the line of a scenario.

        >>> print(HostStep(0, "fault", "drop=0.1", 300_000))
        +0us fault drop=0.1 for 300ms
        >>> print(HostStep(5_000, "call", "write", arguments={"data": b"a", "to": 3}))
        +5ms call write(data=b'a', to=3)
        """
        given = ", ".join(f"{name}={_literal(value)}" for name, value in self.arguments.items())
        what = f"{self.what}({given})" if self.verb == _CALL else self.what
        lasting = f" for {_time(self.for_us)}" if self.for_us else ""
        return f"+{_time(self.wait_us)} {self.verb} {what}".rstrip() + lasting

    def do(self, bench: Bench) -> None:
        """Let the pause of this step pass on a bench, then execute its action there.

        A step with the verb `call` calls a method of a `BenchMachine`. This function cannot execute
        such a step, because it has only the bench.

        Args:
            bench: the bench.

        Raises:
            ValueError: the bench has no such input, button, fault or device.
        """
        bench.run_for(self.wait_us)
        self.act(bench)

    def act(self, bench: Bench) -> None:
        """Execute the step on a bench at once; raise ValueError as `do` does."""
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


def parse_steps(
    text: str, file: str, rules: Mapping[str, Mapping[str, object]] | None = None
) -> tuple[HostStep, ...]:
    """Parse a scenario of a search for failures of a host into its steps.

    Args:
        text: content of the scenario file.
        file: name of the file, for error messages.
        rules: the methods of a `BenchMachine` with the decorator `host_rule`. Each key is the name
            of a method. Each value contains the arguments of the method, with their possible
            values.

    Raises:
        ValueError: a line is invalid. The message is `FILE:LINE: found text, what is allowed`.
    """
    steps = []
    for number, content in content_lines(text):
        try:
            steps.append(_parse(content, rules or {}))
        except ValueError as error:
            raise ValueError(f"{file}:{number}: {error}") from None
    return tuple(steps)


def _parse(content: str, rules: Mapping[str, Mapping[str, object]]) -> HostStep:
    match = _LINE.fullmatch(content)
    if match is None:
        raise ValueError(f"{content!r:.60} is not '+TIME ACTION ...', as '+5ms call heat()'")
    wait_us, verb, rest = parse_time_us(match[1]), match[2], (match[3] or "").strip()
    if verb not in _VERBS:
        raise ValueError(f"no action {verb!r}; {near(verb, _VERBS)}")
    if verb == _CALL:
        name, arguments = _parse_call(rest, rules)
        return HostStep(wait_us, verb, name, arguments=arguments)
    if verb == SEED and not (rest.isdecimal() and len(rest) <= _DIGITS):
        raise ValueError(f"a seed is a whole number from 0, not {rest!r:.60}")
    what, lasting, time = rest.partition(" for ")
    return HostStep(wait_us, verb, what, parse_time_us(time) if lasting else 0)


def _parse_call(text: str, rules: Mapping[str, Mapping[str, object]]) -> tuple[str, dict[str, Any]]:
    """Read `name(argument=literal, ...)`; only literals are evaluated."""
    try:
        call = ast.parse(text, mode="eval").body if len(text) <= _LONGEST else None
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        call = None
    if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Name) or call.args:
        raise ValueError(f"{text!r:.60} is not a call, as 'write(data=b\"a\", to=3)'")
    listed = rules.get(call.func.id, {})
    try:
        arguments = {
            str(each.arg): _value_of(each.value, listed.get(str(each.arg)))
            for each in call.keywords
        }
    except (ValueError, MemoryError, RecursionError):
        raise ValueError(f"{text!r:.60}: an argument is no plain value") from None
    return call.func.id, arguments


class _Floats(ast.NodeTransformer):
    """Replaces the names `inf` and `nan` by numbers."""

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Return the number."""
        return ast.Constant(float(node.id)) if node.id in ("inf", "nan") else node


def _value_of(node: ast.expr, listed: object) -> Any:
    """Return a plain value, or the listed value that has the same text."""
    if isinstance(listed, list | tuple):
        text = ast.unparse(node)
        for value in listed:
            if _same_text(value, text):
                return value
    return ast.literal_eval(_Floats().visit(node))


def _same_text(value: object, text: str) -> bool:
    try:
        return ast.unparse(ast.parse(_literal(value), mode="eval")) == text
    except (SyntaxError, ValueError):
        return False


def check_written(rule: str, name: str, value: object, listed: object = None) -> None:
    """Raise TypeError if the value of a rule's argument cannot be written in a scenario.

    Args:
        rule: name of the rule.
        name: name of the argument.
        value: value of the argument.
        listed: values that the rule allows for the argument, or None if the rule has no such list.
    """
    try:
        node = ast.parse(_literal(value), mode="eval").body
        read = _value_of(node, listed)
        if read == value or _literal(read) == _literal(value):  # nan differs from itself
            return
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        pass
    hint = "draw plain values, or list the values in host_rule, each with a repr that is Python"
    raise TypeError(f"{rule}: {name}={value!r:.60} cannot be written in a scenario; {hint}")


def _literal(value: object) -> str:
    """Write a value without a `#`, which would begin a comment."""
    text = f"{type(value).__name__}.{value.name}" if isinstance(value, Enum) else repr(value)
    return text.replace("#", "\\x23")


def _time(t_us: int) -> str:
    for unit_us, unit in ((1_000_000, "s"), (1_000, "ms")):
        if t_us and t_us % unit_us == 0:
            return f"{t_us // unit_us}{unit}"
    return f"{t_us}us"


_LAST_LINES: Final = 12

# The names of exceptions that are not failures. `sys.exit` in a host and `pytest.fail` in an
# invariant are failures, although they do not raise an Exception. Names are used, because this
# module does not import pytest and Hypothesis (`assume`).
_NO_FAILURES: Final = ("KeyboardInterrupt", "Skipped", "Exit", "UnsatisfiedAssumption", "StopTest")


@dataclass(frozen=True, slots=True)
class HostFailure:
    """A failure of a run of a `BenchMachine`: the exception, where it was raised, and when.

    Attributes:
        error: exception that was raised.
        violated: part of the machine that failed: an invariant such as `invariant it_is_slow`, a
            rule such as `rule drive`, the method `connect` or `end`, or another step.
        at_us: time of the failure on the bench, in microseconds.
        steps: steps of the run before the failure.
        passed: last traffic that passed over the wires before the failure, as text.
    """

    error: BaseException
    violated: str
    at_us: int
    steps: tuple[HostStep, ...]
    passed: str

    def is_like(self, other: HostFailure) -> bool:
        """Return whether another run failed in the same way."""
        return type(self.error) is type(other.error) and self.violated == other.violated

    @property
    def text(self) -> str:
        """The failure in one line."""
        said = str(self.error).partition("\n")[0]
        at = f"at {self.at_us / 1_000_000:.6f} s"
        return f"{self.violated}, {at}: {type(self.error).__name__}: {said}".rstrip(": ")


@contextmanager
def _seeded() -> Iterator[None]:
    """Seed the random numbers of hosts, so that a replay draws the same numbers as the search."""
    modules = [random, sys.modules.get("numpy.random")]
    chances: list[Any] = [module for module in modules if module is not None]
    before = [chance.getstate() if chance is random else chance.get_state() for chance in chances]
    for chance in chances:
        chance.seed(0)
    try:
        yield
    finally:
        for chance, state in zip(chances, before, strict=True):
            (chance.setstate if chance is random else chance.set_state)(state)


class HostRuns:
    """Runs a `BenchMachine` many times on one bench.

    The object is a context manager: the bench is open within the `with` block.

    Args:
        kind: class of the machine.

    Attributes:
        machine: the machine.
        failure: failure of the last failed run, or None if no run has failed.

    Raises:
        ValueError: a fault or input of the machine is not on the bench.
        NotOnThisBench: the bench is not in virtual time.
    """

    def __init__(self, kind: type[BenchMachine]) -> None:
        if not isinstance(kind, type):
            raise TypeError(f"give the class {type(kind).__name__}, not an object of it")
        self.machine, self._stack = kind(), ExitStack()
        self.failure: HostFailure | None = None
        self._done: list[HostStep] = []
        self._broken: Exception | None = None
        self._broken_by = self._doing = ""
        self._end_us = self._back_us = NEVER
        self._invariants = kind.invariants()

    def __enter__(self) -> Self:
        """Open the bench, warm it up, and take a snapshot."""
        try:
            self._open()
        except BaseException:
            self._stack.close()
            raise
        return self

    def _open(self) -> None:
        machine = self.machine
        made = machine.make_bench()
        if not isinstance(made, Bench):
            raise TypeError(f"{type(machine).__name__}.make_bench returned {made!r:.60}, no Bench")
        machine.bench = bench = self._stack.enter_context(made)
        if bench.mode != "virtual":
            raise NotOnThisBench(f"a search is in virtual time, not {bench.mode}")
        machine.world = World(bench, machine.faults, machine.inputs)
        with self._time():
            machine.warm_up()
        machine.world.begin()
        bench._mode.act(BenchRig.drop_unheard)
        self._snapshot = bench.snapshot(machine)

    def _time(self) -> AbstractContextManager[object]:
        """Return the patches for hosts; an install takes 0.1 ms, and only one user may do it."""
        return self.machine.bench.patched_time() if self.machine.patched else nullcontext()

    def __exit__(self, *exception: object) -> None:
        """Close the bench."""
        self._stack.close()

    def run(self, steps: Sequence[HostStep]) -> None:
        """Restore the snapshot of the bench, and execute the steps of a run.

        Raises:
            HostHangsError: the host waits without end.
            Exception: any other exception that the `BenchMachine` or the host has raised.
        """
        # All runs begin at one snapshot with the same objects, so hosts that hold a device need no
        # update.
        self._snapshot.restore()
        self._done, self._broken, self._broken_by = [], None, ""
        self._end_us = self.machine.bench.now_us + us_of(self.machine.longest)
        self.machine.bench._mode.act(lambda rig: rig.rig.watchers.append(self._watch))
        with self._time(), _seeded():
            self._run_all(steps)

    def _run_all(self, steps: Sequence[HostStep]) -> None:
        try:
            self._doing = "connect"
            self._judged(self.machine.connect)
            for step in steps:
                self._do(step)
            self._doing = "end"
            self._judged(self._settle)
            self._judged(self.machine.end)
        except BaseException as error:
            if type(error).__name__ not in _NO_FAILURES:
                by, now_us = self._broken_by or self._doing, self.machine.bench.now_us
                passed = self.last_lines()
                self.failure = HostFailure(error, by, now_us, tuple(self._done), passed)
            raise
        finally:
            self.machine.disconnect()

    def shorten(self, failure: HostFailure) -> HostFailure | None:
        """Remove steps from a failed run as long as the run still fails in the same way.

        Returns:
            The failure with the remaining steps, or None if the run does not fail again.
        """
        failed = self._again(failure, failure.steps)
        shorter = failed
        while shorter is not None:
            failed = shorter
            shorter = next(
                (
                    found
                    for steps in _shorter(failed.steps)
                    if (found := self._again(failed, steps)) is not None
                ),
                None,
            )
        return failed

    def _again(self, failure: HostFailure, steps: Sequence[HostStep]) -> HostFailure | None:
        """Return the failure of a run that fails in the same way, or None."""
        before = self.failure
        try:
            self.run(steps)
        except BaseException:
            found = self.failure
            if found is None or found is before:
                raise
            if found.is_like(failure):
                return found
        self.failure = before
        return None

    def _settle(self) -> None:
        """Wait so that the devices react to the last request, before the run is checked."""
        bench = self.machine.bench
        bench.run_for(bench._mode.act(lambda rig: rig.settling_us))

    def _do(self, step: HostStep) -> None:
        bench, wait = self.machine.bench, HostStep(step.wait_us, _WAIT)
        self._done.append(wait)  # until it is more
        self._doing = f"step {wait}"
        self._judged(bench.run_for, step.wait_us)
        self._check()
        self._done[-1] = step
        self._doing = f"rule {step.what}" if step.verb == _CALL else f"step {step}"
        self._judged(step.act, bench)
        if step.verb == _CALL:
            # A rule may change what it is given; the step is what it was.
            self._judged(self._rule(step), **deepcopy(dict(step.arguments)))
        self._check()

    def _rule(self, step: HostStep) -> Any:
        rules = self.machine.rules()
        if step.what not in rules:
            raise ValueError(f"no rule {step.what!r}; {near(step.what, rules)}")
        method = getattr(self.machine, step.what)
        wanted = list(inspect.signature(method).parameters)
        if set(step.arguments) - set(wanted):
            raise ValueError(f"{step.what} takes ({', '.join(wanted)}), got {step}")
        return method

    def _judged(self, act: Any, *args: Any, **arguments: Any) -> None:
        """Run an operation of the host; raise a violation even if the host has caught it.

        Endless waiting counts as one error, wherever the host waits. A search therefore shortens a
        single error.
        """
        self._back_us = self.machine.bench.now_us + us_of(self.machine.patience)
        hangs = ""
        try:
            act(*args, **arguments)
        except Exception:
            if not (hangs := self._hangs(self.machine.bench.now_us)):
                raise
        finally:
            self._back_us = NEVER
        if hangs or isinstance(self._broken, HostHangsError):
            raise HostHangsError(hangs or str(self._broken))
        if self._broken is not None:
            raise self._broken

    def _hangs(self, now_us: int) -> str:
        """Raise if the host does not recover."""
        if now_us > self._back_us:
            return f"the host does not come back within {self.machine.patience}"
        if now_us > self._end_us:
            return f"the run does not end within {self.machine.longest}"
        return ""

    def _watch(self, now_us: int) -> None:
        """Check the invariants after each step of the rig; the first violation counts."""
        if hangs := self._hangs(now_us):
            # Raised in the rig, amid the host's call; and kept, because a host may swallow
            # it.
            self._broken = HostHangsError(hangs)
            raise self._broken
        if self._broken is None:
            try:
                self._check()
            except Exception as error:  # raised where the test is, not amid the rig
                self._broken = error

    def _check(self) -> None:
        for name in self._invariants:
            try:
                getattr(self.machine, name)()
            except BaseException:
                self._broken_by = f"invariant {name}"
                raise

    def last_lines(self) -> str:
        """Return the last traffic and actions."""
        return "\n".join(self.machine.bench.transcript().splitlines()[-_LAST_LINES:])


def _shorter(steps: Sequence[HostStep]) -> Iterator[list[HostStep]]:
    """Yield shorter runs, each without one step: first without its wait, then with its wait."""
    for at, step in enumerate(steps):
        before, after = list(steps[:at]), list(steps[at + 1 :])
        yield before + after
        if step.wait_us and after:
            later = replace(after[0], wait_us=step.wait_us + after[0].wait_us)
            yield [*before, later, *after[1:]]
