"""Scripts of frames to and from a node, and their execution."""

# Theory of operation.
#
# A script is a generator. It yields steps, receives the result of each, and returns its own result;
# errors are raised in it. It does not block: a `Dialogue` resumes it when an answer arrives or a
# time has passed.
#
# Late answers. An SDO answer names its object, but not its request. After a time-out, a late answer
# looks like the answer to the next request for the same object. Only the order helps: a server
# answers one request after the other, and CAN keeps the order of its answers. Therefore an answer
# that names an object also proves that no answer to an earlier request can follow. `Unanswered`
# keeps the objects whose requests may still be answered, in their order. Before the dialogue sends
# a request for one of them again, it reads another object, a fence (1000h, otherwise 1001h and so
# on), and waits for the answer. This works however late an answer is.
#
# Duplicate answers. CAN repeats a frame if its sender saw the last bit wrong. A request that is
# repeated in this way is answered twice. Such a copy is sent right after its original. Therefore
# the dialogue waits before it sends another request for the object that was answered last. It waits
# as long as that answer took, but at least `LEAST_COPY_US` and at most `MOST_COPY_US`.
#
# Answers that name another object. A dialogue ignores them by default. With `on_misnamed`, an
# answer that names another object ends the request if the right answer does not follow. The right
# answer may follow within `_MISNAMED_US` if no other request is open, otherwise until the time-out.
# Use `on_misnamed` only if no other client uses the server.
#
# What couples to what. `_unanswered` lasts as long as the dialogue, everything else as long as a
# step:
#
#   _step        what the script waits for; None between scripts
#   _expected    the object whose answer is awaited: that of the step, or a fence before it
#   _transfer    the object of the latest request, which an abort names
#   _answer      the latest answer; a segment that equals it is a copy: its toggle bit is the same
#   due_us       the time-out of the step, or the end of a pause, or of the wait for a copy
#
# `_expected` differs from the object of the step only while a fence is open. `clear` ends the
# scripts and keeps `_unanswered`: the requests stay open, no matter which script sent them.
#
# Where the numbers come from. CiA 301 gives no SDO time-out; 500 ms is our choice. A copy
# follows its original within the time of the repeated request, so the wait is bounded by the time
# that the answer took.

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, Final, NamedTuple, TypeVar

from tickrig.host.canopen import errors
from tickrig.wire.canopen import sdo, sdo_frame
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NMT_COB_ID, NmtCommand, NmtState
from tickrig.wire.errors import WireError
from tickrig.wire.instant import NEVER

SDO_TIMEOUT_US: Final = 500_000

LEAST_COPY_US: Final = 2_000
"""Longest delay of a copied answer: an error frame and the repeated frame at 125 kbit/s."""
_MOST_COPY_US: Final = 20_000
_MISNAMED_US: Final = 100_000
"""Longest time until the right answer follows an answer that names another object."""

Object = tuple[int, int]
"""Index and sub-index."""

_NONE_NAMED: Final = (0, 0)
"""The object that a server's abort names if the server could not parse the request."""

FENCES: Final[tuple[Object, ...]] = (
    *((index, 0) for index in (0x1000, 0x1001, 0x1018)),
    *((0x1018, sub) for sub in range(1, 5)),
    *((0x1000, sub) for sub in range(1, 0xFF)),
)
"""Objects that may be read at any time. Every server answers, at least with an abort."""


@dataclass(slots=True)  # not frozen: frozen requests take three times as long to create
class SdoRequest:
    """Step of a script that sends an SDO request and waits for the response, which is its result.

    SdoTimeout is raised if no response arrives.

    Attributes:
        goes_on: whether the request continues a transfer. Otherwise, the request starts a transfer.
    """

    request: bytes
    index: int
    sub: int
    goes_on: bool = False


@dataclass(frozen=True, slots=True)
class SdoFrame:
    """Step that sends an SDO frame without an answer."""

    request: bytes


@dataclass(frozen=True, slots=True)
class NmtRequest:
    """Step that sends an NMT command."""

    command: NmtCommand


@dataclass(frozen=True, slots=True)
class AwaitState:
    """Step of a script that waits until the node reports an NMT state by heartbeat or boot-up.

    StateTimeout is raised if the node does not report the state in time.
    """

    state: NmtState
    timeout_us: int


@dataclass(frozen=True, slots=True)
class AwaitReport:
    """Step of a script that waits until the node reports any NMT state.

    A heartbeat or a response to node guarding counts. The result is the reported state, or None
    after the time-out.

    Attributes:
        timeout_us: time to wait, in microseconds.
        boot_up: whether a boot-up message also counts.
    """

    timeout_us: int
    boot_up: bool = True


@dataclass(frozen=True, slots=True)
class Guard:
    """Step that requests the state by node guarding."""


@dataclass(frozen=True, slots=True)
class Pause:
    """Step that lets time pass."""

    duration_us: int


Step = SdoRequest | SdoFrame | NmtRequest | AwaitState | AwaitReport | Guard | Pause

T = TypeVar("T")

Script = Generator[Step, Any, T]
"""A script that returns a T. The script receives the result of each step, or None without one."""

Answer = sdo.Response | None

Failure = errors.SdoFailed | errors.StateTimeout | errors.WrongIdentity
Send = Callable[[int, bytes], None]


def nothing(*_: object) -> None:
    """Do nothing. This is the default for callbacks that a caller does not need."""


Misnamed = Callable[[Object, bytes], object]
"""Function that receives the requested object, and the answer that names another object."""


class QueuedScript(NamedTuple):
    """A script that waits to be run with a node, and the callbacks for its end.

    Attributes:
        what: description of the script for messages.
        done: function that is called with the result of the script.
        failed: function that is called with the error that the script raised.
        dropped: function that is called if the script is dropped before its end.
        moves: whether the script may change the NMT state of the node.
    """

    what: str
    script: Script[Any]
    done: Callable[[Any], None]
    failed: Callable[[Failure], None]
    dropped: Callable[[], None] = nothing
    moves: bool = True


class Unanswered(list[Object]):
    """Objects named in SDO requests that the server may still answer, in the order of the requests.

    With this list, a late answer to an earlier request is not taken for the answer to a later
    request. A repeated request counts once.
    """

    def add(self, at: Object) -> None:
        """Add the object of a request."""
        if self[-1:] != [at]:
            self.append(at)

    def hear(self, at: Object) -> None:
        """Forget the requests that were sent before the request that the server has just answered.

        The server will not answer the earlier requests any more.
        """
        if at in self:
            del self[: self.index(at)]

    def fence(self, at: Object) -> Object:
        """Return an object to read next, so that late answers about object `at` can be recognized.

        The server answers requests in their order. The host reads the returned object, and then
        sends the new request about `at`. So each answer about `at` that arrives before the answer
        to this read is a late answer to an earlier request.

        The result is an object of `FENCES`, but not `at`. If the latest request was for such an
        object, this object is returned again. Otherwise, the result is an object of `FENCES`
        without an unanswered request. If all objects of `FENCES` have unanswered requests, the
        oldest requests are forgotten until one object has none.
        """
        last = self[-1]
        if last in FENCES and last != at:
            return last
        while True:
            for fence in FENCES:
                if fence != at and fence not in self:
                    return fence
            del self[0]


class Dialogue:
    """The dialogue of a host with one node. The dialogue sends frames, and never blocks.

    Keep the dialogue as long as you communicate with the node, because only the dialogue knows
    which requests the server may still answer.

    Args:
        node_id: node-ID of the node.
        send: function that sends a data frame. Its arguments are CAN-ID and data.
        guard: function that sends a remote frame. Its argument is the CAN-ID.
        sdo_timeout_us: time to wait for an SDO response.
        on_misnamed: function that is called with each answer that ends a request and names another
            object. None ignores such answers.

    Attributes:
        sdo_timeout_us: time to wait for an SDO response. A new value takes effect with the next
            request.
        due_us: end of the running time-out or pause, or `NEVER` if there is none.
        job: job that is running.
    """

    def __init__(
        self,
        node_id: int,
        send: Send,
        guard: Callable[[int], None] = nothing,
        sdo_timeout_us: int = SDO_TIMEOUT_US,
        on_misnamed: Misnamed | None = None,
    ) -> None:
        self._on_misnamed = on_misnamed
        self._node_id, self._send, self._guard = node_id, send, guard
        self.sdo_timeout_us = sdo_timeout_us
        self._now_us, self.due_us = 0, NEVER
        self.job: QueuedScript | None = None
        self._step: Step | None = None
        self._jobs: deque[QueuedScript] = deque()
        self._unanswered = Unanswered()
        self._transfer: Object | None = None
        self._expected: Object | None = None  # the object whose answer is awaited, also for a fence
        self._sent_us = self._settled_us = 0
        self._answer = self._misnamed = b""

    @property
    def moves(self) -> bool:
        """Whether a running job may change the NMT state of the node."""
        return self.job is not None and any(job.moves for job in (self.job, *self._jobs))

    def start(self, now_us: int, job: QueuedScript) -> None:
        """Run a job after all earlier jobs have ended."""
        self._now_us = now_us
        if self.job is None and not self._jobs:
            self.job = job
            self._go_on(None)
            return
        self._jobs.append(job)
        if self.job is None:
            self._next()

    def defer(self, span_us: int) -> None:
        """Extend the running step by this time, during which nothing was received."""
        if self.due_us < NEVER:
            self.due_us += span_us

    def clear(self) -> None:
        """Drop all jobs."""
        if self.job is None:
            return
        dropped = [self.job, *self._jobs]
        self._jobs.clear()
        self.job, self._step, self._expected, self.due_us = None, None, None, NEVER
        for job in dropped:
            job.script.close()
            job.dropped()

    def abort(self, code: sdo_frame.AbortCode) -> None:
        """Drop all jobs. Abort the running SDO transfer, if there is one."""
        if self.job is not None and self._transfer is not None:
            self._say(sdo.Abort(*self._transfer, code).encode())
        self.clear()

    def remember(self, at: Object) -> None:
        """Record that another client's request about an object got no answer from the server."""
        self._unanswered.add(at)

    def receive_sdo(self, now_us: int, data: bytes) -> None:
        """Process a response. Ignore copies, and answers to other requests."""
        self._now_us = now_us
        try:
            answer = sdo.parse_response(data)
        except WireError:
            return
        named = (answer.index, answer.sub) if isinstance(answer, _NAMING) else None
        if named is not None and self._unanswered[:1] != [named]:
            self._unanswered.hear(named)
        step = self._step
        if not isinstance(step, SdoRequest) or self._expected is None:
            return
        if self._expected != (step.index, step.sub):
            if named == self._expected:
                self._pass_fence(step, answer)
            else:
                self._keep_misnamed(now_us, named, data)
        elif (named == self._expected != _NONE_NAMED and not step.goes_on) or self._is_answer(
            step, answer, named, data
        ):
            self._unanswered.clear()
            took_us = max(LEAST_COPY_US, now_us - self._sent_us)
            self._answer, self._settled_us = data, now_us + min(took_us, _MOST_COPY_US)
            self._go_on(answer)
        else:
            self._keep_misnamed(now_us, named, data)

    def _keep_misnamed(self, now_us: int, named: Object | None, data: bytes) -> None:
        """Keep an answer that names another object.

        The answer is used unless the right one follows.
        """
        if self._on_misnamed is None or named is None or named in self._unanswered:
            return
        self._misnamed = data
        if len(self._unanswered) == 1:
            self.due_us = min(self.due_us, now_us + _MISNAMED_US)

    def _end_misnamed(self, step: SdoRequest) -> sdo.Abort | errors.SdoMisnamed:
        """Return the error for an answer that names another object than the request.

        An abort ends the only open transfer, no matter which object the abort names. A value may
        belong to another object.
        """
        at, data, alone = (step.index, step.sub), self._misnamed, len(self._unanswered) == 1
        self._unanswered.clear()
        if self._on_misnamed is not None:
            self._on_misnamed(self._expected or at, data)
        answer = sdo.parse_response(data)
        if isinstance(answer, sdo.Abort) and alone:
            return sdo.Abort(*at, answer.code)
        self._say(sdo.Abort(*at, sdo_frame.AbortCode.GENERAL).encode())
        return errors.SdoMisnamed(*at)

    def _is_answer(
        self, step: SdoRequest, answer: sdo.Response, named: Object | None, data: bytes
    ) -> bool:
        """Return whether a response can only be the answer to a step.

        A segment and an abort of 0000h:00 name no object. While other requests are open, such a
        response may be an answer to one of those requests.
        """
        if named is not None and named != _NONE_NAMED:
            mine = named == (step.index, step.sub)
        else:
            mine = len(self._unanswered) == 1
        may_repeat = isinstance(answer, sdo_frame.BlockAcknowledge)
        return mine and (may_repeat or not step.goes_on or data != self._answer)

    def _pass_fence(self, step: SdoRequest, fence: sdo.Response) -> None:
        """Send the request of the script after all earlier requests are settled."""
        if isinstance(fence, sdo.UploadInitiateResponse) and fence.data is None:
            self._say(sdo.Abort(fence.index, fence.sub, sdo_frame.AbortCode.GENERAL).encode())
        self._send_request((step.index, step.sub), step.request)

    def receive_state(self, now_us: int, state: NmtState) -> None:
        """Process a heartbeat or a boot-up."""
        self._now_us = now_us
        match self._step:
            case AwaitState() as wait if wait.state is state:
                self._go_on(None)
            case AwaitReport() as wait if wait.boot_up or state is not NmtState.INITIALISING:
                self._go_on(state)
            case _:
                pass

    def tick(self, now_us: int) -> None:
        """End the steps that have timed out."""
        self._now_us = now_us
        if now_us < self.due_us:
            return
        match self._step:
            case SdoRequest() as step:
                if self._expected is None:
                    self._send_request((step.index, step.sub), step.request)
                    return
                if self._misnamed:
                    self._go_on(self._end_misnamed(step))
                    return
                self._say(sdo.Abort(*self._expected, sdo_frame.AbortCode.TIMEOUT).encode())
                self._go_on(errors.SdoTimeout(step.index, step.sub, self.sdo_timeout_us))
            case AwaitState() as wait:
                self._go_on(errors.StateTimeout(f"{wait.state.name} was not reported"))
            case _:
                self._go_on(None)

    def _next(self) -> None:
        self.job = self._jobs.popleft()
        self._go_on(None)

    def _go_on(self, value: object) -> None:
        """Resume a script with the result of its step. Run its steps up to a step that waits."""
        job = self.job
        assert job is not None
        self._step, self._expected, self.due_us = None, None, NEVER
        try:
            script = job.script
            step = script.throw(value) if isinstance(value, Exception) else script.send(value)
            while not isinstance(step, SdoRequest):
                if self._take(step):
                    return
                step = script.send(None)
            self._request(step)
        except StopIteration as end:
            self._end(job.done, end.value)
        except (errors.SdoFailed, errors.StateTimeout, errors.WrongIdentity) as error:
            self._end(job.failed, error)

    def _end(self, callback: Callable[[Any], None], what: object) -> None:
        """End a job and call back. Start the next job unless the callback did."""
        self.job = None
        callback(what)
        if self._jobs and self.job is None:
            self._next()

    def _take(self, step: Step) -> bool:
        """Process a step that is not an SDO request. Return True if the step waits."""
        match step:
            case AwaitState() | AwaitReport():
                self._step, self.due_us = step, self._now_us + step.timeout_us
            case Pause():
                self._step, self.due_us = step, self._now_us + step.duration_us
            case SdoFrame():
                self._say(step.request)
                if self._transfer is not None and step.request[0] == sdo_frame.ClientCommand.ABORT:
                    self._unanswered.add(self._transfer)
            case Guard():
                self._guard(ERROR_CONTROL_COB_ID + self._node_id)
            case NmtRequest():
                self._send(NMT_COB_ID, bytes((step.command, self._node_id)))
        return self._step is not None

    def _request(self, step: SdoRequest) -> None:
        """Send the request of a step. If necessary, send a fence or wait before the request."""
        at = step.index, step.sub
        self._step = step
        if not step.goes_on and at in self._unanswered:
            fence = self._unanswered.fence(at)
            self._send_request(fence, sdo.UploadInitiateRequest(*fence).encode())
        elif not step.goes_on and at == self._transfer and self._now_us < self._settled_us:
            self.due_us = self._settled_us
        else:
            self._send_request(at, step.request)

    def _send_request(self, at: Object, request: bytes) -> None:
        self._transfer = self._expected = at
        self._misnamed = b""
        self._unanswered.add(at)
        self._send(sdo_frame.REQUEST_COB_ID + self._node_id, request)
        self._sent_us, self.due_us = self._now_us, self._now_us + self.sdo_timeout_us

    def _say(self, data: bytes) -> None:
        self._send(sdo_frame.REQUEST_COB_ID + self._node_id, data)


_NAMING: Final = (
    sdo.UploadInitiateResponse,
    sdo.DownloadInitiateResponse,
    sdo.Abort,
    sdo_frame.BlockDownloadInitiateResponse,
    sdo_frame.BlockUploadInitiateResponse,
)
"""Responses that name an object. The most frequent response is first."""
