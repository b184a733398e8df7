"""The console commands; each command imports its modules when it is called.

Ctrl-C must end a command from the first moment. This module therefore imports nothing before the
handling of Ctrl-C is set up the handling of Ctrl-C.
"""

from _signal import SIG_DFL, SIG_IGN, SIGINT, default_int_handler, getsignal, signal  # type: ignore[import-not-found] # signal itself takes milliseconds


def _start(name: str, module: str) -> None:
    if getsignal(SIGINT) in (default_int_handler, SIG_IGN):  # ignored: a script started it by `&`
        signal(SIGINT, SIG_DFL)
    from tickrig.host.cli.start import start  # noqa: PLC0415

    start(name, f"{module}:main")


def tickrig() -> None:
    """Call `tickrig`."""
    _start("tickrig", "tickrig.emulators.commands.cli")


def rrc_emu() -> None:
    """Call `rrc-emu`."""
    _start("rrc-emu", "tickrig.emulators.rrc.cli")


def rrc() -> None:
    """Call `rrc`."""
    _start("rrc", "tickrig.host.rrc.cli")


def rtc_lite_emu() -> None:
    """Call `rtc-lite-emu`."""
    _start("rtc-lite-emu", "tickrig.emulators.rtc_lite.cli")


def canmon() -> None:
    """Call `canmon`."""
    _start("canmon", "tickrig.host.canmon.cli")


def rh3() -> None:
    """Call `rh3`."""
    _start("rh3", "tickrig.emulators.rh3.commands.motion_cli")


def rh3_emu() -> None:
    """Call `rh3-emu`."""
    _start("rh3-emu", "tickrig.emulators.rh3.cli")


def urg_emu() -> None:
    """Call `urg-emu`."""
    _start("urg-emu", "tickrig.emulators.urg.cli")


def ucode_reader_emu() -> None:
    """Call `ucode-reader-emu`."""
    _start("ucode-reader-emu", "tickrig.emulators.tkernel.reader.cli")


def ucode_resolver() -> None:
    """Call `ucode-resolver`."""
    _start("ucode-resolver", "tickrig.emulators.tkernel.commands.resolver_cli")


def tkernel_emu() -> None:
    """Call `tkernel-emu`."""
    _start("tkernel-emu", "tickrig.emulators.tkernel.commands.node_cli")


def canopen_slave_emu() -> None:
    """Call `canopen-slave-emu`."""
    _start("canopen-slave-emu", "tickrig.emulators.canopen.cli")


def rtc_canopen_server() -> None:
    """Call `rtc-canopen-server`."""
    _start("rtc-canopen-server", "tickrig.host.rtc.canopen.commands.server")


def rtc_canopen_builder() -> None:
    """Call `rtc-canopen-builder`."""
    _start("rtc-canopen-builder", "tickrig.host.rtc.canopen.commands.builder")


def rtc_canopen_editor() -> None:
    """Call `rtc-canopen-editor`."""
    _start("rtc-canopen-editor", "tickrig.host.rtc.canopen.commands.editor")
