"""An emulator that plays a real device, reached by its control socket for what hands do."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

from tickrig.device.physical import SignalType
from tickrig.emulators.bench.operator import FaultSpec
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.testing.bench.errors import MachineTooSlow, NotOnThisBench, PortGone
from tickrig.emulators.testing.bench.modes.emulated_mode import POWER
from tickrig.emulators.testing.rig_file.plan import DevicePlan
from tickrig.host.control.client import TIMEOUT_S, ControlClient, ControlRefused
from tickrig.host.control.requests import Object
from tickrig.host.text.names import known
from tickrig.host.text.values import Setting, format_time
from tickrig.wire.instant import NEVER

_NO_ANSWER_US: Final = round(TIMEOUT_S * 1e6)
"""How late an emulator is that does not answer."""

_OBJECT: Final = "0x"
"""So objects of a dictionary begin; they are new whenever the power comes."""


class EmulatorOperator:
    """`DeviceOperator` that ask the control socket of an emulator.

    Args:
        path: of its socket.
        plan: the device; an emulator of several has it under its name, or its node-ID.

    Raises:
        PortGone: nobody is there.
        MachineTooSlow: nobody answers.
        ValueError: the emulator has several devices, and none of this name.
    """

    said_no, quick = False, True

    def __init__(self, path: Path, plan: DevicePlan) -> None:
        self._path, self._lock = path, threading.RLock()
        try:
            self._client = ControlClient(path)
        except OSError as error:
            raise PortGone(f"{plan.name}: no emulator at {path}: {error.strerror}") from None
        described = self._request("describe")
        inputs, outputs, wire_faults = (
            _names_of(described, key) for key in ("inputs", "outputs", "wire_faults")
        )
        self._prefix, self._wire = _prefix_of(plan, inputs | outputs, path), plan.wire
        self._name = plan.name
        self._inputs, self._tick_us = inputs | wire_faults, int(str(described["tick_us"]))
        self._wire_faults = [name for name in wire_faults if self._is_of_wire(name)]
        self._begun_us = self._now_us

    @property
    def late_us(self) -> int:
        """How late its worst step was since this was made; 0 if it is gone."""
        try:
            late_us = self._request("status", since=self._begun_us)["late_us"]
        except MachineTooSlow:
            return _NO_ANSWER_US
        except PortGone:
            return 0
        assert isinstance(late_us, int)
        return late_us

    def prepare(self, like: HasSignals) -> None:
        """Bring it to where a new one begins: nothing is broken, all inputs are as at the start.

        Its power is off then. The world around it stays: where a drive has turned to it is still.
        """
        for name in self._wire_faults:
            self._request("clear", name=name)
        for item in like.inputs.table.values():
            if self._prefix + item.name not in self._inputs or item.name.startswith(_OBJECT):
                continue
            if item.type is SignalType.FAULT:
                self.clear(item.name)
            elif item.name not in POWER and self.get(item.name) != like.inputs[item.name]:
                self.set(item.name, (like.inputs[item.name],))
        if self._power is not None:
            self.switch_power(on=False)
        self._off_us = self._now_us

    def begin(self) -> None:
        """Give it its power, when it has seen that it had none."""
        if self._power is None:
            return
        while self._now_us < self._off_us + 2 * self._tick_us:
            time.sleep(self._tick_us / 1e6)
        self.switch_power(on=True)

    def set(self, name: str, values: tuple[Setting, ...]) -> None:
        """Set an input, or all inputs of a group."""
        self._request("set", name=self._prefix + name, value=list(values))

    def set_all(self, values: Mapping[str, Setting]) -> None:
        """Nothing: `prepare` has done so."""

    def get(self, name: str) -> Setting:
        """Return the present value of an input or output."""
        full = self._prefix + name
        values = self._request("get", names=[full])["values"]
        assert isinstance(values, dict)
        value: Setting = values[full]
        return value

    def press(self, name: str, duration_us: int) -> None:
        """Press a button and let it go."""
        self._request("press", name=self._prefix + name, duration_us=duration_us)

    def fault(self, spec: FaultSpec, now_us: int, for_us: int | None) -> None:
        """Let a fault come, in the time of the emulator."""
        text = replace(spec, name=self._fault_name(spec.name)).text
        timed = (spec.from_us, spec.to_us, for_us) != (0, NEVER, None)
        if timed:
            ahead_us = self._now_us - now_us
            from_us = max(spec.from_us, now_us)
            to_us = spec.to_us if for_us is None else from_us + for_us
            text += f"@{format_time(from_us + ahead_us)}s"
            text += "" if to_us == NEVER else f"-{format_time(to_us + ahead_us)}s"
        self._request("fault", spec=text)

    def clear(self, fault: str) -> None:
        """Let a fault go."""
        self._request("clear", name=self._fault_name(fault))

    def sees(self, text: str) -> bool | None:
        """The emulator is to be asked."""
        return None

    def have_done(self, text: str) -> bool:
        """Nobody understands it."""
        return False

    def switch_power(self, *, on: bool) -> None:
        """Give or take the supply."""
        if self._power is None:
            raise NotOnThisBench("this device has no input that is its supply")
        self.set(self._power, (POWER[self._power] if on else 1 - POWER[self._power],))

    def close(self) -> None:
        """Hang up."""
        self._client.close()

    def _fault_name(self, name: str) -> str:
        own = f"{self._name}/"
        if name.startswith(own):  # of the node alone, not of its bus
            bare = name.removeprefix(own)
            names: tuple[str, ...] = (self._prefix + bare, name, bare)
        else:
            names = (f"{self._wire}/{name}", name, self._prefix + name)
        return next((full for full in names if full in self._inputs), name)

    def _is_of_wire(self, fault: str) -> bool:
        return "/" not in fault or fault.startswith((f"{self._wire}/", self._prefix))

    @property
    def _power(self) -> str | None:
        """The input that is its supply, None if there is none."""
        return next((name for name in POWER if self._prefix + name in self._inputs), None)

    @property
    def _now_us(self) -> int:
        now_us = self._request("status")["now_us"]
        assert isinstance(now_us, int)
        return now_us

    def _request(self, do: str, **fields: object) -> Object:
        try:
            with self._lock:
                return self._client.request(do, **fields)
        except ControlRefused:
            raise
        except TimeoutError:
            text = f"the emulator at {self._path} has not answered for {TIMEOUT_S:g} s"
            raise MachineTooSlow(text) from None
        except (OSError, ValueError) as error:
            raise PortGone(f"the emulator at {self._path} is gone: {error}") from None


def _names_of(found: Object, key: str) -> frozenset[str]:
    items = found[key]
    assert isinstance(items, list)
    return frozenset(item["name"] for item in items)


def _prefix_of(plan: DevicePlan, names: frozenset[str], path: Path) -> str:
    """Return what an emulator writes before the names of a device."""
    owners = {name.partition("/")[0] for name in names if "/" in name}
    for name in (plan.name, str(plan.node_id)):
        if name in owners:
            return f"{name}/"
    if names and all("/" in name for name in names):
        raise ValueError(f"the emulator at {path} has no {plan.name!r}; known: {known(owners)}")
    return ""
