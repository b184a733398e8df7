"""The nine sample commands with CHECK of the RRC manual's test procedure."""

from __future__ import annotations

from tickrig.wire.rrc import commands as cmd

SAMPLES = {
    b"limit3232ffffffD": cmd.Limit(50, 50),
    b"output1e007": cmd.Output(30, 0),
    b"speedmode40A": cmd.SpeedMode(4),
    b"joystick00006464003051e2d8": cmd.Joystick(reverse_mode=3),
    b"watchdog64B": cmd.Watchdog(100),
    b"statusA16": cmd.Status(1),
    b"stablemode11": cmd.StableMode(1),
    b"poweroff8": cmd.PowerOff(),
    b"beep646464640a0a0a0a0a0aa": cmd.Beep((100,) * 4 + (10,) * 6),
}
