"""Requests to a running emulator (docs/reference/bench/control.md)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Final, Protocol

from tickrig.emulators.bench.operator import PRESS_US, Operator, WireFaults, parse_fault_spec
from tickrig.emulators.bench.running_emulator import RunningEmulator
from tickrig.emulators.rig.emulated import HasSignals, read_signal
from tickrig.emulators.rig.faults import FaultForm, usage
from tickrig.host.control.requests import Object, RequestDispatcher, short, text_of, whole
from tickrig.host.text.byte_text import escape
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting

if TYPE_CHECKING:
    from concurrent.futures import Future

_MAX_LINES: Final = 100
_MAX_PRESS_US: Final = 10**15
_MAX_SINCE: Final = 2**63 - 1
"""Longest duration, as on a command line."""


class _Controlled(Protocol):
    """The target of requests: a `RunningEmulator`, or an object without a wire.

    Attributes:
        name: name of the target.
        operator: operator that executes the actions.
    """

    name: str
    operator: Operator

    @property
    def device(self) -> HasSignals:
        """The inputs and outputs of the target."""
        ...

    @property
    def wire(self) -> WireFaults:
        """The wire on which faults are armed."""
        ...

    @property
    def effective_us(self) -> int:
        """The time at which an action takes effect."""
        ...

    def status(self) -> Mapping[str, object]:
        """Return the status of the target."""
        ...

    @property
    def stop(self) -> Callable[[], None]:
        """End the emulator."""
        ...


class EmulatorControl(RequestDispatcher):
    """Executes the requests of a control socket at one emulator, such as "set" or "fault".

    Args:
        emulator: the controlled emulator. No other code may step the emulator while a request is
            answered. The request "lines", which shows the traffic on the wire, is available only if
            the emulator is a `RunningEmulator`.
    """

    def __init__(self, emulator: _Controlled) -> None:
        self._emulator = emulator
        self._running = emulator if isinstance(emulator, RunningEmulator) else None
        shows_lines = {"lines": (self._lines, ("since",))} if self._running else {}
        super().__init__(
            {
                "describe": (self._describe, ()),
                "get": (self._get, ("names",)),
                "set": (self._set, ("name", "value")),
                "press": (self._press, ("name", "duration_us")),
                "fault": (self._fault, ("spec",)),
                "clear": (self._clear, ("name",)),
                "faults": (self._faults, ()),
                **shows_lines,
                "status": (self._status, ("since",)),
                "stop": (self._stop, ()),
            }
        )

    def _describe(self, request: Object) -> Object:
        emulator, device = self._emulator, self._emulator.device
        return {
            "device": emulator.name,
            "tick_us": device.tick_us,
            "inputs": [
                {
                    **{"name": item.name, "text": item.text, "kind": item.type.value},
                    **{"low": item.low, "high": item.high, "unit": item.unit},
                    **({"counts": list(item.counts)} if item.counts else {}),
                }
                for item in device.inputs.table.values()
            ],
            "groups": {name: list(members) for name, members in device.inputs.groups.items()},
            "outputs": [
                {"name": item.name, "text": item.text, "unit": item.unit}
                for item in device.outputs.values()
            ],
            "wire_faults": [
                {
                    **{"name": name, "text": kind.text, "rated": kind.rated},
                    **{"usage": usage(name, kind), "arguments": _arguments(kind)},
                }
                for name, kind in emulator.wire.fault_types.items()
            ],
        }

    def _get(self, request: Object) -> Object:
        device = self._emulator.device
        names = request.get("names")  # no list of all: a CANopen node has hundreds of objects
        if "names" not in request:
            names = [*device.inputs.table, *device.outputs]
        if not isinstance(names, list):
            raise ValueError(f"names is a list of names, not {short(names)}")
        for name in names:
            if not isinstance(name, str) or not (
                name in device.inputs.table or name in device.outputs
            ):
                if members := device.inputs.groups.get(str(name)):
                    raise ValueError(f"{name} can only be set; read {', '.join(members)}")
                hint = near(str(name), [*device.outputs, *device.inputs.table])
                raise ValueError(f"no input or output {short(name)}; {hint}")
        return {"values": {name: read_signal(device, name) for name in names}}

    def _set(self, request: Object) -> Object:
        name, value = text_of(request, "name"), request.get("value")
        values = value if isinstance(value, list) else [value]
        device = self._emulator.device
        if name in device.outputs and name not in device.inputs.table:
            raise ValueError(f"{name} is an output: it can be read, not set")
        self._emulator.operator.set(name, *[_setting(item) for item in values])
        return {}

    def _press(self, request: Object) -> Object:
        duration_us = whole(request.get("duration_us", PRESS_US), "duration_us", 1, _MAX_PRESS_US)
        emulator = self._emulator
        emulator.operator.press(emulator.effective_us, text_of(request, "name"), duration_us)
        return {}

    def _fault(self, request: Object) -> Object:
        emulator = self._emulator
        check, now_us = emulator.operator.check_clear, emulator.effective_us
        emulator.operator.fault(now_us, parse_fault_spec(text_of(request, "spec"), check, now_us))
        return {}

    def _clear(self, request: Object) -> Object:
        self._emulator.operator.clear(text_of(request, "name"))
        return {}

    def _faults(self, request: Object) -> Object:
        rows = [row._asdict() for row in self._emulator.operator.fault_rows()]
        return {"faults": [{**row, "arguments": dict(row["arguments"])} for row in rows]}

    def _lines(self, request: Object) -> Object:
        since = whole(request.get("since", 0), "since", 0, _MAX_SINCE)
        assert self._running is not None
        return {
            "lines": [
                {"number": x.number, "at_us": x.at_us, "mark": x.mark, "text": escape(x.data)}
                for x in self._running.log.since(since)[-_MAX_LINES:]
            ]
        }

    def _status(self, request: Object) -> Object:
        status: Object = dict(self._emulator.status())
        if "since" in request:
            since_us = whole(request["since"], "since", 0, _MAX_SINCE)
            if self._running is not None:
                status["late_us"] = self._running.rig.late_since(since_us)
        return status

    def _stop(self, request: Object) -> Object:
        self._emulator.stop()
        return {}


def _arguments(form: FaultForm) -> list[dict[str, str]]:
    """Return the arguments of a fault, each with its default."""
    return [
        {"name": one.name, "text": one.text, "default": one.default, "range": one.range}
        for one in form.all_arguments
    ]


def _setting(value: object) -> Setting:
    if not isinstance(value, int | float | str) or isinstance(value, bool):
        raise ValueError(f"value is a number or a string, not {short(value)}")
    return value


# Requests to an emulator from another thread, served between its steps.


class EmulatorEnded(Exception):  # noqa: N818 - no error
    """The emulator has ended and no longer answers."""


class RequestInbox:
    """Queue for control requests from any thread, which the emulator's own thread answers.

    Args:
        control: object that answers the requests in the same way as requests of the control socket.
    """

    def __init__(self, control: EmulatorControl) -> None:
        self._control = control
        self._posted: SimpleQueue[tuple[Sequence[Object], Future[list[Object]]]] = SimpleQueue()
        self._closed = False

    def post(self, requests: Sequence[Object]) -> Future[list[Object]]:
        """Submit requests from any thread. The emulator answers them together, between two steps.

        Returns:
            A future with the answers. If the emulator ends before it answers, the future raises
            EmulatorEnded. The future is not cancelled in this case, because a cancelled future
            would also cancel the asyncio task that waits for it.
        """
        from concurrent.futures import Future  # noqa: PLC0415 - slow

        answers: Future[list[Object]] = Future()
        self._posted.put((requests, answers))
        if self._closed:
            self.serve()
        return answers

    def serve(self) -> None:
        """Answer the submitted requests, or refuse them after the end."""
        while True:
            try:
                requests, answers = self._posted.get_nowait()
            except Empty:
                return
            if not answers.set_running_or_notify_cancel():
                continue
            if self._closed:
                answers.set_exception(EmulatorEnded())
            else:
                answers.set_result([self._control.answer(request) for request in requests])

    def close(self) -> None:
        """Stop answering."""
        self._closed = True
        self.serve()
