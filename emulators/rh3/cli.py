"""The command `rh3-emu`."""

from __future__ import annotations

from tickrig.emulators.commands.run_options import serial_command
from tickrig.emulators.rh3.fields import FIELDS


@serial_command("rh3-base", FIELDS, "tickrig.device.rh3.driver:INPUTS")
def main() -> None:
    """Emulate the base of Reference Hardware 3, a Modbus RTU slave, on a pseudo-terminal.

    The emulator runs in real time until Ctrl-C. With --scenario but without --link, --serve and
    --control, the scenario runs in virtual time: as fast as possible, with the same transcript each
    time, and with exit status 1 if an expectation was missed. With one of these three options, the
    scenario runs in real time.

    \b
    rh3-emu --link /tmp/rh3 --control /tmp/rh3.ctl
    tickrig ctl /tmp/rh3.ctl get x_m
    tickrig ctl /tmp/rh3.ctl press emergency_stop
    rh3-emu --link /tmp/rh3 --tread-m 0.45 --noise 0.02 --seed 7 --fault drop=0.01
    echo '0 read status' | rh3-emu --scenario -

    \b
    Completion of options in the shell:
    eval "$(_RH3_EMU_COMPLETE=bash_source rh3-emu)"
    """  # noqa: D301 - click wants the backspace
