"""The command `rtc-lite-emu`."""

from __future__ import annotations

from tickrig.emulators.commands.run_options import SERIAL_FAULTS, serial_command
from tickrig.emulators.rtc_lite.fields import FIELDS


@serial_command(
    "rtc-lite",
    FIELDS,
    "tickrig.device.rtc_lite.node:INPUTS",
    f"{SERIAL_FAULTS}, noise, ping, radio",
)
def main() -> None:
    """Emulate a PIC with an RTC-Lite component, on a pseudo-terminal.

    The emulator runs in real time until Ctrl-C. With --scenario but without --link, --serve and
    --control, the scenario runs in virtual time: as fast as possible, with the same transcript each
    time, and with exit status 1 if an expectation was missed. With one of these three options, the
    scenario runs in real time.

    Faults of the device: power_cut, slow_answer. Faults of the line: noise=0.01 (random bytes),
    flip=0.001 (inverted bits), ping=0.5 (every second PING is unanswered), radio=0.05 (a lossy
    radio link).

    \b
    rtc-lite-emu --link /tmp/lite-a --node lite-a
    rtc-lite-emu --link /tmp/lite --node my_node.py:Thermometer --timer 10 -v
    rtc-lite-emu --link /tmp/lite --control /tmp/lite.ctl --fault power_cut@5s-9s
    echo '0 send CX' | rtc-lite-emu --scenario -

    \b
    Completion of options and nodes in the shell:
    eval "$(_RTC_LITE_EMU_COMPLETE=bash_source rtc-lite-emu)"
    """  # noqa: D301 - click wants the backspace
