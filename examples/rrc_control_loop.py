"""Drive at half of what the stick says, by `output`, until VR2 is switched off."""

from __future__ import annotations

import sys
from contextlib import suppress

from tickrig.host import DeviceRefused, RrcClient, RrcEvent


def main(url: str) -> None:
    """Wait for the power button, then close the loop over the host once a status line."""
    with RrcClient.open(url) as client:
        print("press the power button", flush=True)
        client.wait_for(RrcEvent.POWER_ON_SUCCESS, timeout_us=60_000_000)
        client.stablemode()  # the manual demands both, stablemode and watchdog
        client.watchdog(100_000)
        client.status()
        client.drive_by_host(v_pct=0, w_pct=0)
        with suppress(DeviceRefused):  # outputs that are on their way while VR2 stops
            for status in client.statuses(timeout_us=50_000):
                stick = status.value
                client.output(int(stick.in_v_pct / 2), int(stick.in_w_pct / 2))
        for event in client.events(timeout_us=1_000_000):
            print(f"EV:{event.value.name}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(f"usage: {sys.argv[0]} URL")
    main(sys.argv[1])
