"""Drive a base by keys: w s a d, space stops, Ctrl-C ends; the planner drives when no key is hit.

rh3-emu --link /tmp/rh3, then in another terminal: python examples/rh3_keyboard.py /tmp/rh3
"""

from __future__ import annotations

import sys

from tickrig import RealClock
from tickrig.host.rtc.motion.chain import MotionChain  # internal
from tickrig.host.rtc.motion.options.game_pad import GamePad  # internal
from tickrig.host.rtc.motion.options.switch_input import SwitchInput  # internal
from tickrig.host.rtc.system.schedule import RealTime  # internal
from tickrig.rtc import Manager


def main(device: str) -> None:
    """Let the keys win over the planner."""
    manager = Manager()
    chain = MotionChain(manager)
    chain.ref_hard.configuration.set("DeviceFileName", device)
    for component in (GamePad("GamePad0"), SwitchInput("SwitchInputRTC0")):
        manager.add(component, context=chain.context)
    manager.disconnect("PathFollower0.velocity", "RefHardRh30.InTargetVelocity")
    manager.connect("GamePad0.velocity", "SwitchInputRTC0.joystick")
    manager.connect("PathFollower0.velocity", "SwitchInputRTC0.automatic")
    manager.connect("SwitchInputRTC0.velocity", "RefHardRh30.InTargetVelocity")
    chain.activate()
    manager.activate("GamePad0", "SwitchInputRTC0")
    try:
        RealTime(manager, RealClock()).run()
    except KeyboardInterrupt:
        manager.deactivate("GamePad0")
        chain.deactivate()
        manager.run_for(100_000)


if __name__ == "__main__":
    main(sys.argv[1])
