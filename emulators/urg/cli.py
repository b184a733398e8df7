"""The command `urg-emu`."""

from __future__ import annotations

from tickrig.emulators.commands.run_options import serial_command
from tickrig.emulators.urg.fields import FIELDS


@serial_command("urg", FIELDS, "tickrig.device.urg.sensor:INPUTS")
def main() -> None:
    """Emulate a scanning range finder URG-04LX (SCIP 1.1 and 2.0) on a pseudo-terminal.

    The emulator runs in real time until Ctrl-C. With --scenario but without --link, --serve and
    --control, the scenario runs in virtual time: as fast as possible, with the same transcript each
    time, and with exit status 1 if an expectation was missed. With one of these three options, the
    scenario runs in real time.

    \b
    urg-emu --link /tmp/urg --control /tmp/urg.ctl --room 4,3 --post 1,0.5,0.1
    tickrig ctl /tmp/urg.ctl set pose 0.5 0 1.57
    tickrig ctl /tmp/urg.ctl set post 1 0 0.2
    printf '0 send SCIP2.0\\n1ms send VV\\n1ms expect 00P within 10ms' | urg-emu --scenario -

    \b
    Completion of options in the shell:
    eval "$(_URG_EMU_COMPLETE=bash_source urg-emu)"
    """  # noqa: D301 - click wants the backspace
