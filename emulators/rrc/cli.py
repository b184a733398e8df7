"""The command `rrc-emu`."""

from __future__ import annotations

from tickrig.emulators.commands.run_options import serial_command
from tickrig.emulators.rrc.fields import FIELDS


@serial_command("rrc", FIELDS, "tickrig.device.rrc.board:INPUTS", panel=True)
def main() -> None:
    """Emulate an RRC, the controller of the wheelchair VR2, with the VR2, on a pseudo-terminal.

    The emulator runs in real time until Ctrl-C. With --scenario but without --link, --serve,
    --control and --panel, the scenario runs in virtual time: as fast as possible, with the same
    transcript each time, and with exit status 1 if an expectation was missed. With one of these
    four options, the scenario runs in real time.

    \b
    rrc-emu --link /tmp/rrc --control /tmp/rrc.ctl
    tickrig ctl /tmp/rrc.ctl press power_button
    rrc-emu --serve rfc2217://7000
    rrc-emu --scenario drive.txt
    echo '1s press power_button' | rrc-emu --link /tmp/rrc --scenario -
    rrc-emu --link /tmp/rrc --fault flip=0.001 --fault cut@5s-7s -v
    """  # noqa: D301 - click wants the backspace
