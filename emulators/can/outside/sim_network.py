"""The canopen library as master of a rig in virtual time, without its notifier thread."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterable, Mapping
from types import FunctionType
from typing import Final

import canopen
import canopen.network
from canopen.sdo.client import BlockUploadStream

from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.can.outside.host import CanHost, Repeat
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_waits import EPOCH_S, SimCondition, SimQueue, SimQueues, SimTime
from tickrig.host.links.can_link import to_message
from tickrig.wire.can import STANDARD_MAX, CanFrame

# Run a library's classes on another clock, without changing the library.
#
# A function looks up `time` among the global names of its module. A copy of the function with
# other global names is the same code on another clock. `retime` gives one object its own class
# with such copies. Other objects of the original class, and everything else in the process, are
# unchanged.

_Names = Mapping[str, object]
"""Global names of a module, and their replacements."""


def retime(target: object, names: _Names, library: str) -> None:
    """Replace global names, such as a clock function, in the methods of an object.

    With a virtual clock as the replacement, a library runs in virtual time. Only methods of the
    library's own classes are changed. If a subclass outside the library has methods that read the
    clock, these methods read the real clock.

    Args:
        target: the object, whose class must not have slots.
        names: replacements of the global names.
        library: name of the package whose classes are changed.
    """
    cls = type(target)
    if (other := retimed(cls, names, library)) is not cls:
        target.__class__ = other


def retimed(cls: type, names: _Names, library: str) -> type:
    """Return a subclass of `cls` for `retime`, in whose methods global names are replaced.

    For example, the methods then call another clock function. If no method of `cls` uses one of the
    names, return `cls` itself. The arguments are those of `retime`.
    """
    members = {
        name: copied
        for name, (owner, member) in _members(cls).items()
        if owner.__module__.partition(".")[0] == library
        and (copied := _copy(member, names)) is not None
    }
    return type(cls.__name__, (cls,), {"__module__": cls.__module__, **members}) if members else cls


def _members(cls: type) -> dict[str, tuple[type, object]]:
    """Return the value of each name in a class, and the base that defines it."""
    found: dict[str, tuple[type, object]] = {}
    for base in cls.__mro__:
        for name, member in vars(base).items():
            found.setdefault(name, (base, member))
    return found


def _copy(member: object, names: _Names) -> object | None:
    """Return a copy of a function or property that uses one of the names, or None."""
    if isinstance(member, FunctionType):
        return _copy_function(member, names) if _uses(member, names) else None
    if isinstance(member, property):
        parts = (member.fget, member.fset, member.fdel)
        copies = [_copy(part, names) for part in parts]
        if any(copies):
            return property(*(c or p for c, p in zip(copies, parts, strict=True)))  # type: ignore[arg-type]  # copies of functions
    return None


def _uses(function: FunctionType, names: _Names) -> bool:
    return not names.keys().isdisjoint(function.__code__.co_names)


def _copy_function(function: FunctionType, names: _Names) -> FunctionType:
    copied = FunctionType(
        function.__code__,
        {**function.__globals__, **names},
        function.__name__,
        function.__defaults__,
        function.__closure__,
    )
    copied.__kwdefaults__ = function.__kwdefaults__
    return copied


_LIBRARY: Final = "canopen"

_Callback = Callable[[int, bytearray, float], None]
_Data = bytes | bytearray | Iterable[int] | None


class SimNetwork(canopen.Network):
    """A `canopen.Network` on a rig: every wait advances the virtual time.

    Nodes, SDO clients, PDOs, NMT, EMCY, LSS and p402 are the library's own code, run on the rig's
    clock. So time-outs are exact, and every run is the same. When an object of the library is added
    to this network, its conditions and queues are replaced, and its methods use the rig's `time`.
    Nothing else is changed.

    Callbacks run while any code advances the time. Your own classes are not changed. If they call
    the real `time`, call `run_for` or `sleep` instead.

    Args:
        rig: the rig.
        end: end of a bus of the rig, without a station.

    Attributes:
        host: the host's link, for single frames.
        clock: the library's `time` on this network.
    """

    def __init__(self, rig: Rig, end: CanEnd) -> None:
        self.host = CanHost(rig, end)
        self.clock = SimTime(self)
        self._names: dict[str, object] = {"time": self.clock, "queue": SimQueues(self)}
        self._names["BlockUploadStream"] = retimed(BlockUploadStream, dict(self._names), _LIBRARY)
        self._adopted: dict[int, object] = {}
        self._waits = 0
        super().__init__()
        self._adopt(self.time)
        rig.watchers.append(self._hear)
        rig.hosts.append(end)
        self._rig, self._end = rig, end

    @property
    def time_s(self) -> float:
        """Seconds since 1970 on the library's clock."""
        return EPOCH_S + self.host.now_us / 1e6

    def connect(self, *args: object, **kwargs: object) -> SimNetwork:
        """Return the network itself, which is connected from the start."""
        return self

    def disconnect(self) -> None:
        """Close the link; the rig is unchanged."""
        super().disconnect()
        if self._hear in self._rig.watchers:
            self._rig.watchers.remove(self._hear)
            self._rig.hosts.remove(self._end)
        self.host.close()

    def run_for(self, duration_us: int) -> None:
        """Advance the time, and deliver the frames that arrive."""
        self._wait_until(lambda: False, self.host.now_us + duration_us)
        self._rig.host_limit.restart(self.host.now_us)

    def wait(self, done: Callable[[], bool], timeout_s: float | None) -> bool:
        """Advance the time until `done()` is true; return False after the timeout."""
        timeout_us = None if timeout_s is None else round(timeout_s * 1e6)
        return self._wait_until(done, None if timeout_us is None else self.host.now_us + timeout_us)

    def _wait_until(self, done: Callable[[], bool], deadline_us: int | None) -> bool:
        self._waits += 1
        begun_us, more = self.host.now_us, False
        try:
            while not done():
                left_us = None if deadline_us is None else deadline_us - self.host.now_us
                taken = self.host.take(left_us, more=more)
                if taken is None:
                    return done()
                self._deliver(*taken)
                more = deadline_us is not None and self.host.now_us > begun_us
        finally:
            self._waits -= 1
        return True

    def _hear(self, now_us: int) -> None:
        """Deliver the frames that arrived while other code advanced the time."""
        if not self._waits:
            while (taken := self.host.take(0)) is not None:
                self._deliver(*taken)

    def _deliver(self, at_us: int, frame: CanFrame) -> None:
        message = to_message(frame, EPOCH_S * 1_000_000 + at_us)
        for listener in tuple(self.listeners):
            listener.on_message_received(message)  # type: ignore[no-untyped-call]  # canopen's

    def send_message(self, can_id: int, data: _Data, remote: bool = False) -> None:
        """Send a frame; no time passes."""
        self.host.send((_frame(can_id, data, remote=remote),))

    def send_periodic(
        self, can_id: int, data: _Data, period: float, remote: bool = False
    ) -> _SimPeriodic:
        """Send a frame each `period` seconds while time passes."""
        frame = _frame(can_id, data, remote=remote)
        return _SimPeriodic(self.host.repeat((frame,), round(period * 1e6)))

    def subscribe(self, can_id: int, callback: _Callback) -> None:
        """Subscribe to a CAN-ID, and make the callback's object use the rig's clock."""
        self._adopt(getattr(callback, "__self__", None))
        super().subscribe(can_id, callback)

    def __setitem__(self, node_id: int, node: canopen.RemoteNode | canopen.LocalNode) -> None:
        """Add a node, and put all its parts on the rig's clock."""
        super().__setitem__(node_id, node)
        self._adopt(node)
        for pdos in (node.tpdo, node.rpdo):
            for pdo in (pdos.map or {}).values():
                self._adopt(pdo)

    def _adopt(self, target: object) -> None:
        """Replace the conditions and queues of a library object, if not yet replaced."""
        bases = {base.__module__.partition(".")[0] for base in type(target).__mro__}
        if _LIBRARY not in bases or id(target) in self._adopted:
            return
        self._adopted[id(target)] = target
        for name, value in tuple(vars(target).items()):
            if type(value) is threading.Condition:
                setattr(target, name, SimCondition(self))
            elif type(value) is queue.Queue:
                setattr(target, name, SimQueue(self))
        retime(target, self._names, _LIBRARY)


class _SimPeriodic(canopen.network.PeriodicMessageTask):
    """A frame that the library sends periodically."""

    def __init__(self, repeat: Repeat) -> None:
        self._repeat = repeat

    def stop(self) -> None:
        """Stop sending the frame."""
        self._repeat.stop()

    def update(self, data: _Data) -> None:
        """Send other data from the next period on."""
        (frame,) = self._repeat.frames
        self._repeat.frames = (frame._replace(data=bytes(data or ())),)


def _frame(can_id: int, data: _Data, *, remote: bool) -> CanFrame:
    payload = bytes(data or ())
    extended = can_id > STANDARD_MAX
    if remote:
        return CanFrame(can_id, b"", True, extended, len(payload))
    return CanFrame(can_id, payload, extended=extended).checked()
