"""What the world does to a servo, and what its drive allows."""

from __future__ import annotations

from math import inf

from tickrig._compiled import mypyc_attr
from tickrig.device.twin import Copyable


@mypyc_attr(allow_interpreted_subclasses=True)
class ServoSettings(Copyable):
    """Attributes whose change has consequences: setting another value calls `changed`."""

    __slots__ = (
        *("_ambient_c", "_blocked", "_current_limit_a", "_encoder_unplugged", "_load_kg_m2"),
        *("_load_nm", "_phase_open", "_supply_v"),
    )

    def __init__(self, supply_v: float) -> None:
        self._supply_v, self._ambient_c, self._encoder_unplugged = supply_v, 25.0, False
        self._load_nm, self._load_kg_m2 = 0.0, 0.0
        self._blocked, self._phase_open, self._current_limit_a = False, False, inf

    def changed(self) -> None:
        """Take the settings into account: one of them is new."""

    @property
    def supply_v(self) -> float:
        """Supply of the power stage."""
        return self._supply_v

    @supply_v.setter
    def supply_v(self, value: float) -> None:
        if value != self._supply_v:
            self._supply_v = value
            self.changed()

    @property
    def ambient_c(self) -> float:
        """Temperature of the air."""
        return self._ambient_c

    @ambient_c.setter
    def ambient_c(self, value: float) -> None:
        if value != self._ambient_c:
            self._ambient_c = value
            self.changed()

    @property
    def encoder_unplugged(self) -> bool:
        """The counts stand still, and are lost."""
        return self._encoder_unplugged

    @encoder_unplugged.setter
    def encoder_unplugged(self, value: bool) -> None:
        if value != self._encoder_unplugged:
            self._encoder_unplugged = value
            self.changed()

    @property
    def load_nm(self) -> float:
        """External torque at the output shaft; positive drives it forward."""
        return self._load_nm

    @load_nm.setter
    def load_nm(self, value: float) -> None:
        if value != self._load_nm:
            self._load_nm = value
            self.changed()

    @property
    def load_kg_m2(self) -> float:
        """Inertia at the output shaft beside what is always there."""
        return self._load_kg_m2

    @load_kg_m2.setter
    def load_kg_m2(self, value: float) -> None:
        if value != self._load_kg_m2:
            self._load_kg_m2 = value
            self.changed()

    @property
    def blocked(self) -> bool:
        """The shaft is held."""
        return self._blocked

    @blocked.setter
    def blocked(self, value: bool) -> None:
        if value != self._blocked:
            self._blocked = value
            self.changed()

    @property
    def phase_open(self) -> bool:
        """No current can flow."""
        return self._phase_open

    @phase_open.setter
    def phase_open(self, value: bool) -> None:
        if value != self._phase_open:
            self._phase_open = value
            self.changed()

    @property
    def current_limit_a(self) -> float:
        """What the drive allows; the stage may allow less."""
        return self._current_limit_a

    @current_limit_a.setter
    def current_limit_a(self, value: float) -> None:
        if value != self._current_limit_a:
            self._current_limit_a = value
            self.changed()
