"""One slave of the master: boot-up, state and error control."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.host.canopen.dialogue import QueuedScript, Send
from tickrig.host.canopen.master import boot_slave
from tickrig.host.canopen.master.assignment import MasterPlan, SlaveAssignment
from tickrig.host.canopen.network import ErrorControl, NodeSession
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NmtState
from tickrig.wire.instant import NEVER

_AGAIN_US: Final = 1_000_000
"""Interval between boot attempts of a slave that does not answer."""


class NetworkSlave:
    """A slave of the master. It sends the frames of its dialogue, and never blocks.

    Args:
        assignment: values that the master expects of the slave.
        send: function that sends a data frame. Its arguments are CAN-ID and data.
        guard: function that sends a remote frame. Its argument is the CAN-ID.
        plan: behaviour of the master.
        booted: function that is called when a boot-up has ended.

    Attributes:
        assignment: values that the master expects of the slave.
        session: the session of the slave.
        dialogue: dialogue of the session.
        outcome: outcome of the latest boot-up, or None before the first boot-up and during a
            boot-up.
        steps: steps of the latest boot-up, each with its time.
        emergencies: error codes of the slave's EMCY messages, in the order of arrival.
        began_us: start of the latest boot-up.
        lost: number of failures of error control.
        events: losses of the slave, and its messages after a loss, each with its time.
    """

    def __init__(
        self,
        assignment: SlaveAssignment,
        send: Send,
        guard: Callable[[int], None],
        plan: MasterPlan,
        booted: Callable[[NetworkSlave], None],
    ) -> None:
        self.assignment, self._booted = assignment, booted
        self.session = NodeSession(assignment.node_id, send, guard, plan.sdo_timeout_us)
        self.dialogue = self.session.dialogue
        self._control = ErrorControl(
            *(assignment.heartbeat_us, assignment.guard_us, assignment.life_time_factor),
            request=lambda: guard(ERROR_CONTROL_COB_ID + assignment.node_id),
        )
        self._boot_time_us = plan.boot_time_us
        self.outcome: boot_slave.BootOutcome | None = None
        self.steps: list[tuple[int, boot_slave.BootStep]] = []
        self.emergencies: list[int] = []
        self.events: list[tuple[int, boot_slave.BootStep]] = []
        self.booting, self.lost = False, 0
        self._now_us = self.began_us = 0
        self._again_us = NEVER

    @property
    def state(self) -> NmtState | None:
        """Last reported state, or the state commanded since; None if the state is unknown."""
        return self.session.state

    @property
    def good(self) -> bool:
        """Whether the latest boot-up succeeded."""
        return self.outcome is not None and self.outcome.status.good

    @property
    def due_us(self) -> int:
        """Time of the next call of `tick`."""
        return min(self.dialogue.due_us, self._again_us, self._control.due_us)

    def forget(self) -> None:
        """Reset the state to unknown, as after a reset of the master."""
        self.dialogue.clear()
        self.session.state, self.outcome, self.booting = None, None, False
        self._control.stop()
        self._again_us = NEVER

    def boot(self, now_us: int) -> None:
        """Start a boot-up, unless a boot-up is running."""
        if not self.booting:
            self.began_us = now_us
            self._boot(now_us)

    def _boot(self, now_us: int) -> None:
        state = self.state
        self.forget()
        self._now_us, self.session.state, self.booting, self.steps = now_us, state, True, []
        script = boot_slave.SlaveBoot(self.assignment, self._note).script()
        self.dialogue.start(now_us, QueuedScript("boot-up", script, self._end, self._never))

    def expect(self, state: NmtState) -> None:
        """Record a state that the master commanded."""
        if self.state is not None:
            self.session.state = state

    def receive(self, at_us: int, frame: CanFrame) -> None:
        """Process a boot-up, a heartbeat, an answer to guarding, or an SDO response."""
        if frame.can_id == ERROR_CONTROL_COB_ID + self.assignment.node_id:
            self._now_us = at_us
        returns = bool(self.events) and self.state is None and not self.booting
        state = self.session.receive(at_us, frame)
        if state is None:
            return
        if returns:
            self._return(state)
        if state is NmtState.INITIALISING:
            self.session.state = NmtState.PRE_OPERATIONAL
            self.boot(at_us)
        elif not self.booting:
            self._control.hear(at_us, frame)

    def tick(self, now_us: int) -> bool:
        """Do the work that is due. Return True if the slave is now lost."""
        self._now_us = now_us
        self.dialogue.tick(now_us)
        if now_us >= self._again_us:
            self._boot(now_us)
        if not self._control.tick(now_us):
            return False
        self.session.state, self.lost = None, self.lost + 1
        return True

    def note_loss(self, following: str) -> None:
        """Record the loss of the slave, and the reaction of the master."""
        within = f"none within {self._control.silence_us // 1_000} ms"
        self._happened(self._control.what, within, f"lost; {following}")

    def _return(self, state: NmtState) -> None:
        """Record that a lost slave sends again. Only a boot-up starts a new boot procedure."""
        if state is NmtState.INITIALISING:
            self._happened("boot-up", "received", "booting again")
        else:
            self._happened(
                "heartbeat",
                boot_slave.state_text(state),
                "sends again, but is not booted: no boot-up",
            )

    def _happened(self, request: str, answer: str, meaning: str) -> None:
        self.events.append((self._now_us, boot_slave.BootStep(request, answer, meaning)))

    def _note(self, step: boot_slave.BootStep) -> None:
        self.steps.append((self._now_us, step))

    def _never(self, failure: Exception) -> None:
        raise AssertionError("the outcome of a boot-up contains its errors") from failure

    def _end(self, outcome: boot_slave.BootOutcome) -> None:
        if outcome.status is boot_slave.BootStatus.NO_ANSWER and self._may_try_again():
            self._again_us = self._now_us + _AGAIN_US
            return
        self.booting, self.outcome = False, outcome
        if outcome.status.good:
            self.session.state = self.state or NmtState.PRE_OPERATIONAL
            self._control.begin(self._now_us)  # the boot procedure already waited for one heartbeat
        self._booted(self)

    def _may_try_again(self) -> bool:
        """Return whether a boot-up may be repeated.

        The boot time of a mandatory slave must not have ended. Other slaves have no limit.
        """
        if not self.assignment.mandatory or not self._boot_time_us:
            return True
        return self._now_us - self.began_us < self._boot_time_us
