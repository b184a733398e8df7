"""Run emulated devices for a command line: in real time, or a scenario."""

from __future__ import annotations

import sys
import traceback
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Generic, TypeVar

import click

from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.bench.operator import FaultSpec, Operator, parse_fault_spec
from tickrig.emulators.bench.running_emulator import RunningEmulator, keeping_time
from tickrig.emulators.scenario import ScenarioParser, ScenarioPlayer, ScenarioStep
from tickrig.host.cli import messages
from tickrig.host.cli.control import serving_control, stopped_by_signals
from tickrig.host.control.clock import ServingClock
from tickrig.host.links.link import LinkClosed
from tickrig.host.text.user_file import explain_error

_RECORDING_ENDED: Final = 3
"""Exit status for an incomplete recording."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """Common options of the command lines of all emulators (`run_options`)."""

    control: Path | None = None
    scenario: Path | None = None
    faults: tuple[str, ...] = ()
    seed: int = 0
    trace: Path | None = None
    verbose: int = 0

    @property
    def in_real_time(self) -> bool:
        """Whether the emulator runs in real time."""
        raise NotImplementedError


_OptionsT = TypeVar("_OptionsT", bound=RunOptions)


class EmulatorRun(ABC, Generic[_OptionsT]):
    """A run of emulated devices.

    Args:
        options: options of the command line.
    """

    def __init__(self, options: _OptionsT) -> None:
        self._options, self._in_real_time = options, options.in_real_time
        self._clock = ServingClock()
        self._running: RunningEmulator | None = None
        self._stopped = False

    def run(self) -> int:
        """Run the emulator until it is stopped, and return the exit status of the command.

        Raises:
            Refused: the options cannot be carried out.
            SourceFailed: the CAN bus of the run can no longer be read.
        """
        with ExitStack() as stack:
            if self._shows_warnings:
                stack.enter_context(messages.warnings_shown())
            faults, scenario = self._checked()
            if self._ends_in_order:
                stack.enter_context(stopped_by_signals(self._stop))
            bench = self._running = self._open(stack)
            stack.callback(bench.close)
            if path := self._options.control:
                stack.enter_context(serving_control(path, EmulatorControl(bench), self._clock))
            if self._in_real_time:
                self._greet(bench)
                sys.stdout.flush()
            player = self._attend(bench, scenario)
            for spec in faults:
                bench.operator.fault(0, spec)
            if self._in_real_time:
                stack.enter_context(keeping_time())
            gone = ""
            try:
                self._go_on(bench)
            except LinkClosed as error:
                gone = str(error)
            if player:
                player.finish(bench.rig.now_us)
            self._show(bench)
        status = self._sum_up(bench, player)
        if gone:
            raise messages.SourceFailed(gone)
        return status

    @property
    def _shows_warnings(self) -> bool:
        """Whether warnings go to standard error."""
        return True

    @property
    def _ends_in_order(self) -> bool:
        """Whether Ctrl-C ends the run in the same way as the end of its duration."""
        return self._in_real_time

    def _show(self, bench: RunningEmulator) -> None:
        """Show the result of the run at its end, before the resources are released."""

    @abstractmethod
    def _make(self) -> tuple[Operator, ScenarioParser]:
        """Make the devices, against which faults and scenario are checked; open nothing."""

    @abstractmethod
    def _open(self, stack: ExitStack) -> RunningEmulator:
        """Open links and files for the devices; they are closed at the end."""

    @abstractmethod
    def _greet(self, bench: RunningEmulator) -> None:
        """Print the address of the emulator and how to talk to it."""

    @abstractmethod
    def _attend(
        self, bench: RunningEmulator, scenario: tuple[ScenarioStep, ...]
    ) -> ScenarioPlayer | None:
        """Start the requested transcripts of the run."""

    def _checked(self) -> tuple[list[FaultSpec], tuple[ScenarioStep, ...]]:
        """Check all inputs before anything is opened."""
        hands, parser = self._make()
        with messages.refused_at("--fault"):
            faults = [parse_fault_spec(text, hands.check_clear) for text in self._options.faults]
            for spec in faults:
                hands.check_fault(spec)
        try:
            return faults, parser.parse(*_read(self._options.scenario))
        except ValueError as error:
            raise messages.Refused(str(error)) from None

    def _say_how(self, otherwise: str) -> None:
        """Print how to operate the emulator, or the option that is needed to operate it."""
        control = self._options.control
        messages.say(f"  tickrig ctl {control} describe" if control else otherwise)

    def _go_on(self, bench: RunningEmulator) -> None:
        """Step until the emulator is stopped."""
        while bench.running and not self._stopped:
            bench.step()

    def _stop(self) -> None:
        self._stopped = True
        if self._running:
            self._running.stop()

    def _sum_up(self, bench: RunningEmulator, player: ScenarioPlayer | None) -> int:
        """Print the summary; return 3 for an incomplete recording, 1 for a missed expectation."""
        rig = bench.rig
        worst = f" (up to {rig.worst_late_us / 1_000:.1f} ms)" if rig.late_ticks else ""
        late = f"; late ticks: {rig.late_ticks}{worst}" if self._in_real_time else ""
        lost = "".join(f"; {what.replace('lost_', '')} lost: {n}" for what, n in bench.lost.items())
        messages.say(f"ran {rig.now_us / 1e6:.3f} s{late}{lost}")
        if player and player.met + player.missed:
            messages.say(f"expectations met: {player.met}; missed: {player.missed}")
        if bench.trace_error:
            messages.say(f"the recording ended early: {bench.trace_error}")
            return _RECORDING_ENDED
        return 1 if player and player.missed else 0


def _read(scenario: Path | None) -> tuple[str, str]:
    """Return the text of a scenario and its name."""
    if scenario is None:
        return "", ""
    try:
        text = sys.stdin.read() if str(scenario) == "-" else scenario.read_text("utf-8")
    except UnicodeDecodeError as error:
        raise messages.Refused(f"scenario {scenario}: byte {error.start} is not UTF-8") from None
    except OSError as error:
        messages.refuse_path("scenario", error)
    return text, str(scenario)


@contextmanager
def mistakes_in(specs: Iterable[object]) -> Iterator[None]:
    """Context that reports an exception of a user's code as an error message of one line.

    An exception that does not come from the user's files is raised unchanged.

    Args:
        specs: specifications of the devices. Each `FILE.py:Class` is user code.
    """
    files = {spec.rpartition(":")[0]: spec for spec in specs if isinstance(spec, str)}
    try:
        yield
    except click.exceptions.Exit:
        raise
    except Exception as error:  # a user's callback may raise anything
        frames = {frame.filename for frame in traceback.extract_tb(error.__traceback__)}
        mine = next((file for file in files if file in frames), None)
        if mine is None:
            raise
        raise messages.Refused(f"{files[mine]}: {explain_error(error, mine)}") from error
