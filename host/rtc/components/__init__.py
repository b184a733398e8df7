"""Example components, after those that come with OpenRTM-aist."""

from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.components.config_sample import ConfigSample
from tickrig.host.rtc.components.console_in import ConsoleIn
from tickrig.host.rtc.components.console_out import ConsoleOut
from tickrig.host.rtc.components.seq_in import SeqIn
from tickrig.host.rtc.components.seq_out import SeqOut

EXAMPLES: tuple[type[RtComponent], ...] = (ConsoleIn, ConsoleOut, SeqIn, SeqOut, ConfigSample)

__all__ = ["EXAMPLES", "ConfigSample", "ConsoleIn", "ConsoleOut", "SeqIn", "SeqOut"]
