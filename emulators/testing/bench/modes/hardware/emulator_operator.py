"""An emulator that plays a real device, reached by its control socket for what hands do."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Final

from tickrig.emulators.bench.fault_spec import FaultSpec
from tickrig.emulators.bench.names import known
from tickrig.emulators.testing.bench.errors import MachineTooSlow, NotOnThisBench, PortGone
from tickrig.emulators.testing.bench.modes.emulated_mode import POWER
from tickrig.emulators.testing.rig_file.plan import DevicePlan
from tickrig.host.control.client import TIMEOUT_S, ControlClient, ControlRefused
from tickrig.host.control.requests import Object
from tickrig.host.text.values import Setting, format_time
from tickrig.wire.instant import NEVER

NO_ANSWER_US: Final = round(TIMEOUT_S * 1e6)
"""How late an emulator is that does not answer."""


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
        self._inputs, names = self._describe()
        self._prefix = _prefix_of(plan, names, path)
        self._wire = plan.wire
        self._steps_before, _ = self._pace()

    @property
    def late_us(self) -> int:
        """The worst, 0 if no step was late since this was made, or the emulator is gone."""
        try:
            steps, late_us = self._pace()
        except MachineTooSlow:
            return NO_ANSWER_US
        except PortGone:
            return 0
        return late_us if steps > self._steps_before else 0

    def set(self, name: str, values: tuple[Setting, ...]) -> None:
        """Set an input, or all inputs of a group."""
        self._request("set", name=self._prefix + name, value=list(values))

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
        text = self._fault_name(spec.name) + ("" if spec.rate is None else f"={spec.rate!r}")
        timed = (spec.from_us, spec.to_us, for_us) != (0, NEVER, None)
        if timed:
            emulator_us = self._request("status")["now_us"]
            assert isinstance(emulator_us, int)
            from_us = max(spec.from_us, now_us)
            to_us = spec.to_us if for_us is None else from_us + for_us
            ahead_us = emulator_us - now_us
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
        name = next((name for name in POWER if self._prefix + name in self._inputs), None)
        if name is None:
            raise NotOnThisBench("this device has no input that is its supply")
        self.set(name, (POWER[name] if on else 1 - POWER[name],))

    def close(self) -> None:
        """Hang up."""
        self._client.close()

    def _fault_name(self, name: str) -> str:
        names = (self._prefix + name, f"{self._wire}/{name}", name)
        return next((full for full in names if full in self._inputs), name)

    def _describe(self) -> tuple[frozenset[str], frozenset[str]]:
        """Return the names of inputs and faults, and those of inputs and outputs."""
        found = self._request("describe")
        inputs, outputs, faults = (
            _names_of(found, key) for key in ("inputs", "outputs", "wire_faults")
        )
        return inputs | faults, inputs | outputs

    def _pace(self) -> tuple[int, int]:
        status = self._request("status")
        steps, late_us = status["late_steps"], status["late_us"]
        assert isinstance(steps, int)
        assert isinstance(late_us, int)
        return steps, late_us

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
