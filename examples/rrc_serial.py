"""Show what an RRC says, on any port: `python rrc_serial.py /dev/ttyACM0`, `socket://host:port`."""

from __future__ import annotations

import sys

from tickrig.host import LinkError, RrcClient


def main(url: str) -> None:
    """Ask for name and version, then show events and status for two seconds."""
    with RrcClient.open(url) as client:
        print(client.device(), client.version(), client.date(), sep=", ")
        client.status()
        client.run_for(2_000_000)
        for event in client.events(timeout_us=0):
            print(f"EV:{event.value.name}")
        if (latest := client.latest_status) is None:
            print("no status: VR2 is off; press its power button and try again")
        else:
            print(latest.value)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(f"usage: {sys.argv[0]} URL")
    try:
        main(sys.argv[1])
    except LinkError as error:
        sys.exit(str(error))
