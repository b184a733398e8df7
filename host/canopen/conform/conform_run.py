"""A run of the tester: which checks are judged, in which order, and what came of them."""


# Theory of operation.
#
# A run listens for a second, reads the node (`subject.examine`), brings it into the state in which
# all checks begin (`NodeCare.prepare`), judges each check, and restores the node. This file is the
# part between: one check in, one `Result` out. The order below is what a verdict means, so do not
# change one part alone.
#
# 1. Bind. Names become the numbers of this node. A check that lacks an object, a feature, the level
#    or a yes is NOT_APPLICABLE. Nothing has been sent for it by then. What it would write must have
#    been read before, else the check is INCONCLUSIVE: what cannot be written back is not written.
# 2. Play. `care.begin` notes what may change, `exchange.begin` forgets old frames and starts the
#    clock of the check. Steps run until one fails; steps `at_end` run after that, and fail nothing.
# 3. Judge. The first rule that fits decides:
#      a step must not be done at this level                  NOT_APPLICABLE
#      the host, the bus or another node disturbed            INCONCLUSIVE
#      the program of the node raised                         FAIL, whatever else was seen
#      a `given` step failed, or an object that CiA 301       NOT_APPLICABLE if the abort code says
#        lets be constant was not written                       that the node need not take it, else
#                                                               INCONCLUSIVE
#      an upload went wrong in a step that only reads, in a   INCONCLUSIVE: group US judges uploads
#        check that is not about uploads
#      a disturbance was noted meanwhile                      INCONCLUSIVE
#      another node may have sent the LSS answer              INCONCLUSIVE: 7E4h names no node
#      the node had an error before the run, and was started  INCONCLUSIVE
#      the clause leaves the answer to the device             IMPLEMENTATION_DEFINED
#      none of these                                          FAIL
# 4. Tidy. `care.tidy` writes back and reads again. If the node does not come back, a failure
#    becomes BLOCKED: the check may have met a node that was already gone.
# 5. Again. A failure is played a second time. A pass then makes the result INCONCLUSIVE; if the
#    second go could not be prepared, the first one counts, as it has changed the state of the node.
#
# What couples to what. The evidence belongs to the exchange, and `exchange.begin` drops it: lines
# and crashes are taken before `care.tidy`, which begins anew. `boots` is compared across the check,
# because a node that booted has lost all that was written, not only what the check wrote.
# `_wanted` is what the last failed step expected; reports show it.
#
# Numbers. Times are bus time since the start of the run, never the clock of this host. A check may
# last the sum of all its waits and 2 s more (`notation.bind_check`); an answer is awaited for 1 s,
# as CiA 301 gives no time.

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from contextlib import suppress
from dataclasses import replace
from random import Random
from typing import Final

from tickrig.host.canopen.conform.binding.capabilities import EdsClaims
from tickrig.host.canopen.conform.bus.exchange import (
    ASSUMED_BIT_RATE,
    HOST_GAP_US,
    MS_US,
    PERIOD_TOLERANCE,
    BusExchange,
    Disturbed,
    NotAllowed,
    Presence,
    StepFailed,
    abort_of,
    matches,
)
from tickrig.host.canopen.conform.bus.sdo import SdoClient
from tickrig.host.canopen.conform.bus.steps import StepPlayer
from tickrig.host.canopen.conform.check import (
    ANSWER_MS,
    INTERRUPTED,
    STIMULUS,
    Action,
    Check,
    CheckOutcome,
    CheckVerdict,
    ConformancePlan,
    FrameLine,
    Hold,
    Level,
    Macro,
    Read,
    ReadOther,
    Report,
    Result,
    Send,
    Step,
    Write,
)
from tickrig.host.canopen.conform.node_care import HEARTBEAT, NodeCare
from tickrig.host.canopen.conform.notation import BoundCheck, Unbound, bind_check, step_head
from tickrig.host.canopen.conform.object_checks import object_checks
from tickrig.host.canopen.conform.permission import Permission
from tickrig.host.canopen.conform.subject import Subject, examine, other_device
from tickrig.host.canopen.conform.suite import OBJECTS, chosen_checks
from tickrig.host.canopen.errors import SdoFailed
from tickrig.host.links.link import LinkClosed, StampedLink
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID

# Judges one check: may it be done, what came of it, and once more if it failed.
_LSS_ANSWER: Final = "7E4#"
"""Begins what LSS slaves say: it does not tell which one."""
_HISTORY: Final = (0x1003, 0)
_PDO_PARAMETERS: Final = (*range(0x1400, 0x1600), *range(0x1800, 0x1A00))
_EMPTIED: Final = "empty the error history 1003h, which cannot be written back"
_START: Final = "000#01"
_UPLOADS: Final = ("UE", "US", "BU", "OD")
"""Groups whose checks fail where an upload goes wrong; others only look at values by it."""
_UNSEEN: Final = "could not be read back, see the checks of group US"
_UNPREPARED: Final = "could not be prepared"
_MAY_BE_CONSTANT: Final = frozenset(
    (0x1003, 0x1005, 0x1014, 0x1015, 0x1016, 0x1017, *_PDO_PARAMETERS)
)
"""Objects that are "rw; const, if not changeable" (CiA 301 v4.2.0, 7.5.2)."""
_READ_ONLY: Final = frozenset((0x0601_0000, 0x0601_0001, 0x0601_0002))
_NOT_SUPPORTED: Final = frozenset((0x0609_0030, 0x0609_0031, 0x0609_0032, 0x0609_0036))


def _is_misread(error: StepFailed) -> bool:
    """Return whether a segment came with another toggle bit, n or c than was wanted."""
    came, *wanted = (frame.partition("#")[2][:2] for frame in (error.got, *error.wanted))
    return _is_segment(came) and came not in wanted and any(map(_is_segment, wanted))


def _is_segment(command: str) -> bool:
    """Return whether a command byte is that of an answer in a segmented upload."""
    return command[:1] in {"0", "1"}


def _enables(action: Action) -> bool:
    """Return whether a step gives a PDO its COB-ID: every device takes its own."""
    index, sub = action.address if isinstance(action, Write) else (0, 0)
    return isinstance(action, Macro) or (index in _PDO_PARAMETERS and sub == 1)


def _is_constant(action: Action, error: StepFailed) -> bool:
    """Return whether the node keeps an object constant that CiA 301 lets be so."""
    written = isinstance(action, Write) and action.address[0] in _MAY_BE_CONSTANT
    return written and abort_of(error.got) in _READ_ONLY


def _starts(step: Step) -> bool:
    """Return whether a step starts the node."""
    return isinstance(step.action, Send) and step.action.frame.startswith(_START)


class Judge:
    """Plays checks on a node that is in the state in which each begins.

    Args:
        plan: of the run.
        exchange: the bus.
        player: plays steps on it.
        care: brings the node back after a check.
        permission: says what may be written.
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
        """Judge a check; one that failed is done again, and both are told."""
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
            return Result(check, first)  # the first go has left the node in another state
        if again.verdict is CheckVerdict.PASS:
            reason = f"passed when it was done again; before: {first.reason}"
            again = replace(again, verdict=CheckVerdict.INCONCLUSIVE, reason=reason)
        return Result(check, again, first)

    def _bind(self, check: Check, subject: Subject) -> BoundCheck | str:
        """Return the check with the numbers of the node, or why it cannot be done."""
        for word in sorted(check.needs - subject.features.words):
            if word != STIMULUS:
                return subject.features.reasons.get(word, f"the node has no {word}")
            if self._plan.stimulus is None:
                return "needs somebody at the inputs of the device: --stimulus"
        try:
            bound = bind_check(check, subject.names)
            if lacking := subject.missing(bound) or subject.fixed(bound.steps):
                return lacking
            for index, _ in sorted(bound.changed):
                self._permission.check_write(index)
            for index, _ in sorted(bound.written - bound.changed):
                self._permission.check_write(index, refused=True)
            if _HISTORY in bound.changed and any(self._care.held(_HISTORY)):
                self._permission.check_confirmed(_EMPTIED)
            for question in sorted(bound.questions):
                self._permission.check_confirmed(question)
        except Unbound as error:
            return error.reason
        except NotAllowed as error:
            return str(error)
        return bound

    def _as_found(self, step: Step) -> Step:
        """Leave out a value that an object held before the run: the tester has written another."""
        action = step.action
        if not isinstance(action, Hold) or action.value is None:
            return step
        at = action.address
        if not self._care.is_quieted(at) or self._care.held(at).hex().upper() != action.value:
            return step
        return step._replace(action=replace(action, value=None))

    def _unread(self, bound: BoundCheck, subject: Subject) -> str:
        """Say what a check would write that could not be written back; empty if all can be."""
        written = bound.changed & subject.has | bound.written & subject.values
        if self._plan.level is Level.READ_ONLY or not (unread := self._care.unread(written)):
            return ""
        places = ", ".join(f"{index:04X}h:{sub:02X}" for index, sub in unread)
        return f"{places} cannot be read, so that what it holds could not be written back"

    def _go(self, bound: BoundCheck) -> CheckOutcome:
        """Do a check once, and bring the node back."""
        self._care.begin(bound)
        if self._care.lost:
            return CheckOutcome(CheckVerdict.BLOCKED, "the node does not answer any more")
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
            verdict, reason = CheckVerdict.BLOCKED, f"{reason}; the node did not come back"
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
        """Return the verdict of a check that the node did not let come to its question.

        The clause of the check says nothing of what only prepares it.
        CiA 301 lets many objects be constant, and values be refused that a device does not
        support.
        """
        if self._exchange.disturbances:
            reason = f"{reason}; {', '.join(self._exchange.disturbances)}"
            return CheckVerdict.INCONCLUSIVE, f"{_UNPREPARED}: {reason}"
        code = abort_of(error.got)
        if code in _READ_ONLY or (code in _NOT_SUPPORTED and not _enables(action)):
            return CheckVerdict.NOT_APPLICABLE, f"the node need not take this: {reason}"
        return CheckVerdict.INCONCLUSIVE, f"{_UNPREPARED}: {reason}"

    def _end(self, bound: BoundCheck) -> None:
        """Do what is done at the end, however the check went."""
        for step in bound.steps:
            if step.at_end:
                with suppress(StepFailed, Disturbed, NotAllowed):
                    self._player.play(step)

    def _crash(self) -> str:
        """Return what the program of the node has raised first."""
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


# What a report says of how the run judged: for people, by name.


def _describe_settings(plan: ConformancePlan, others: Collection[int]) -> dict[str, str]:
    """Return bit rate, limits and tolerances of a run.

    Args:
        plan: what was chosen.
        others: node-IDs that were on the bus.
    """
    rate = f"{plan.bit_rate} bit/s" if plan.bit_rate else f"{ASSUMED_BIT_RATE} bit/s, assumed"
    nodes = ", ".join(str(node) for node in sorted(set(others) - {0})) or "none"
    return {
        "bit rate": rate,
        "load by the tester": f"at most {plan.max_load:.0%}",
        "other nodes": nodes,
        "resolution of time stamps": f"{plan.resolution_us / MS_US:g} ms",
        "answers": f"within {ANSWER_MS} ms, where the check says nothing else",
        "periods": f"mean within {PERIOD_TOLERANCE:.0%}",
        "late host": f"{HOST_GAP_US / MS_US:g} ms make a failure inconclusive",
        "longest run": f"{plan.longest_s / 60:g} min, then all is blocked; 2 min more to restore",
        "seed": str(plan.seed),
    }


# A heartbeat that runs though 1017h does not say so: told, and told again when it is gone.

_SPARE_MS: Final = 1_000
_MISSED: Final = 3
"""So many periods without a heartbeat, and it is gone."""


class _StrayHeartbeat:
    """What was heard of the heartbeat of a node before the run.

    Args:
        exchange: the bus.
        node_id: of the node, 1..127.

    Attributes:
        stamps: when heartbeats came before the run, in bus time.
        finding: that 1017h does not say so, for people; empty if it does.
        unrestored: that it is gone after the run, for people; empty if it is not.
    """

    def __init__(self, exchange: BusExchange, node_id: int) -> None:
        self._exchange, self._can_id = exchange, f"{ERROR_CONTROL_COB_ID + node_id:03X}"
        self._pattern = f"{self._can_id}#[0-7][45F]"
        self.stamps: list[int] = []
        self._period_ms: int | None = 0
        self.finding = self.unrestored = ""

    def hear(self) -> None:
        """Take what has come so far; answers to node guarding are no heartbeat."""
        heard = self._exchange.unread(self._can_id)
        if not any(frame.remote for _, frame in heard):
            self.stamps = [at_us for at_us, frame in heard if matches(self._pattern, str(frame))]

    def compare(self, period_ms: int | None) -> None:
        """Hold what was heard against 1017h, None if the node has none."""
        self._period_ms = period_ms
        if not period_ms:
            self.finding = f"{self._text()}, but {self._said()}"

    def look_again(self) -> None:
        """Listen after the run: what 1017h does not say, nobody can switch on again."""
        each_ms = self._each_ms()
        if not self.finding or not each_ms:
            return
        self._exchange.begin((_MISSED * each_ms + _SPARE_MS) * MS_US)
        if not self._exchange.collect(self._pattern, _MISSED * each_ms):
            self.unrestored = f"{self._text()}: gone, and {self._said()} as before"

    def _each_ms(self) -> int:
        stamps = self.stamps
        return round((stamps[-1] - stamps[0]) / max(1, len(stamps) - 1) / MS_US) if stamps else 0

    def _text(self) -> str:
        each_ms = self._each_ms()
        return f"heartbeat each {each_ms} ms" if each_ms else "a heartbeat was heard"

    def _said(self) -> str:
        return "the node has no 1017h" if self._period_ms is None else "1017h = 0"


_LISTEN_MS: Final = 1_000
"""So long is only listened at first: who else is on the bus?"""

_EXAMINE_US: Final = 120_000_000
"""So long may it take to read the node before the first check."""

_INTEGERS: Final = {1: "u8", 2: "u16", 3: "u24", 4: "u32", 5: "u40", 6: "u48", 7: "u56", 8: "u64"}
"""Types by the size of a value in bytes."""

_MOST_CRASHES: Final = 20
"""So many ways in which the program of the node crashed are told."""

Crash = Callable[[str, list[str]], object]
"""Takes what the program of the node has raised, in a line, and the lines at which it did."""


class ConformRun:
    """Judges one node.

    Args:
        link: the bus; nobody else may read from this link.
        node_id: of the node, 1..127.
        plan: what was chosen.
        device: what the EDS says of the node, None to ask the node itself.
        claims: what it says beside the objects.
        source: the bus, as the user named it.
        on_result: called with each result when it is there.
    """

    def __init__(  # noqa: PLR0913 - a run, by keyword
        self,
        link: StampedLink,
        node_id: int,
        plan: ConformancePlan,
        *,
        device: EdsDevice | None = None,
        claims: EdsClaims | None = None,
        source: str = "",
        on_result: Callable[[Result], object] = lambda result: None,
    ) -> None:
        self._node_id, self._plan, self._source = node_id, plan, source
        self._device, self._claims, self._on_result = device, claims, on_result
        self._permission = Permission(plan.level, plan.allow, node_id, plan.confirm, plan.never)
        self._exchange = BusExchange(
            link,
            node_id,
            bit_rate=plan.bit_rate or ASSUMED_BIT_RATE,
            max_load=plan.max_load,
            permit=self._permission.check,
            resolution_us=plan.resolution_us,
            shared_host=plan.shared_host,
        )
        self._client = SdoClient(self._exchange, node_id)
        self._care = NodeCare(self._exchange, self._client, node_id, plan.level)
        self._stray = _StrayHeartbeat(self._exchange, node_id)
        player = StepPlayer(self._exchange, node_id, plan.stimulus, self._client)
        self._judge = Judge(plan, self._exchange, player, self._care, self._permission)
        self._longest_us = round(plan.longest_s * 1e6)
        self._results: list[Result] = []
        self._subject: Subject | None = None
        self._crashes: dict[str, None] = {}
        self._absent = False

    def disturb(self, reason: str) -> None:
        """Let the check under way be inconclusive if it fails: the adapter lost frames, or such."""
        self._exchange.disturb(reason)

    def crash(self, reason: str, where: Iterable[str] = ()) -> None:
        """Let the check under way fail: the program of the node has raised, and begins anew.

        Args:
            reason: what it raised, in a line.
            where: the lines of the program at which it did.
        """
        if len(self._crashes) < _MOST_CRASHES:
            self._crashes[reason] = None
        self._exchange.crash(reason, where)

    def run(self) -> Report:
        """Judge the node and return the report; whatever happens, what was changed is restored.

        Ctrl-C ends it with a report of what was judged; a second one, while the node is being
        restored, leaves the node as it is.
        """
        aborted = ""
        try:
            aborted = self._run()
        except KeyboardInterrupt:
            aborted = INTERRUPTED
        except LinkClosed as error:
            aborted = str(error)
        finally:
            self._restore(patient=not aborted)
        return self._report(aborted)

    def _run(self) -> str:
        """Judge; return why nothing could be, empty if it could."""
        self._exchange.begin(min(_EXAMINE_US, self._longest_us))
        self._exchange.wait(_LISTEN_MS)
        self._stray.hear()
        self._permission.others = frozenset(self._exchange.others)
        self._exchange.end_listening()
        try:
            self._examine()
        except (SdoFailed, StepFailed, Disturbed) as error:
            return self._give_up(error)
        assert self._subject is not None
        self._judge_all([*chosen_checks(self._plan), *self._object_checks()])
        return ""

    def _give_up(self, error: Exception) -> str:
        """Judge nothing; return why, where no node, or more than one, has the node-ID."""
        presence = self._exchange.presence
        crashed = next(iter(self._crashes), "")
        if crashed or presence is Presence.ONE:
            self._block(chosen_checks(self._plan), crashed or str(error))
            return ""
        self._absent = True
        if presence is Presence.NONE:
            verdict, reason = CheckVerdict.BLOCKED, self._nobody()
        else:
            reason = f"each request is answered twice: two nodes have ID {self._node_id}?"
            verdict = CheckVerdict.INCONCLUSIVE
        self._block(chosen_checks(self._plan), reason, verdict)
        return reason

    def _nobody(self) -> str:
        heard = ", ".join(map(str, sorted(self._exchange.others - {0}))) or "nobody"
        return f"node {self._node_id} does not answer; heard here: {heard}"

    def _examine(self) -> None:
        self._subject = examine(
            *(self._client, self._node_id, self._plan),
            *(self._device, self._claims, self._exchange.others),
        )
        if self._exchange.presence is Presence.TWO:
            raise Disturbed("two nodes answer")
        self._exchange.played = self._subject.names.peer
        if self._stray.stamps:
            self._stray.compare(self._client.number(*HEARTBEAT))
        subject = self._subject
        self._care.prepare(subject.restorable(self._plan.level), subject.binding.held)

    def _object_checks(self) -> list[Check]:
        """Make the chosen checks of the objects of the EDS; without one there are none."""
        plan = self._plan
        if self._device is None or not plan.may_choose(OBJECTS):
            return []
        may_choose = plan.may_choose if not plan.seed else _any  # a seed gives all an order
        checks = [
            *object_checks(
                *(self._device, self._node_id),
                allow=plan.allow,
                never=plan.never,
                may_choose=may_choose,
            )
        ]
        if plan.seed:
            Random(plan.seed).shuffle(checks)
        return list(filter(plan.chooses, checks))

    def _judge_all(self, checks: list[Check]) -> None:
        assert self._subject is not None
        until_us = self._exchange.start_us + self._longest_us
        for number, check in enumerate(checks):
            if self._care.lost:
                self._block(checks[number:], "the node does not answer any more")
                return
            if self._exchange.now_us > until_us:
                self._block(checks[number:], "the run took too long")
                return
            self._keep(self._judge.result(check, self._subject))

    def _block(
        self, checks: Iterable[Check], reason: str, verdict: CheckVerdict = CheckVerdict.BLOCKED
    ) -> None:
        for check in checks:
            self._keep(Result(check, CheckOutcome(verdict, reason)))

    def _keep(self, result: Result) -> None:
        self._results.append(result)
        self._on_result(result)

    def _restore(self, *, patient: bool) -> None:
        """Leave the node as it was; the first Ctrl-C of a run does not keep anybody from it."""
        try:
            self._care.restore()
        except KeyboardInterrupt:
            if patient:
                self._restore(patient=False)
            else:
                self._care.give_up()
        except LinkClosed:
            self._care.give_up()
        with suppress(KeyboardInterrupt, LinkClosed, StepFailed):
            self._look_again()

    def _look_again(self) -> None:
        if self._plan.level > Level.READ_ONLY:
            self._stray.look_again()

    def _report(self, aborted: str) -> Report:
        subject = self._subject
        findings = (*subject.binding.findings, *subject.features.findings) if subject else ()
        stray = [self._stray.finding] if self._stray.finding else []
        findings = tuple(dict.fromkeys((*self._crashes, *self._client.misnamed, *stray, *findings)))
        repairs = tuple(f"{i:04X}h:{s:02X}={_typed(data)}" for (i, s), data in self._care.repairs)
        gone = (self._stray.unrestored,) if self._stray.unrestored else ()
        return Report(
            self._source,
            self._node_id,
            self._plan.level,
            tuple(self._results),
            node=subject.about if subject else {},
            settings=_describe_settings(self._plan, self._exchange.others),
            findings=findings,
            unrestored=(*self._care.unrestored, *gone),
            repairs=repairs,
            duration_us=self._exchange.now_us - self._exchange.start_us,
            aborted=aborted,
            absent=self._absent,
            doubt=other_device(self._device, subject.about) if subject else "",
        )


def _any(group: str, place: str) -> bool:
    return True


def _typed(data: bytes) -> str:
    """Write a value as `canmon net write` takes it."""
    if kind := _INTEGERS.get(len(data)):
        return f"{kind}:0x{int.from_bytes(data, 'little'):X}"
    return f"hex:{data.hex().upper()}"
