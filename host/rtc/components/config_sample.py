"""ConfigSample: parameters of all kinds, to be changed from outside."""

from __future__ import annotations

from typing import ClassVar

from tickrig.host.rtc.component import ModuleSpec, RtComponent


class ConfigSample(RtComponent):
    """Has parameters, and does nothing with them; names and defaults are OpenRTM's."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("ConfigSample", "Configuration example component")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.int_param0 = bind("int_param0", 0, "0<=x<=150", widget="slider.10")
        self.int_param1 = bind("int_param1", 1, "0<=x<=1000", widget="spin.10")
        self.double_param0 = bind("double_param0", 0.11, "0<=x<=10", widget="slider.1")
        self.double_param1 = bind("double_param1", 9.9, "0<=x<=10", widget="spin.1")
        self.str_param0 = bind("str_param0", "dara", widget="radio")
        self.str_param1 = bind("str_param1", "hoge", "(hoge, fuga, foo)", widget="radio")
        vector: tuple[float, ...] = (0.0, 1.0, 2.0, 3.0, 4.0)
        self.vector_param0 = bind("vector_param0", vector, widget="text")
