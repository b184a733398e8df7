"""The command `tickrig`."""

from __future__ import annotations

import click

from tickrig.emulators.ctl_cli import ctl
from tickrig.emulators.demo_cli import demo
from tickrig.emulators.replay_cli import replay_command
from tickrig.emulators.rtc.cli import rtc
from tickrig.host.cli.options import version_option


@click.group()
@version_option()
def main() -> None:
    """Work with emulated devices.

    \b
    tickrig ctl /tmp/rrc.ctl press power_button   touch a running emulator
    tickrig replay run.trace                      replay a recorded run
    tickrig demo rrc                              see a device and a host at work
    tickrig rtc run system.toml                   run RT components

    \b
    Completion of commands and options in the shell:
    eval "$(_TICKRIG_COMPLETE=bash_source tickrig)"      in ~/.bashrc
    eval "$(_TICKRIG_COMPLETE=zsh_source tickrig)"       in ~/.zshrc
    _TICKRIG_COMPLETE=fish_source tickrig | source       in fish's configuration
    """  # noqa: D301 - click wants the backspace


main.add_command(ctl)
main.add_command(demo)
main.add_command(replay_command)
main.add_command(rtc)
