"""A run of the tester: which checks are judged, in which order, and what came of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial
from random import Random
from typing import Final

from tickrig.host.canopen.conform.bus.exchange import Exchange
from tickrig.host.canopen.conform.bus.presence import Presence
from tickrig.host.canopen.conform.bus.sdo_client import SdoClient
from tickrig.host.canopen.conform.bus.step_failed import Disturbed, StepFailed
from tickrig.host.canopen.conform.bus.steps import Player
from tickrig.host.canopen.conform.bus.traffic import ASSUMED_BIT_RATE
from tickrig.host.canopen.conform.check import Check, Level
from tickrig.host.canopen.conform.judge import Judge
from tickrig.host.canopen.conform.notation.suite import suite_checks
from tickrig.host.canopen.conform.objects.object_checks import object_checks
from tickrig.host.canopen.conform.objects.object_steps import play_object_step
from tickrig.host.canopen.conform.plan import Plan
from tickrig.host.canopen.conform.safety.node_care import HEARTBEAT, NodeCare
from tickrig.host.canopen.conform.safety.permission import Permission
from tickrig.host.canopen.conform.safety.stray_heartbeat import StrayHeartbeat
from tickrig.host.canopen.conform.settings import describe_settings
from tickrig.host.canopen.conform.subject.other_device import other_device
from tickrig.host.canopen.conform.subject.subject import Subject, examine
from tickrig.host.canopen.conform.verdict import INTERRUPTED, Outcome, Report, Result, Verdict
from tickrig.host.canopen.errors import SdoFailed
from tickrig.host.links.errors import LinkClosed
from tickrig.host.links.link import StampedLink
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.eds_file import EdsFile

LISTEN_MS: Final = 1_000
"""So long is only listened at first: who else is on the bus?"""

EXAMINE_US: Final = 120_000_000
"""So long may it take to read the node before the first check."""

INTEGERS: Final = {1: "u8", 2: "u16", 3: "u24", 4: "u32", 5: "u40", 6: "u48", 7: "u56", 8: "u64"}
"""Types by the size of a value in bytes."""

MOST_CRASHES: Final = 20
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
        eds: the file that says it.
        source: the bus, as the user named it.
        on_result: called with each result when it is there.
    """

    def __init__(  # noqa: PLR0913 - a run, by keyword
        self,
        link: StampedLink,
        node_id: int,
        plan: Plan,
        *,
        device: EdsDevice | None = None,
        eds: EdsFile | None = None,
        source: str = "",
        on_result: Callable[[Result], object] = lambda result: None,
    ) -> None:
        self._node_id, self._plan, self._source = node_id, plan, source
        self._device, self._eds, self._on_result = device, eds, on_result
        self._permission = Permission(plan.level, plan.allow, node_id, plan.confirm, plan.never)
        self._exchange = Exchange(
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
        self._stray = StrayHeartbeat(self._exchange, node_id)
        more = partial(play_object_step, self._client)
        player = Player(self._exchange, node_id, plan.stimulus, more)
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
        if len(self._crashes) < MOST_CRASHES:
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
        self._exchange.begin(min(EXAMINE_US, self._longest_us))
        self._exchange.wait(LISTEN_MS)
        self._stray.hear()
        self._permission.others = frozenset(self._exchange.others)
        self._exchange.end_listening()
        try:
            self._examine()
        except (SdoFailed, StepFailed, Disturbed) as error:
            return self._give_up(error)
        assert self._subject is not None
        checks = [*suite_checks(), *self._object_checks()]
        self._judge_all([check for check in checks if self._plan.chooses(check)])
        return ""

    def _give_up(self, error: Exception) -> str:
        """Judge nothing; return why, where no node, or more than one, has the node-ID."""
        presence = self._exchange.presence
        crashed = next(iter(self._crashes), "")
        if crashed or presence is Presence.ONE:
            self._block(suite_checks(), crashed or str(error))
            return ""
        self._absent = True
        if presence is Presence.NONE:
            verdict, reason = Verdict.BLOCKED, self._nobody()
        else:
            reason = f"each request is answered twice: two nodes have ID {self._node_id}?"
            verdict = Verdict.INCONCLUSIVE
        self._block(suite_checks(), reason, verdict)
        return reason

    def _nobody(self) -> str:
        heard = ", ".join(map(str, sorted(self._exchange.others - {0}))) or "nobody"
        return f"node {self._node_id} does not answer; heard here: {heard}"

    def _examine(self) -> None:
        self._subject = examine(
            *(self._client, self._node_id, self._plan),
            *(self._device, self._eds, self._exchange.others),
        )
        if self._exchange.presence is Presence.TWO:
            raise Disturbed("two nodes answer")
        self._exchange.played = self._subject.names.peer
        if self._stray.stamps:
            self._stray.compare(self._client.number(*HEARTBEAT))
        self._care.prepare(self._subject.restorable(self._plan.level))

    def _object_checks(self) -> list[Check]:
        """Make the checks of each object of the EDS; without one there are none."""
        if self._device is None:
            return []
        plan = self._plan
        checks = [*object_checks(self._device, self._node_id, allow=plan.allow, never=plan.never)]
        if self._plan.seed:
            Random(self._plan.seed).shuffle(checks)
        return checks

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

    def _block(self, checks: list[Check], reason: str, verdict: Verdict = Verdict.BLOCKED) -> None:
        for check in checks:
            if self._plan.chooses(check):
                self._keep(Result(check, Outcome(verdict, reason)))

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
            settings=describe_settings(self._plan, self._exchange.others),
            findings=findings,
            unrestored=(*self._care.unrestored, *gone),
            repairs=repairs,
            duration_us=self._exchange.now_us - self._exchange.start_us,
            aborted=aborted,
            absent=self._absent,
            doubt=other_device(self._device, subject.about) if subject else "",
        )


def _typed(data: bytes) -> str:
    """Write a value as `canmon net write` takes it."""
    if kind := INTEGERS.get(len(data)):
        return f"{kind}:0x{int.from_bytes(data, 'little'):X}"
    return f"hex:{data.hex().upper()}"
