"""One slave as the master sees it: its boot-up, its state, its error control."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.host.canopen.dialogue import Dialogue, QueuedScript, Send
from tickrig.host.canopen.master.assignment import MasterPlan, SlaveAssignment
from tickrig.host.canopen.master.boot_slave import (
    BootOutcome,
    BootStatus,
    BootStep,
    SlaveBoot,
    state_text,
)
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NmtState
from tickrig.wire.instant import NEVER

_AGAIN_US: Final = 1_000_000
"""A slave that does not answer is booted again after so long."""

_STATE_BITS: Final = 0x7F
_TOGGLE: Final = 0x80


class NetworkSlave:
    """A slave; it sends what its dialogue says, and never waits.

    Args:
        assignment: what is expected of it.
        send: takes CAN-ID and data.
        guard: takes the CAN-ID of a remote frame.
        plan: what the master does.
        booted: called when a boot-up has ended.

    Attributes:
        assignment: as given.
        dialogue: what is said with it by SDO.
        state: what it reported last, or was commanded since; None while nobody knows.
        outcome: how its latest boot-up ended, None before that and during one.
        steps: of its latest boot-up, each with its time.
        emergencies: error codes of its EMCYs, the first one first.
        began_us: when its latest boot-up began.
        lost: how often its error control has failed.
        events: when it was lost, and what was heard of it then, each with its time.
    """

    def __init__(
        self,
        assignment: SlaveAssignment,
        send: Send,
        guard: Callable[[int], None],
        plan: MasterPlan,
        booted: Callable[[NetworkSlave], None],
    ) -> None:
        self.assignment, self._guard, self._booted = assignment, guard, booted
        self.dialogue = Dialogue(assignment.node_id, send, guard, plan.sdo_timeout_us)
        self._boot_time_us = plan.boot_time_us
        self.state: NmtState | None = None
        self.outcome: BootOutcome | None = None
        self.steps: list[tuple[int, BootStep]] = []
        self.emergencies: list[int] = []
        self.events: list[tuple[int, BootStep]] = []
        self.booting, self.lost = False, 0
        self._now_us = self.began_us = 0
        self._again_us = self._silent_us = self._guard_us = NEVER
        self._unanswered, self._toggle = 0, -1

    @property
    def good(self) -> bool:
        """Whether its latest boot-up went well."""
        return self.outcome is not None and self.outcome.status.good

    @property
    def due_us(self) -> int:
        """When `tick` has something to do."""
        return min(self.dialogue.due_us, self._again_us, self._silent_us, self._guard_us)

    def forget(self) -> None:
        """Know nothing of it, as after the master's own reset."""
        self.dialogue.clear()
        self.state, self.outcome, self.booting = None, None, False
        self._again_us = self._silent_us = self._guard_us = NEVER

    def boot(self, now_us: int) -> None:
        """Begin a boot-up, unless one is under way."""
        if not self.booting:
            self.began_us = now_us
            self._boot(now_us)

    def _boot(self, now_us: int) -> None:
        state = self.state
        self.forget()
        self._now_us, self.state, self.booting, self.steps = now_us, state, True, []
        script = SlaveBoot(self.assignment, self._note).script()
        self.dialogue.start(now_us, QueuedScript("boot-up", script, self._end, self._never))

    def expect(self, state: NmtState) -> None:
        """Take note of a state that was commanded."""
        if self.state is not None:
            self.state = state

    def report(self, now_us: int, number: int) -> None:
        """Take a boot-up, a heartbeat or an answer to guarding.

        Args:
            now_us: the time.
            number: its only byte.
        """
        self._now_us = now_us
        try:
            state = NmtState(number & _STATE_BITS)
        except ValueError:
            return
        if self.events and self.state is None and not self.booting:
            self._return(state)
        self.state = state
        self.dialogue.receive_state(now_us, state)
        if state is NmtState.INITIALISING:
            self.state = NmtState.PRE_OPERATIONAL
            self.boot(now_us)
        elif not self.booting:
            self._watch(number & _TOGGLE)

    def _watch(self, toggle: int) -> None:
        """Go on with error control: by heartbeat of all that were heard, booted or not."""
        if self.assignment.heartbeat_us:
            self._silent_us = self._now_us + self.assignment.heartbeat_us
        elif self.good and toggle != self._toggle:
            self._toggle, self._unanswered = toggle, 0

    def tick(self, now_us: int) -> bool:
        """Do what is due; return True if the slave was lost now."""
        self._now_us = now_us
        self.dialogue.tick(now_us)
        if now_us >= self._again_us:
            self._boot(now_us)
        if now_us >= self._silent_us:
            self._silent_us = NEVER
            return self._lose()
        return now_us >= self._guard_us and self._guard_again()

    def _guard_again(self) -> bool:
        self._guard_us += self.assignment.guard_us
        if self._unanswered < self.assignment.life_time_factor:
            self._unanswered += 1
            if self._unanswered == self.assignment.life_time_factor:
                return self._lose()
        self._guard(ERROR_CONTROL_COB_ID + self.assignment.node_id)
        return False

    def _lose(self) -> bool:
        self.state, self.lost = None, self.lost + 1
        return True

    def note_loss(self, following: str) -> None:
        """Take note of its loss, and of what the master does about that."""
        slave = self.assignment
        what, silence_us = "heartbeat", slave.heartbeat_us
        if not silence_us:
            what, silence_us = "guarding", slave.guard_us * slave.life_time_factor
        self._happened(what, f"none within {silence_us // 1_000} ms", f"lost; {following}")

    def _return(self, state: NmtState) -> None:
        """Tell that a lost slave is heard; only a boot-up has it booted anew."""
        if state is NmtState.INITIALISING:
            self._happened("boot-up", "heard", "booted anew")
        else:
            self._happened(
                "heartbeat", state_text(state), "heard again, but not booted: no boot-up"
            )

    def _happened(self, request: str, answer: str, meaning: str) -> None:
        self.events.append((self._now_us, BootStep(request, answer, meaning)))

    def _note(self, step: BootStep) -> None:
        self.steps.append((self._now_us, step))

    def _never(self, failure: Exception) -> None:
        raise AssertionError("a boot-up says in its outcome what went wrong") from failure

    def _end(self, outcome: BootOutcome) -> None:
        if outcome.status is BootStatus.NO_ANSWER and self._may_try_again():
            self._again_us = self._now_us + _AGAIN_US
            return
        self.booting, self.outcome = False, outcome
        if outcome.status.good:
            self.state = self.state or NmtState.PRE_OPERATIONAL
            self._begin_guarding()
        self._booted(self)

    def _may_try_again(self) -> bool:
        """Say whether the boot time of a mandatory slave is not over; of others it never is."""
        if not self.assignment.mandatory or not self._boot_time_us:
            return True
        return self._now_us - self.began_us < self._boot_time_us

    def _begin_guarding(self) -> None:
        """Ask in periods; of heartbeats the boot-up has awaited one, and they are watched."""
        slave = self.assignment
        if slave.guard_us and slave.life_time_factor and not slave.heartbeat_us:
            self._guard_us = self._now_us + slave.guard_us
            self._unanswered = 0
