"""Scripts, what is said to a node in the order in which it is said, and what runs them.

A script is a generator. It yields steps, is given what came of each, and returns
its result; what goes wrong is raised in it. It waits for nothing: a `Dialogue`
goes on with it when there is an answer, or when a time has passed.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, Final, TypeVar

from tickrig.host.canopen.errors import SdoFailed, SdoTimeout, StateTimeout, WrongIdentity
from tickrig.wire.canopen.nmt import (
    ERROR_CONTROL_COB_ID,
    NMT_COB_ID,
    NmtCommand,
    NmtState,
)
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.sdo import (
    Abort,
    DownloadInitiateResponse,
    Response,
    UploadInitiateResponse,
    parse_response,
)
from tickrig.wire.canopen.sdo.sdo_command import REQUEST_COB_ID
from tickrig.wire.errors import WireError
from tickrig.wire.instant import NEVER

SDO_TIMEOUT_US: Final = 500_000


@dataclass(frozen=True, slots=True)
class SdoRequest:
    """Send an SDO request; gives the response, raises SdoTimeout without one."""

    request: bytes
    index: int
    sub: int


@dataclass(frozen=True, slots=True)
class SdoFrame:
    """Send an SDO frame that has no answer."""

    request: bytes


@dataclass(frozen=True, slots=True)
class Command:
    """Send an NMT command."""

    command: NmtCommand


@dataclass(frozen=True, slots=True)
class AwaitState:
    """Wait until a heartbeat or boot-up says a state; raises StateTimeout."""

    state: NmtState
    timeout_us: int


@dataclass(frozen=True, slots=True)
class AwaitReport:
    """Wait for any heartbeat, or answer to guarding; gives its state, None without one.

    Attributes:
        timeout_us: how long to wait.
        boot_up: a boot-up counts as well.
    """

    timeout_us: int
    boot_up: bool = True


@dataclass(frozen=True, slots=True)
class Guard:
    """Ask for the state by node guarding."""


@dataclass(frozen=True, slots=True)
class Pause:
    """Let time pass."""

    duration_us: int


Step = SdoRequest | SdoFrame | Command | AwaitState | AwaitReport | Guard | Pause

T = TypeVar("T")

Script = Generator[Step, Any, T]
"""A script that returns a T; it is sent what its step gives, None if that gives nothing."""

Answer = Response | None

Failure = SdoFailed | StateTimeout | WrongIdentity
Send = Callable[[int, bytes], None]


def _nothing() -> None:
    """Tell nobody."""


def _guard_nobody(can_id: int) -> None:
    """Send no remote frame: this host guards no node."""


@dataclass(frozen=True, slots=True)
class QueuedScript:
    """A script, and who is told how it ended.

    Attributes:
        what: for people.
        done: called with its result.
        failed: called with what it raised.
        dropped: called if it is forgotten before its end.
        moves: it may change the NMT state of the node.
    """

    what: str
    script: Script[Any]
    done: Callable[[Any], None]
    failed: Callable[[Failure], None]
    dropped: Callable[[], None] = _nothing
    moves: bool = True


class Dialogue:
    """What is said with one node; it sends, and never waits.

    Args:
        node_id: the node.
        send: takes CAN-ID and data.
        guard: takes the CAN-ID of a remote frame.
        sdo_timeout_us: how long to wait for an SDO response.

    Attributes:
        due_us: when a time-out or a pause ends, `NEVER` if there is none.
        job: what is under way.
    """

    def __init__(
        self,
        node_id: int,
        send: Send,
        guard: Callable[[int], None] = _guard_nobody,
        sdo_timeout_us: int = SDO_TIMEOUT_US,
    ) -> None:
        self._node_id, self._send, self._guard = node_id, send, guard
        self._sdo_timeout_us = sdo_timeout_us
        self._now_us, self.due_us = 0, NEVER
        self.job: QueuedScript | None = None
        self._step: Step | None = None
        self._transfer: tuple[int, int] | None = None
        self._jobs: deque[QueuedScript] = deque()

    @property
    def moves(self) -> bool:
        """Whether something is under way that may change the NMT state of the node."""
        return self.job is not None and any(job.moves for job in (self.job, *self._jobs))

    def start(self, now_us: int, job: QueuedScript) -> None:
        """Run a job when those before it have ended."""
        self._now_us = now_us
        self._jobs.append(job)
        if self.job is None:
            self._next()

    def defer(self, span_us: int) -> None:
        """Let what is under way last so much longer: nobody listened for so long."""
        if self.due_us < NEVER:
            self.due_us += span_us

    def clear(self) -> None:
        """Forget all jobs."""
        dropped = [self.job, *self._jobs] if self.job is not None else []
        self._jobs.clear()
        self.job, self._step, self.due_us = None, None, NEVER
        for job in dropped:
            job.script.close()
            job.dropped()

    def abort(self, code: AbortCode) -> None:
        """Forget all jobs; the node is told that the transfer under way has ended, if one was."""
        if self.job is not None and self._transfer is not None:
            self._say(Abort(*self._transfer, code).encode())
        self.clear()

    def receive_sdo(self, now_us: int, data: bytes) -> None:
        """Take a response; one that nobody asked for, or too late, is passed over."""
        self._now_us = now_us
        if isinstance(self._step, SdoRequest):
            try:
                answer = parse_response(data)
            except WireError:
                return
            if _answers(self._step, answer):
                self._go_on(answer)

    def receive_state(self, now_us: int, state: NmtState) -> None:
        """Take what a heartbeat or a boot-up says."""
        self._now_us = now_us
        match self._step:
            case AwaitState() as wait if wait.state is state:
                self._go_on(None)
            case AwaitReport() as wait if wait.boot_up or state is not NmtState.INITIALISING:
                self._go_on(state)
            case _:
                pass

    def tick(self, now_us: int) -> None:
        """End what lasts too long."""
        self._now_us = now_us
        if now_us < self.due_us:
            return
        match self._step:
            case SdoRequest() as request:
                self._say(Abort(request.index, request.sub, AbortCode.TIMEOUT).encode())
                self._go_on(SdoTimeout(request.index, request.sub, self._sdo_timeout_us))
            case AwaitState() as wait:
                self._go_on(StateTimeout(f"{wait.state.name} was not reported"))
            case _:
                self._go_on(None)

    def _next(self) -> None:
        if self._jobs:
            self.job = self._jobs.popleft()
            self._go_on(None)

    def _go_on(self, value: object) -> None:
        """Give a script what came of its step, and take the steps up to one that waits."""
        job = self.job
        assert job is not None
        self._step, self.due_us = None, NEVER
        try:
            step = _resume(job.script, value)
            while not self._take(step):
                step = job.script.send(None)
        except StopIteration as end:
            self._end(job.done, end.value)
        except (SdoFailed, StateTimeout, WrongIdentity) as error:
            self._end(job.failed, error)

    def _end(self, callback: Callable[[Any], None], what: object) -> None:
        """End a job, tell how, and go on with the next unless that began one."""
        self.job = None
        callback(what)
        if self.job is None:
            self._next()

    def _take(self, step: Step) -> bool:
        """Take a step; True if it waits."""
        match step:
            case SdoRequest():
                self._transfer = step.index, step.sub
                self._say(step.request)
                self._step, self.due_us = step, self._now_us + self._sdo_timeout_us
            case AwaitState() | AwaitReport():
                self._step, self.due_us = step, self._now_us + step.timeout_us
            case Pause():
                self._step, self.due_us = step, self._now_us + step.duration_us
            case SdoFrame():
                self._say(step.request)
            case Guard():
                self._guard(ERROR_CONTROL_COB_ID + self._node_id)
            case Command():
                self._send(NMT_COB_ID, bytes((step.command, self._node_id)))
        return self._step is not None

    def _say(self, data: bytes) -> None:
        self._send(REQUEST_COB_ID + self._node_id, data)


def _answers(request: SdoRequest, answer: Response) -> bool:
    """Say whether a response is of the object that was asked for, as far as it says so.

    An abort of 0000h:00 is of whatever is under way: the server could not read the request.
    """
    match answer:
        case Abort(index=0, sub=0):
            return True
        case Abort() | DownloadInitiateResponse() | UploadInitiateResponse():
            return (answer.index, answer.sub) == (request.index, request.sub)
    return True


def _resume(script: Script[Any], value: object) -> Step:
    if isinstance(value, Exception):
        return script.throw(value)
    return script.send(value)
