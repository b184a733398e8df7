"""A bench in real time: the rig runs in its own thread, hosts are at ptys and buses."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from queue import Empty
from typing import Any, Final, NoReturn, Self, TypeVar

from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.bench.running_emulator import RunningEmulator, keeping_time
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.errors import BenchError, NotOnThisBench
from tickrig.emulators.testing.bench.modes.door_watch import CpuWaits, HostPace, too_slow
from tickrig.emulators.testing.bench.modes.doors import Doors, OutsideEnds
from tickrig.emulators.testing.bench.modes.mode import EmulatedMode
from tickrig.emulators.testing.bench.mounts import LineMount, Mount
from tickrig.emulators.testing.rig_file.plan import RealPlan, Tolerances
from tickrig.host.control.clock import ServingClock
from tickrig.host.control.requests import RequestDispatcher
from tickrig.host.control.server import ControlServer
from tickrig.host.links.ready import WaitingQueue
from tickrig.host.text.trace import Mark

# A rig in real time, in its own thread, with calls from other threads.

_T = TypeVar("_T")

_JOIN_S: Final = 10.0
"""Time after which a step counts as stuck."""


class _RigThread:
    """Runs an emulator, and executes calls of other threads between two of its ticks.

    Before `start` and after the end of the thread the time stands still, and callers execute calls
    themselves. An exception of a device ends the thread. It is raised once: in the next caller or
    in `stop`.

    Args:
        emulator: the emulator.
        clock: clock of the emulator, which waits in this thread.
    """

    def __init__(self, emulator: RunningEmulator, clock: ServingClock) -> None:
        self._emulator, self._calls = emulator, WaitingQueue[Callable[[], None]]()
        self._lock, self._awaited = threading.Lock(), set[Future[Any]]()
        self._thread: threading.Thread | None = None
        self._error: BaseException | None = None
        self._stopping = self._ended = False
        clock.serve = self._serve

    @property
    def here(self) -> bool:
        """Whether the caller is in this thread."""
        return threading.current_thread() is self._thread

    @property
    def running(self) -> bool:
        """Whether time passes."""
        return self._thread is not None and not self._ended

    def start(self) -> None:
        """Start the time; only the first call has an effect."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="tickrig bench", daemon=True)
            self._thread.start()

    def call(self, do: Callable[[], _T]) -> _T:
        """Run a function between two ticks; return its result, or raise its exception."""
        if not self.here and (future := self._await()):
            self._calls.put(partial(_settle, future, do))
            result: _T = self._result(future)
            return result
        return do()

    def wait_until(self, done: Callable[[], bool], until_us: int) -> bool:
        """Wait in real time until a condition is true, which is checked after each step of the rig.

        Args:
            done: function that is called in the thread of the rig. An exception of the function is
                raised in the thread of the caller.
            until_us: time of the rig in microseconds. The first step at or after this time is the
                last step.

        Returns:
            True if the condition is true, or False after the time-out.

        Raises:
            BenchError: the bench is closed, or the caller is in the thread of the rig.
        """
        if self.here:
            raise BenchError("what is asked between two ticks cannot wait: no time passes there")
        if (future := self._await()) is None:
            raise BenchError("the bench is closed: no time passes")
        self._calls.put(partial(self._watch, future, done, until_us))
        return bool(self._result(future))

    def stop(self) -> None:
        """Stop the time."""
        if self._thread is not None:
            self._calls.put(self._note_stop)
            self._thread.join(_JOIN_S)
            if self._thread.is_alive():
                raise BenchError(f"a step of the rig has not ended for {_JOIN_S:g} s")
        self._raise_error()

    def _await(self) -> Future[Any] | None:
        """Return a future that this thread will resolve, or None if time stands still."""
        with self._lock:
            if self.running:
                future: Future[Any] = Future()
                self._awaited.add(future)
                return future
        self._raise_error()
        return None

    def _result(self, future: Future[_T]) -> _T:
        try:
            if (error := future.exception()) is not None:
                raise error  # without the frames of `result`
            return future.result()
        finally:
            self._awaited.discard(future)

    def _raise_error(self) -> None:
        error, self._error = self._error, None
        if error is not None:
            raise error

    def _watch(self, future: Future[bool], done: Callable[[], bool], until_us: int) -> None:
        """Check a condition now and after each step, until there is an answer."""
        rig = self._emulator.rig

        def look(now_us: int) -> None:
            try:
                answer = True if done() else False if now_us >= until_us else None
            except BaseException as error:
                future.set_exception(error)
            else:
                if answer is None:
                    return
                future.set_result(answer)
            rig.watchers.remove(look)

        rig.watchers.append(look)
        look(rig.now_us)

    def _run(self) -> None:
        try:
            while not self._stopping:
                self._emulator.step()
        except BaseException as error:
            self._error = error
        with self._lock:
            self._ended = True
        for future in tuple(self._awaited):
            if not future.done():
                future.set_exception(self._error or BenchError("the bench was closed"))
                self._error = None

    def _serve(self, wait_us: int) -> None:
        """Execute one requested call, if there is one within a time."""
        with suppress(Empty):
            self._calls.get(wait_us / 1e6)()

    def _note_stop(self) -> None:
        self._stopping = True


def _settle(future: Future[_T], do: Callable[[], _T]) -> None:
    """Set a future to the result of a function."""
    try:
        future.set_result(do())
    except BaseException as error:
        future.set_exception(error)


# The control socket of a bench, in its own thread.

_LOOK_US: Final = 100_000
"""Period at which the thread checks whether to stop."""

_Call = Callable[[Callable[[], bytes]], bytes]
"""Runs a function between two ticks."""


class _ControlThread:
    """Serves a control socket, and answers each request between two ticks of the rig.

    Args:
        path: path of the socket.
        control: object that answers requests.
        call: function that runs a function between two ticks.

    Raises:
        OSError: the socket cannot be made.
    """

    def __init__(self, path: Path, control: EmulatorControl, call: _Call) -> None:
        self._server = ControlServer(path, _Answers(control, call))
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="tickrig control", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Close the connections, and remove the socket."""
        self._closing = True
        self._thread.join()
        self._server.close()

    def _run(self) -> None:
        while not self._closing:
            self._server.serve(_LOOK_US)


class _Answers(RequestDispatcher):
    """Forwards requests to another thread."""

    def __init__(self, control: EmulatorControl, call: _Call) -> None:
        super().__init__({})
        self._control, self._call = control, call

    def answer_line(self, line: bytes) -> bytes:
        return self._call(lambda: self._control.answer_line(line))


_IN_REAL_TIME: Final = Tolerances(stick_pct=0, time_us=100_000)


class HostInCondition(BaseException):
    """A condition that is checked between two ticks tried to wait for a device."""


class _Watch(HostPace):
    """Measures how late the host is, and keeps it out of the rig's thread."""

    def __init__(self, thread: _RigThread) -> None:
        super().__init__()
        self._thread = thread

    def used(self) -> None:
        if self._thread.here:
            raise HostInCondition


class RealMode(EmulatedMode):
    """Mode of a bench of emulated devices in real time.

    The time starts with the first connection of a host or the first wait.

    Args:
        rig: rig with the devices. It must use the clock and the bridges of the argument `outside`.
        outside: connections of the wires for hosts outside the rig, with a clock and bridges. The
            connections are closed at the end.
    """

    name = "real"

    def __init__(self, rig: BenchRig, outside: OutsideEnds) -> None:
        super().__init__(rig, _IN_REAL_TIME)
        self._clock, self._stack = outside.clock, ExitStack()
        self._begun = self._judging = False
        self._thread = _RigThread(rig, outside.clock)
        self._pace, self._waits = _Watch(self._thread), CpuWaits(spares_looker=True)
        self.doors = Doors(outside.places, lambda wire: self._pace, self._begin)
        rig.rig.watchers.append(self._waits.look)
        rig.ports = outside.ports
        self._watch_settings(outside)
        for close in (outside.close, self._thread.stop, self.doors.close):
            self._stack.callback(close)

    @classmethod
    def open(
        cls, mounts: Sequence[Mount], plan: RealPlan, rig_at: Callable[[OutsideEnds], BenchRig]
    ) -> Self:
        """Open the connections for hosts, and return a `RealMode` with these connections.

        Args:
            mounts: the wires with their devices.
            plan: settings of the rig file for real time.
            rig_at: function that makes the rig from the clock and the bridges of the connections.

        Raises:
            PortGone: a bus cannot be opened.
            OSError: no port is free, or a link or socket cannot be made.
        """
        outside = OutsideEnds(mounts, plan)
        with ExitStack() as undo:
            undo.callback(outside.close)
            mode = cls(rig_at(outside), outside)
            if plan.control is not None:
                server = _ControlThread(plan.control, mode._control, mode._thread.call)
                mode._stack.callback(server.close)
            undo.pop_all()
        return mode

    @property
    def now_us(self) -> int:
        """The time of the rig; the machine's clock interpolates it between two ticks."""
        rig = self._rig.rig
        if self._thread.here and rig.acting_us is not None:
            return rig.acting_us
        if not self._thread.running:
            return rig.now_us
        return min(self._clock.now_us, rig.now_us + self._tick_us)

    @property
    def _tick_us(self) -> int:
        return self._rig.state.assembly.tick_us

    def act(self, action: Callable[[BenchRig], _T]) -> _T:
        """Run a function on the rig between two ticks."""
        return self._thread.call(partial(action, self._rig))

    def run_for(self, duration_us: int) -> None:
        """Wait for a time."""
        self.wait_until(lambda: False, duration_us)

    def wait_until(self, done: Callable[[], bool], within_us: int) -> bool:
        """Wait in real time until a condition is true; return False after the time-out.

        The thread that runs the rig checks the condition between the ticks. If the function `done`
        itself waits for data of a device, it cannot run in this thread. Such a function is called
        in the thread of the caller instead, once per tick.

        Args:
            done: function that returns whether the condition is true.
            within_us: longest wait in microseconds.
        """
        if self._judging and self._thread.here:
            raise HostInCondition
        self._begin()
        until_us = self.now_us + within_us
        ask = partial(self._judge, done)
        try:
            if self._thread.wait_until(ask, until_us - self._tick_us):
                return True
            self._sleep_until(until_us)
            return self._thread.call(ask)
        except HostInCondition:
            return self._ask_until(done, until_us)

    def _judge(self, done: Callable[[], bool]) -> bool:
        """Check a condition in the thread of the rig, where the condition cannot wait."""
        self._judging = True
        try:
            return done()
        finally:
            self._judging = False

    def _ask_until(self, done: Callable[[], bool], until_us: int) -> bool:
        while not done():
            if self.now_us >= until_us:
                return False
            self.run_for(min(self._tick_us, until_us - self.now_us))
        return True

    def _sleep_until(self, until_us: int) -> None:
        while (left_us := until_us - self.now_us) > 0 and self._thread.running:
            with self._pace.waiting(left_us):
                time.sleep(left_us / 1e6)

    def _begin(self) -> None:
        """Start the time."""
        if not self._begun:
            self._begun = True
            self._stack.enter_context(keeping_time())
            self._thread.start()

    def too_slow(self) -> str:
        """Return a message if the bench was too slow to judge a failed test, otherwise ""."""
        rig, behind_us = self._rig.rig, 0
        if self._thread.running:
            behind_us = self._clock.now_us - rig.now_us - self._tick_us
            self._thread.call(lambda: self._waits.look(rig.now_us))
        return too_slow(
            host=max(self._pace.late_us, self._waits.worst_us),
            emulator=max(rig.worst_late_us, behind_us),
        )

    def fork(self) -> NoReturn:
        """Raise NotOnThisBench: connections to the outside cannot be copied."""
        raise NotOnThisBench("a twin goes on in virtual time: this bench is in real time")

    def close(self) -> None:
        """Release all resources; raise an exception of a device that was not raised before."""
        self._begun = True
        self._stack.close()

    def _watch_settings(self, outside: OutsideEnds) -> None:
        """Record each port setting of a host that differs from the device's setting."""
        for wire, ports in outside.ports.items():
            mount = self._rig.state.mounts[wire]
            assert isinstance(mount, LineMount)
            for port in ports:
                port.watch_setting(mount.settings.baud, partial(self._note_setting, wire))

    def _note_setting(self, wire: str, setting: str) -> None:
        text = f"the host has set its port to {setting}"
        self._rig.journal.add(self._rig.effective_us, Mark.PHYSICAL, text.encode(), wire)
