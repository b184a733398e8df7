"""Keywords of Robot Framework for a bench."""

from __future__ import annotations

import re
from collections import deque
from pathlib import Path
from typing import Any, Final

from tickrig._version import __version__
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.testing.bench.bench import Bench, BenchDevice, open_bench
from tickrig.emulators.testing.plugin.journal_text import last_lines
from tickrig.host.text.byte_text import escape, unescape
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import Setting, parse_setting
from tickrig.wire.can import CanFrame

_LINES: Final = 20
_KEPT: Final = 10_000


class BenchLibrary:
    """Library of Robot Framework with keywords for a bench of emulated or real devices.

    One bench is open at a time. A test that fails shows the last lines and frames of its bench, and
    the bench is closed when the test is over. If the bench has several devices, the name of a
    signal is `DEVICE/NAME`.

    Attributes:
        ROBOT_LIBRARY_SCOPE: scope of the library: each test has its own instance.
        ROBOT_LIBRARY_VERSION: version of tickrig.
        ROBOT_LISTENER_API_VERSION: version of the listener interface, by which the library notices
            the end of a test.
        ROBOT_LIBRARY_LISTENER: the listener, which is the library itself.
    """

    ROBOT_LIBRARY_SCOPE = "TEST"
    ROBOT_LIBRARY_VERSION = __version__
    ROBOT_LISTENER_API_VERSION = 3

    def __init__(self) -> None:
        self.ROBOT_LIBRARY_LISTENER = self
        self._bench: Bench | None = None
        self._links: dict[str, Any] = {}
        self._heard: deque[tuple[str, str]] = deque(maxlen=_KEPT)

    def _end_test(self, data: object, result: Any) -> None:
        """Show what happened, and close the bench; Robot Framework calls this method."""
        if self._bench is None:
            return
        if result.failed:
            result.message += f"\n\nWhat passed last:\n{last_lines(self._bench, _LINES)}"
        self.close_bench()

    @property
    def bench(self) -> Bench:
        """The bench that is open.

        Raises:
            RuntimeError: no bench is open.
        """
        if self._bench is None:
            raise RuntimeError("no bench is open: use `Open Bench` first")
        return self._bench

    def open_bench(self, what: str, mode: str = "virtual", seed: int | None = None) -> None:
        """Open the bench of a rig file (``rig.toml``) or of one device type (``rrc``).

        Args:
            what: path of the rig file, or name of the device type.
            mode: ``virtual`` or ``real``, or with a rig file also ``hardware``.
            seed: seed of all random numbers; by default the seed of the rig file, or 0 without a
                rig file.
        """
        self.close_bench()
        if Path(what).suffix in (".toml", ".yml", ".yaml"):
            self._bench = open_bench(what, mode=mode, seed=seed)
        else:
            self._bench = Bench(what, mode=mode, seed=seed or 0)
        self._bench._mode.hear(self._hear)

    def close_bench(self) -> None:
        """Close the bench. If no bench is open, nothing happens."""
        bench, self._bench = self._bench, None
        self._links.clear()
        self._heard.clear()
        if bench is not None:
            bench.close()

    def _hear(self, line: WireLine) -> None:
        if line.mark is Mark.FROM_DEVICE:
            self._heard.append((line.source, escape(line.data)))

    def _of(self, device: str) -> BenchDevice:
        return self.bench[device] if device else self.bench

    def advance(self, duration: str) -> None:
        """Advance the time of the bench by a duration, such as ``100ms`` or ``2s``.

        Args:
            duration: duration with its unit.
        """
        self.bench.run_for(duration)

    def send(self, text: str, device: str = "", end: str = r"\n") -> None:
        r"""Send a line of text to a device, as its host; ``\xhh`` stands for a byte in hex.

        Args:
            text: the line without its end.
            device: name of the device that gets the line, if the bench has several wires.
            end: end of the line.
        """
        self._link(device).send(unescape(text + end))

    def send_frame(self, frame: str, device: str = "") -> None:
        """Send a CAN frame as a host, in candump's notation, such as ``701#05``.

        Args:
            frame: the frame in candump's notation.
            device: name of a device on the bus, if the bench has several buses.
        """
        self._link(device).send((CanFrame.parse(frame),))

    def _link(self, device: str) -> Any:
        if device not in self._links:
            self._links[device] = self._of(device).link
        return self._links[device]

    def expect(self, pattern: str, within: str = "1s", device: str = "") -> str:
        """Wait for a line or a CAN frame from a device, and return it.

        The search begins after the line that the last ``Expect`` has returned. Therefore a line
        that arrived before this call can be found, too.

        Args:
            pattern: the whole line, or the frame in candump's notation; ``*`` stands for anything.
            within: longest wait.
            device: name of the device or wire that sends the line; by default any.
        """
        wanted = re.compile(".*".join(map(re.escape, pattern.split("*"))), re.DOTALL)
        bench, passed = self.bench, list[str]()
        sources = {"", device, bench._mode.wire_of(device)} if device else set()

        def came() -> bool:
            while self._heard:
                source, text = self._heard.popleft()
                if not sources or source in sources:
                    passed.append(text)
                    if wanted.fullmatch(text):
                        return True
            return False

        if not bench.wait_until(came, within):
            others = ", ".join(map(repr, passed[-3:])) or "nothing"
            raise AssertionError(f"{pattern!r} did not come within {within}; what came: {others}")
        return passed[-1]

    def order_fault(self, fault: str, duration: str | None = None) -> None:
        """Start a fault now, or schedule it, as in ``cut``, ``cut@2s-3s`` or ``axis2/sdo_slow=2s``.

        Args:
            fault: the fault with its arguments.
            duration: duration of the fault; by default the fault stays until it is cleared.
        """
        self.bench.fault(fault, for_=duration)

    def clear_fault(self, name: str) -> None:
        """Clear a fault.

        Args:
            name: name of the fault.
        """
        self.bench.clear(name)

    def press(self, button: str, duration: str = "100ms") -> None:
        """Press a button of a device on the bench, and release it after a duration.

        Args:
            button: name of the button.
            duration: time for which the button is pressed.
        """
        self.bench.press(button, duration)

    def set_input(self, name: str, *values: str) -> None:
        """Set an input of a device on the bench, or all inputs of a group.

        Args:
            name: name of the input or group.
            *values: one value for an input, or one value for each input of the group.
        """
        self.bench.set(name, *(parse_setting(str(value)) for value in values))

    def get_signal(self, name: str) -> Setting:
        """Return the present value of an input, an output or an object of a CANopen node.

        Args:
            name: name of the signal, such as ``state``, or ``axis2/0x6041`` for an object.
        """
        return self.bench.get(name)

    def signal_should_be(self, name: str, value: str, within: str = "0ms") -> None:
        """Fail unless a signal has a value, or gets the value within a time.

        Args:
            name: name of the input, output or object.
            value: the expected value.
            within: longest wait; by default the value must be there at once.
        """
        wanted, bench = parse_setting(str(value)), self.bench
        if not bench.wait_until(lambda: bench.get(name) == wanted, within):
            raise AssertionError(f"{name} is {bench.get(name)!r}, not {wanted!r} within {within}")

    def switch_off(self, device: str = "") -> None:
        """Switch off the supply of a device.

        Args:
            device: name of the device to switch off; by default all devices.
        """
        self._of(device).switch_off()

    def switch_on(self, device: str = "") -> None:
        """Switch on the supply of a device.

        Args:
            device: name of the device to switch on; by default all devices.
        """
        self._of(device).switch_on()
