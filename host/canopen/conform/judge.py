"""Judge of one check: permission, verdict, and a repetition after a failure."""

# Theory of operation.
#
# A run listens for a second, reads the node (`subject.examine`), brings it into the state in which
# all checks begin (`NodeCare.prepare`), judges each check, and restores the node. This file judges:
# one check in, one `Result` out. The order below defines what a verdict means, so do not change one
# part alone.
#
# 1. Bind. Names become the numbers of this node. A check that lacks an object, a feature, the level
#    or a confirmation is NOT_APPLICABLE. Nothing has been sent for it by then. Values that it would
#    write must have been read before, else the check is INCONCLUSIVE: the tester writes nothing
#    that it cannot restore.
# 2. Play. `care.begin` records what may change, `exchange.begin` drops old frames and starts the
#    clock of the check. Steps run until one fails; steps `at_end` run after that, and cannot fail
#    the check.
# 3. Judge. The first rule that applies decides:
#      the level forbids a step                               NOT_APPLICABLE
#      the host, the bus or another node interfered           INCONCLUSIVE
#      the program of the node raised                         FAIL, in any case
#      a `given` step failed, or an object that CiA 301       NOT_APPLICABLE if the abort code says
#        lets be constant was not written                       that the node need not take it, else
#                                                               INCONCLUSIVE
#      an upload went wrong in a step that only reads, in a   INCONCLUSIVE: group US judges uploads
#        check that is not about uploads
#      a disturbance was recorded                             INCONCLUSIVE
#      another node may have sent the LSS answer              INCONCLUSIVE: 7E4h names no node
#      the node had an error before the run, and was started  INCONCLUSIVE
#      the clause leaves the answer to the device             IMPLEMENTATION_DEFINED
#      none of these                                          FAIL
# 4. Tidy. `care.tidy` restores the values and reads them again. If the node does not come back, a
#    failure becomes BLOCKED: the check may have met a node that was already gone.
# 5. Again. A failure is played a second time. A pass then makes the result INCONCLUSIVE; if the
#    second attempt could not be prepared, the first one counts, because it changed the state of the
#    node.
#
# Coupling. The evidence belongs to the exchange, and `exchange.begin` drops it: lines and crashes
# are saved before `care.tidy`, which calls it. `boots` is compared across the check, because a node
# that booted has lost all written values, not only those of the check. `_wanted` is what the last
# failed step expected; reports show it.
#
# Numbers. Times are bus time since the start of the run, never the clock of this host. A check may
# last the sum of all its waits and 2 s more (`notation.bind_check`); the wait for an answer is 1 s,
# because CiA 301 gives no time.

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Final

from tickrig.host.canopen.conform.bus.exchange import BusExchange, Disturbed, NotAllowed, StepFailed
from tickrig.host.canopen.conform.bus.frame_pattern import abort_of
from tickrig.host.canopen.conform.bus.steps import StepPlayer
from tickrig.host.canopen.conform.check import (
    STIMULUS,
    Action,
    Check,
    ConformancePlan,
    Hold,
    Level,
    Macro,
    Read,
    ReadOther,
    Send,
    Step,
    Write,
)
from tickrig.host.canopen.conform.node_care import NodeCare
from tickrig.host.canopen.conform.notation import BoundCheck, Unbound, bind_check, step_head
from tickrig.host.canopen.conform.permission import Permission
from tickrig.host.canopen.conform.subject import Subject
from tickrig.host.canopen.conform.verdict import CheckOutcome, CheckVerdict, FrameLine, Result
from tickrig.host.canopen.conform.write_order import PDOS

_LSS_ANSWER: Final = "7E4#"
"""CAN-ID that all LSS slaves share. A frame does not show which slave sent it."""
_HISTORY: Final = (0x1003, 0)
_EMPTIED: Final = "empty the error history 1003h, which cannot be written back"
_START: Final = "000#01"
_UPLOADS: Final = ("UE", "US", "BU", "OD")
"""Groups that judge uploads. The checks of other groups only use uploads to read values."""
_UNSEEN: Final = "could not be read back, see the checks of group US"
_UNPREPARED: Final = "could not be prepared"
_MAY_BE_CONSTANT: Final = frozenset((0x1003, 0x1005, 0x1014, 0x1015, 0x1016, 0x1017, *PDOS))
"""Objects that are "rw; const, if not changeable" (CiA 301 v4.2.0, 7.5.2)."""
_READ_ONLY: Final = frozenset((0x0601_0000, 0x0601_0001, 0x0601_0002))
_NOT_SUPPORTED: Final = frozenset((0x0609_0030, 0x0609_0031, 0x0609_0032, 0x0609_0036))


def _is_misread(error: StepFailed) -> bool:
    """Return whether a segment had another toggle bit, n or c than expected."""
    came, *wanted = (frame.partition("#")[2][:2] for frame in (error.got, *error.wanted))
    return _is_segment(came) and came not in wanted and any(map(_is_segment, wanted))


def _is_segment(command: str) -> bool:
    """Return whether a command byte belongs to a response in a segmented upload."""
    return command[:1] in {"0", "1"}


def _enables(action: Action) -> bool:
    """Return whether a step sets the COB-ID of a PDO. Every device accepts its own COB-ID."""
    index, sub = action.address if isinstance(action, Write) else (0, 0)
    return isinstance(action, Macro) or (index in PDOS and sub == 1)


def _is_constant(action: Action, error: StepFailed) -> bool:
    """Return whether the node keeps an object constant that CiA 301 allows to be constant."""
    written = isinstance(action, Write) and action.address[0] in _MAY_BE_CONSTANT
    return written and abort_of(error.got) in _READ_ONLY


def _starts(step: Step) -> bool:
    """Return whether a step starts the node."""
    return isinstance(step.action, Send) and step.action.frame.startswith(_START)


class Judge:
    """Judge that executes single checks and gives their verdicts.

    Every check begins in the same state of the node.

    Args:
        plan: options of the run, such as its level.
        exchange: connection to the bus of the node.
        player: player that executes the steps of a check.
        care: helper that restores the node after each check.
        permission: rules that decide which objects may be written.
    """

    def __init__(
        self,
        plan: ConformancePlan,
        exchange: BusExchange,
        player: StepPlayer,
        care: NodeCare,
        permission: Permission,
    ) -> None:
        self._plan, self._exchange, self._player = plan, exchange, player
        self._care, self._permission = care, permission

    def result(self, check: Check, subject: Subject) -> Result:
        """Judge a check. Repeat a check that failed, and report both attempts."""
        bound = self._bind(check, subject)
        if isinstance(bound, str):
            return Result(check, CheckOutcome(CheckVerdict.NOT_APPLICABLE, bound))
        steps = tuple(map(self._as_found, bound.steps))
        bound = bound if steps == bound.steps else replace(bound, steps=steps)
        if unread := self._unread(bound, subject):
            return Result(check, CheckOutcome(CheckVerdict.INCONCLUSIVE, unread))
        first = self._go(bound)
        if first.verdict is not CheckVerdict.FAIL or self._care.lost:
            return Result(check, first)
        again = self._go(bound)
        if again.reason.startswith(_UNPREPARED) and not self._exchange.disturbances:
            return Result(check, first)  # the first attempt left the node in another state
        if again.verdict is CheckVerdict.PASS:
            reason = f"passed at the second attempt; first attempt: {first.reason}"
            again = replace(again, verdict=CheckVerdict.INCONCLUSIVE, reason=reason)
        return Result(check, again, first)

    def _bind(self, check: Check, subject: Subject) -> BoundCheck | str:
        """Return the check with the numbers of the node, or the reason why it cannot be played."""
        for word in sorted(check.needs - subject.features.words):
            if word != STIMULUS:
                return subject.features.reasons.get(word, f"the node has no {word}")
            if self._plan.stimulus is None:
                return "needs a stimulus for the inputs of the device: --stimulus"
        try:
            bound = bind_check(check, subject.names)
            if lacking := subject.missing(bound) or subject.fixed(bound.steps):
                return lacking
            for index, _ in sorted(bound.changed):
                self._permission.check_write(index)
            for index, _ in sorted(bound.written - bound.changed):
                self._permission.check_write(index, refused=True)
            if _HISTORY in bound.changed and any(self._care.state.held(_HISTORY)):
                self._permission.check_confirmed(_EMPTIED)
            for question in sorted(bound.questions):
                self._permission.check_confirmed(question)
        except Unbound as error:
            return error.reason
        except NotAllowed as error:
            return str(error)
        return bound

    def _as_found(self, step: Step) -> Step:
        """Omit an object's value from before the run, if the tester has written another one."""
        action = step.action
        if not isinstance(action, Hold) or action.value is None:
            return step
        at, state = action.address, self._care.state
        if not state.is_quieted(at) or state.held(at).hex().upper() != action.value:
            return step
        return step._replace(action=replace(action, value=None))

    def _unread(self, bound: BoundCheck, subject: Subject) -> str:
        """Return why the objects of a check could not be restored, or an empty text."""
        written = bound.changed & subject.entries.keys() | bound.written & subject.values
        if self._plan.level is Level.READ_ONLY or not (unread := self._care.unread(written)):
            return ""
        places = ", ".join(f"{index:04X}h:{sub:02X}" for index, sub in unread)
        return f"{places} cannot be read, so its value could not be restored"

    def _go(self, bound: BoundCheck) -> CheckOutcome:
        """Play a check once, and restore the node."""
        self._care.begin(bound)
        if self._care.lost:
            return CheckOutcome(CheckVerdict.BLOCKED, "the node no longer answers")
        boots = self._exchange.boots
        self._exchange.begin(bound.within_us, bound.can_ids)
        start_us, begun_us = self._exchange.now_us, self._exchange.start_us
        self._wanted: tuple[str, ...] = ()
        verdict, reason = self._play(bound)
        self._end(bound)
        crashed = bool(self._exchange.crashes)
        if crashed and verdict is not CheckVerdict.FAIL:
            verdict, reason = CheckVerdict.FAIL, self._crash()
        lines, end_us = self._lines(), self._exchange.now_us
        unwell = verdict in {CheckVerdict.FAIL, CheckVerdict.INCONCLUSIVE} and not crashed
        if not self._care.tidy(bound, boots) and unwell:
            verdict, reason = CheckVerdict.BLOCKED, f"{reason}; the node did not answer again"
        times = start_us - begun_us, end_us - begun_us
        return CheckOutcome(verdict, reason, lines, *times, self._wanted)

    def _play(self, bound: BoundCheck) -> tuple[CheckVerdict, str]:
        number = 0
        try:
            for step in bound.steps:
                number += 1
                if not step.at_end:
                    self._player.play(step)
                if self._exchange.crashes:
                    raise StepFailed(self._crash())
        except NotAllowed as error:
            return CheckVerdict.NOT_APPLICABLE, str(error)
        except Disturbed as error:
            return CheckVerdict.INCONCLUSIVE, str(error)
        except StepFailed as error:
            self._wanted = error.wanted
            where = ", ".join(filter(None, [f"step {number}", step_head(step)]))
            if self._exchange.crashes:
                return CheckVerdict.FAIL, f"{where}: {self._crash()}"
            if step.given or _is_constant(step.action, error):
                return self._unprepared(step.action, error, f"{where}: {error}")
            reads = isinstance(step.action, Read | ReadOther)
            misread = reads and bound.check.group not in _UPLOADS and _is_misread(error)
            return self._failed(bound, f"{where}: {error}", misread=misread)
        return CheckVerdict.PASS, ""

    def _unprepared(
        self, action: Action, error: StepFailed, reason: str
    ) -> tuple[CheckVerdict, str]:
        """Return the verdict if the node refused the preparation, or a write of a constant object.

        The clause of the check does not cover its preparation.
        CiA 301 allows many objects to be constant, and a device to refuse values that it does not
        support.
        """
        if self._exchange.disturbances:
            reason = f"{reason}; {', '.join(self._exchange.disturbances)}"
            return CheckVerdict.INCONCLUSIVE, f"{_UNPREPARED}: {reason}"
        code = abort_of(error.got)
        if code in _READ_ONLY or (code in _NOT_SUPPORTED and not _enables(action)):
            return CheckVerdict.NOT_APPLICABLE, f"the node need not accept this: {reason}"
        return CheckVerdict.INCONCLUSIVE, f"{_UNPREPARED}: {reason}"

    def _end(self, bound: BoundCheck) -> None:
        """Do the steps that are always done at the end."""
        for step in bound.steps:
            if step.at_end:
                with suppress(StepFailed, Disturbed, NotAllowed):
                    self._player.play(step)

    def _crash(self) -> str:
        """Return the first error that the program of the node raised."""
        return next(iter(self._exchange.crashes))

    def _lines(self) -> tuple[FrameLine, ...]:
        return self._exchange.evidence.lines()

    def _failed(
        self, bound: BoundCheck, reason: str, *, misread: bool = False
    ) -> tuple[CheckVerdict, str]:
        if misread:
            return CheckVerdict.INCONCLUSIVE, f"{_UNSEEN}: {reason}"
        if self._exchange.disturbances:
            return CheckVerdict.INCONCLUSIVE, f"{reason}; {', '.join(self._exchange.disturbances)}"
        others = self._permission.others
        if others and any(line.text.startswith(_LSS_ANSWER) for line in self._lines()):
            known = ", ".join(map(str, sorted(others)))
            return CheckVerdict.INCONCLUSIVE, f"{reason}; other nodes may have answered: {known}"
        errors = self._care.errors
        if errors and any(map(_starts, bound.steps)):
            why = f"1001h was {errors:02X}h before: with an error a node may leave Operational"
            return CheckVerdict.INCONCLUSIVE, f"{reason}; {why}"
        if bound.check.choice:
            return CheckVerdict.IMPLEMENTATION_DEFINED, f"{bound.check.choice}; {reason}"
        return CheckVerdict.FAIL, reason
