"""The command `ucode-reader-emu`."""

from __future__ import annotations

from tickrig.emulators.commands.run_options import serial_command
from tickrig.emulators.tkernel.reader.fields import FIELDS


@serial_command("ucode-reader", FIELDS, "tickrig.device.ucode_reader:INPUTS")
def main() -> None:
    """Emulate an infra-red reader of ucodes on a pseudo-terminal (38400 8N1).

    Markers in the environment send ucodes of 128 bits, written as 32 hex digits; the reader reports
    the ucodes in range every 100 ms, in lines of ASCII.

    The emulator runs in real time until Ctrl-C. With --scenario but without --link, --serve and
    --control, the scenario runs in virtual time: as fast as possible, with the same transcript each
    time, and with exit status 1 if an expectation was missed. With one of these three options, the
    scenario runs in real time.

    \b
    ucode-reader-emu --link /tmp/ucode --control /tmp/ucode.ctl \\
        --marker 00001C00000000000001000000000001,1,0
    tickrig ctl /tmp/ucode.ctl set pose 0.5 0 1.57
    tickrig ctl /tmp/ucode.ctl fault sunlight
    printf '250ms send ID\\n250ms expect $UI* within 10ms' | ucode-reader-emu --scenario -

    \b
    Completion of options in the shell:
    eval "$(_UCODE_READER_EMU_COMPLETE=bash_source ucode-reader-emu)"
    """  # noqa: D301 - click wants the backspace
