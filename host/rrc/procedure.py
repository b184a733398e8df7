"""The test procedure of the RRC manual, step by step, with an operator at the chair."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Protocol

from tickrig.host.links.link import DeviceRefused, LinkTimeout
from tickrig.host.rrc.chair import STEP_US, Chair, ChairStopped
from tickrig.wire.rrc import commands as cmd
from tickrig.wire.rrc.commands import Command
from tickrig.wire.rrc.message import check_digit
from tickrig.wire.rrc.replies import RrcEvent, StatusA

# Theory of operation
# ===================
#
# The manual sends nine sample commands twice: from a terminal, without CHECK, and from a program,
# with CHECK after `stablemode`. Here both rounds are the same steps; stablemode begins the second.
# Two samples stop VR2 by force, `watchdog` and `poweroff`, so they are the last of a round, and
# the operator switches the chair off and on behind each.
#
# A step sends its sample and judges what the RRC reports: the answer (the client raises for a
# refusal), the status lines, the events. Only what no line reports is asked: did the wheels turn,
# did the buzzer sound. What wants the stick or a button waits for it in the status lines, as long
# as the operator has patience; each wait passes in the client, which renews the watchdog.
#
# The watchdog itself is tested by silence (`Chair.stay_silent`): the client would renew it.

STEPS: Final = 21
"""Number of steps of both rounds together."""

_PATIENCE_US: Final = 60_000_000
_DRIVE_US: Final = 1_000_000
_SECOND_US: Final = 1_000_000
_PUSHED_PCT: Final = 60
_TAKEN_US: Final = 100_000


class _Operator(Protocol):
    """The person at the chair. Time passes on the chair while the program waits for an answer."""

    def instruct(self, text: str) -> None:
        """Show an instruction."""

    def confirms(self, question: str) -> bool:
        """Ask a question and return whether the operator confirms. Quit ends the procedure."""
        ...

    def waits(self) -> None:
        """Wait a moment. Quit ends the procedure."""


class Quit(Exception):  # noqa: N818 - what the operator did
    """The operator ended the procedure."""


@dataclass(frozen=True, slots=True)
class StepResult:
    """Result of one step of the RRC test procedure, as shown to the operator and saved as JSON.

    Attributes:
        step: title of the step.
        sent: command that the step sends to the RRC, without CHECK. It is empty if the step sends
            no command.
        check: CHECK (checksum) of the command. It is empty in the first round of the procedure, in
            which commands have no CHECK.
        passed: whether the RRC behaved as described in the manual.
        reason: reason of a failure, empty if the step passed.
    """

    step: str
    sent: str
    check: str
    passed: bool
    reason: str = ""


class _Failed(Exception):  # noqa: N818 - the verdict
    """The RRC or the chair behaved differently from the manual."""


@dataclass(slots=True)
class Procedure:
    """Test procedure for an RRC with a wheelchair, in which an operator answers questions.

    The procedure has two rounds of steps, first without stablemode and then with it.

    Args:
        chair: chair to test. Its watchdog must be on, and its stablemode must be off.
        operator: person at the chair, who gets instructions and answers questions.
        report: function that is called with the result of each step.

    Attributes:
        results: results of all steps so far.
    """

    chair: Chair
    operator: _Operator
    report: Callable[[StepResult], None]
    results: list[StepResult] = field(default_factory=list, init=False)

    @property
    def passed(self) -> bool:
        """Whether all steps passed."""
        return all(each.passed for each in self.results)

    def run(self) -> None:
        """Run all steps of the test procedure.

        Raises:
            Quit: the operator ended the procedure.
            LinkError: the RRC is gone.
        """
        if not self.operator.confirms("Are the wheels off the ground, and is the chair empty?"):
            raise Quit("lift the wheels first: two samples let the motors run")
        for stable in (False, True):
            self._start("VR2 starts")
            if stable:
                self._step("CHECK is wanted, no OK", cmd.StableMode(1), self._stablemode)
            limit = cmd.Limit(50, 50)
            self._step("the stick drives at 50 % at most", limit, self._limit)
            self._step("forward at 30 %", cmd.Output(30, 0), self._output)
            self._step("speed mode 4, unlocked", cmd.SpeedMode(4), self._speed)
            shape = cmd.Joystick(reverse_mode=3)
            self._step("backing toward the stick", shape, self._joystick)
            self._step("a status line each 10 ms", cmd.Status(1), self._status)
            tones = cmd.Beep((100,) * 4 + (10,) * 6)
            self._step("two long tones, three short ones", tones, self._beep)
            self._step("stop after 1 s of silence", cmd.Watchdog(100), self._watchdog)
            self._start("VR2 starts again")
            if stable:
                self.chair.client.stablemode()
            self._step("VR2 is stopped by force", cmd.PowerOff(), self._power_off)

    def _start(self, step: str) -> None:
        """Ask the operator to switch VR2 on.

        The method raises Quit if VR2 stays off, because all other steps need it.
        """
        self._step(step, None, self._power_on)
        if not self.results[-1].passed:
            raise Quit("VR2 is off, and all other steps need it: press its power button, try again")

    def _step(self, step: str, command: Command | None, act: Callable[[], None]) -> None:
        line = b"" if command is None else command.encode().removesuffix(b"\n")
        stable = self.chair.client.stable or isinstance(command, cmd.StableMode)
        check = check_digit(line).decode() if line and stable else ""
        reason = ""
        try:
            act()
        except (_Failed, DeviceRefused, ChairStopped) as error:
            reason = str(error)
        finally:
            self.chair.stop()
        result = StepResult(step, line.decode(), check, not reason, reason)
        self.results.append(result)
        self.report(result)

    # The steps. Each sample is the command of its row in `run`.

    def _power_on(self) -> None:
        if self.chair.status() is not None:
            return
        self.operator.instruct("Press the power button of the controller: VR2 starts.")
        self._await_event(RrcEvent.POWER_ON_SUCCESS)
        self._await(lambda sa: True, "a status line")

    def _stablemode(self) -> None:
        self.chair.client.stablemode()

    def _limit(self) -> None:
        self.chair.drive_by_stick(cmd.Limit(50, 50))
        self.operator.instruct("Push the stick forward, as far as it goes, and hold it.")
        sa = self._await(lambda sa: sa.in_v_pct >= _PUSHED_PCT, "the stick forward")
        if not 0 < sa.out_v_pct <= 50:
            raise _Failed(f"stick at {sa.in_v_pct} %, output at {sa.out_v_pct} %, not 1..50 %")
        self._rest()

    def _output(self) -> None:
        self.operator.instruct("The wheels turn forward for 1 s.")
        self.chair.take_over()
        until_us = self.chair.client.now_us + _DRIVE_US
        while self.chair.client.now_us < until_us:
            self.chair.drive(30, 0)
        sa = self.chair.require_on()
        self.chair.stop()
        if (sa.out_v_pct, sa.out_w_pct) != (30, 0):
            raise _Failed(f"output at {sa.out_v_pct} {sa.out_w_pct}, not 30 0")
        self._confirm("Did both wheels turn forward?")

    def _speed(self) -> None:
        self.chair.client.speedmode(4)
        self._await(lambda sa: sa.speed_mode == 4, "speed mode 4", _SECOND_US)
        self.operator.instruct("Press the speed-up button.")
        self._await(lambda sa: sa.speed_mode == 5, "speed mode 5")
        self.chair.client.speedmode(1)

    def _joystick(self) -> None:
        self._rest()
        self.chair.client.joystick(cmd.Joystick(reverse_mode=3))
        self.chair.drive_by_stick(cmd.Limit(50, 50))
        self.operator.instruct("Pull the stick straight back and hold it: the chair backs.")
        sa = self._await(lambda sa: sa.in_v_pct <= -_PUSHED_PCT, "the stick back")
        if sa.out_v_pct >= 0:
            raise _Failed(f"stick at {sa.in_v_pct} {sa.in_w_pct} %, output at {sa.out_v_pct} %")
        self._rest()
        self.operator.instruct(
            "Push it to the right, then back to 45 degrees: the chair turns only."
        )
        sa = self._await(lambda sa: sa.in_w_pct >= 40 and sa.in_v_pct <= -40, "right and back")
        if sa.out_v_pct or sa.out_w_pct <= 0:
            said = f"output at {sa.out_v_pct} {sa.out_w_pct}"
            raise _Failed(f"stick at {sa.in_v_pct} {sa.in_w_pct} %, {said}, not 0 and to the right")
        self._rest()
        self.chair.client.joystick(cmd.Joystick())

    def _status(self) -> None:
        client = self.chair.client
        list(client.statuses(0))
        client.run_for(_SECOND_US)
        count = len(list(client.statuses(0)))
        if not 80 <= count <= 120:
            raise _Failed(f"{count} status lines in 1 s, not 80..120")

    def _beep(self) -> None:
        self.chair.client.beep(*[1_000_000] * 4, *[100_000] * 6)
        self._confirm("Did the buzzer sound twice for 1 s, then three times shortly?")

    def _watchdog(self) -> None:
        client = self.chair.client
        self.chair.take_over()
        client.watchdog(_SECOND_US)
        self.operator.instruct(
            "Nothing is sent for 1 s: VR2 stops, and the controller's LED blinks."
        )
        waited_us = self.chair.stay_silent(RrcEvent.BY_WATCHDOG, 3 * _SECOND_US)
        if waited_us is None:
            raise _Failed("no EV:PowerOffWaitByWatchdog in 3 s")
        if not 0.9 * _SECOND_US <= waited_us <= 1.3 * _SECOND_US:
            raise _Failed(f"EV:PowerOffWaitByWatchdog came after {waited_us / 1e6:.2f} s")
        self._power_cycle()

    def _power_off(self) -> None:
        self.chair.client.poweroff()
        self._await_event(RrcEvent.BY_HOST, _SECOND_US)
        self._power_cycle()

    def _power_cycle(self) -> None:
        self.operator.instruct("Press the power button: VR2 goes off.")
        self._await_event(RrcEvent.INITIALIZED)
        self.chair.client.run_for(_TAKEN_US)
        self.chair.set_guard()

    # How they wait.

    def _confirm(self, question: str) -> None:
        if not self.operator.confirms(question):
            raise _Failed(f"the operator says no: {question}")

    def _rest(self) -> None:
        self.operator.instruct("Let the stick go.")
        self._await(lambda sa: not (sa.in_v_pct or sa.in_w_pct), "the stick at rest")
        self.chair.client.run_for(300_000)  # takes the gear out

    def _await(
        self, holds: Callable[[StatusA], bool], what: str, within_us: int = _PATIENCE_US
    ) -> StatusA:
        """Wait until a status line meets a condition. Return a later line that shows the effect."""
        client = self.chair.client
        until_us = client.now_us + within_us
        while client.now_us < until_us:
            client.run_for(STEP_US)
            self.chair.watch()
            latest = self.chair.latest_status
            if latest is not None and holds(latest.value):
                client.run_for(_TAKEN_US)
                return self.chair.require_on()
            self.operator.waits()
        raise _Failed(f"waited {within_us // 1_000_000} s for {what}")

    def _await_event(self, kind: RrcEvent, within_us: int = _PATIENCE_US) -> None:
        until_us = self.chair.client.now_us + within_us
        while self.chair.client.now_us < until_us:
            try:
                self.chair.client.wait_for(kind, _TAKEN_US)
            except LinkTimeout:
                self.operator.waits()
            else:
                return
        raise _Failed(f"waited {within_us // 1_000_000} s for EV:{kind}")
