"""A run of the tester, with selection and order of the checks, and their verdicts."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from contextlib import suppress
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
    Presence,
    StepFailed,
)
from tickrig.host.canopen.conform.bus.frame_pattern import matches
from tickrig.host.canopen.conform.bus.sdo import SdoClient
from tickrig.host.canopen.conform.bus.steps import StepPlayer
from tickrig.host.canopen.conform.check import ANSWER_MS, Check, ConformancePlan, Level
from tickrig.host.canopen.conform.judge import Judge
from tickrig.host.canopen.conform.node_care import HEARTBEAT, NodeCare
from tickrig.host.canopen.conform.object_checks import object_checks
from tickrig.host.canopen.conform.permission import Permission
from tickrig.host.canopen.conform.subject import Subject, examine, other_device
from tickrig.host.canopen.conform.suite import OBJECTS, chosen_checks
from tickrig.host.canopen.conform.verdict import (
    INTERRUPTED,
    CheckOutcome,
    CheckVerdict,
    Report,
    Result,
)
from tickrig.host.canopen.errors import SdoFailed
from tickrig.host.links.link import LinkClosed, StampedLink
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID

# The settings of the run in a report, by name.


def _describe_settings(plan: ConformancePlan, others: Collection[int]) -> dict[str, str]:
    """Return bit rate, limits and tolerances of a run.

    Args:
        plan: options of the run.
        others: node-IDs of other nodes that were on the bus.
    """
    rate = f"{plan.bit_rate} bit/s" if plan.bit_rate else f"{ASSUMED_BIT_RATE} bit/s, assumed"
    nodes = ", ".join(str(node) for node in sorted(set(others) - {0})) or "none"
    return {
        "bit rate": rate,
        "load by the tester": f"at most {plan.max_load:.0%}",
        "other nodes": nodes,
        "resolution of time stamps": f"{plan.resolution_us / MS_US:g} ms",
        "answers": f"within {ANSWER_MS} ms, unless the check says otherwise",
        "periods": f"mean within {PERIOD_TOLERANCE:.0%}",
        "late host": f"{HOST_GAP_US / MS_US:g} ms make a failure inconclusive",
        "longest run": f"{plan.longest_s / 60:g} min, then all is blocked; 2 min more to restore",
        "seed": str(plan.seed),
    }


# A heartbeat that contradicts 1017h: reported at the start, and at the end if it is gone.

_SPARE_MS: Final = 1_000
_MISSED: Final = 3
"""Number of periods without a heartbeat after which the heartbeat counts as gone."""


class _StrayHeartbeat:
    """The heartbeat of a node before the run.

    Args:
        exchange: bus of the node.
        node_id: node-ID of the node, 1..127.

    Attributes:
        stamps: times at which heartbeats arrived before the run, in bus time.
        finding: contradiction between the heartbeat and 1017h in words, empty if there is none.
        unrestored: message that the heartbeat is missing after the run, empty if it is not missing.
    """

    def __init__(self, exchange: BusExchange, node_id: int) -> None:
        self._exchange, self._can_id = exchange, f"{ERROR_CONTROL_COB_ID + node_id:03X}"
        self._pattern = f"{self._can_id}#[0-7][45F]"
        self.stamps: list[int] = []
        self._period_ms: int | None = 0
        self.finding = self.unrestored = ""

    def hear(self) -> None:
        """Read the received heartbeats. Responses to node guarding do not count."""
        heard = self._exchange.unread(self._can_id)
        if not any(frame.remote for _, frame in heard):
            self.stamps = [at_us for at_us, frame in heard if matches(self._pattern, str(frame))]

    def compare(self, period_ms: int | None) -> None:
        """Record a finding if the node sends a heartbeat although object 1017h does not enable one.

        Args:
            period_ms: heartbeat time in 1017h in milliseconds, or None if the node has no 1017h.
        """
        self._period_ms = period_ms
        if not period_ms:
            self.finding = f"{self._text()}, but {self._said()}"

    def look_again(self) -> None:
        """After the run, check whether the node still sends the heartbeat that it sent before.

        The check is done only if the node sent a heartbeat before the run although object 1017h did
        not enable one. If this heartbeat is missing now, `unrestored` becomes a text that reports
        it. The tester cannot switch on such a heartbeat.
        """
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
        return f"heartbeat each {each_ms} ms" if each_ms else "a heartbeat was received"

    def _said(self) -> str:
        return "the node has no 1017h" if self._period_ms is None else "1017h = 0"


_LISTEN_MS: Final = 1_000
"""Time at the start in which the tester listens for other nodes on the bus."""

_EXAMINE_US: Final = 120_000_000
"""The longest time for reading the node before the first check."""

_INTEGERS: Final = range(1, 9)
"""Sizes in bytes of the values that are written as integers."""

_MOST_CRASHES: Final = 20
"""Number of different crashes of the node's program to report."""

Crash = Callable[[str, list[str]], object]
"""Function called with an error of the node's program and the source lines that raised it."""


class ConformRun:
    """A conformance test of one node, from the first request to the report.

    Args:
        link: connection to the bus, from which no other code may read during the test.
        node_id: node-ID of the node, 1..127.
        plan: options of the run, such as level and selected checks.
        device: device that the EDS describes, or None to find out the objects from the node.
        claims: capabilities that the EDS states beside the list of objects, such as LSS support, or
            None without an EDS.
        source: name of the bus as the user entered it, for the report.
        on_result: function that is called with the result of each check.
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
        """Make the running check inconclusive if it fails, for example after lost frames."""
        self._exchange.disturb(reason)

    def crash(self, reason: str, where: Iterable[str] = ()) -> None:
        """Make the running check fail, because the program of the node crashed and starts again.

        This method is for emulated nodes, whose exceptions the tester can see.

        Args:
            reason: exception of the crash in one line.
            where: lines of the traceback.
        """
        if len(self._crashes) < _MOST_CRASHES:
            self._crashes[reason] = None
        self._exchange.crash(reason, where)

    def run(self) -> Report:
        """Execute all selected checks, restore the node, and return the report.

        The node is also restored after errors and after Ctrl-C. The first Ctrl-C ends the run, and
        the report contains the checks that have ended. A second Ctrl-C ends the restoring.
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
        """Run the checks. Return why no check could be judged, or an empty text."""
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
        """Return why no check can run: no node has the node-ID, or more than one."""
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
        heard = ", ".join(map(str, sorted(self._exchange.others - {0}))) or "none"
        return f"node {self._node_id} does not answer; other nodes: {heard}"

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
        self._care.prepare(subject.restorable(self._plan.level), subject.binding.reader.held)

    def _object_checks(self) -> list[Check]:
        """Return the selected checks of the objects of the EDS; none without an EDS."""
        plan = self._plan
        if self._device is None or not plan.may_choose(OBJECTS):
            return []
        may_choose = plan.may_choose if not plan.seed else _any  # a seed orders all objects
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
        """Restore the node. The first Ctrl-C of a run does not prevent this."""
        try:
            self._care.restore()
        except KeyboardInterrupt:
            if patient:
                self._restore(patient=False)
            else:
                self._care.state.give_up()
        except LinkClosed:
            self._care.state.give_up()
        if self._plan.level > Level.READ_ONLY:
            with suppress(KeyboardInterrupt, LinkClosed, StepFailed):
                self._stray.look_again()

    def _report(self, aborted: str) -> Report:
        subject = self._subject
        findings = (*subject.binding.findings, *subject.features.findings) if subject else ()
        stray = [self._stray.finding] if self._stray.finding else []
        findings = tuple(dict.fromkeys((*self._crashes, *self._client.misnamed, *stray, *findings)))
        repairs = tuple(
            f"{i:04X}h:{s:02X}={_typed(data)}" for (i, s), data in self._care.state.repairs
        )
        gone = (self._stray.unrestored,) if self._stray.unrestored else ()
        return Report(
            self._source,
            self._node_id,
            self._plan.level,
            tuple(self._results),
            node=subject.about if subject else {},
            settings=_describe_settings(self._plan, self._exchange.others),
            findings=findings,
            unrestored=(*self._care.state.unrestored, *gone),
            repairs=repairs,
            duration_us=self._exchange.now_us - self._exchange.start_us,
            aborted=aborted,
            absent=self._absent,
            doubt=other_device(self._device, subject.about) if subject else "",
        )


def _any(group: str, place: str) -> bool:
    return True


def _typed(data: bytes) -> str:
    """Write a value in the notation of `canmon net write`."""
    if len(data) in _INTEGERS:
        return f"u{8 * len(data)}:0x{int.from_bytes(data, 'little'):X}"
    return f"hex:{data.hex().upper()}"
