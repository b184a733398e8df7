"""A device with every kind of physical input, as small as can be."""

from __future__ import annotations

from tickrig.device.canopen.slave import Application, CanopenSlave
from tickrig.device.physical import InputSignal, OutputSignal, SignalType

TABLE = (
    InputSignal("knob_v", "voltage of the knob", high=5, unit="V", real=True),
    InputSignal("di1", "first line"),
    InputSignal("di2", "second line"),
    InputSignal("bell", "a button", SignalType.BUTTON),
    InputSignal("burnt", "its filament is gone", SignalType.FAULT),
)


class Dimmer(Application):
    """Copies its inputs to 2006h and its lamp."""

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.has_inputs(TABLE, {"di": ("di1", "di2")})
        self.outputs = {"lamp_pct": OutputSignal("lamp_pct", "brightness", "%")}
        self._lamp_pct = 0.0

    def start(self) -> None:
        """Read the inputs."""
        self.request()

    def on_execute(self, now_us: int) -> None:
        """Shine; an error is seen while the filament is gone."""
        inputs = self.inputs
        self._lamp_pct = 0.0 if inputs["burnt"] else 20 * inputs["knob_v"]
        lines = inputs["di1"] + 2 * inputs["di2"] + 4 * inputs["bell"]
        self.node.dictionary[0x6000, 1].assign(bytes([int(lines)]))
        if inputs["burnt"]:
            self.node.emergency(0x5000, 0x01)
        else:
            self.node.emergency_clear(0x5000)

    def read(self, name: str) -> float | str:
        """Return the brightness."""
        return self._lamp_pct if name == "lamp_pct" else super().read(name)
