"""Drive an emulated RRC in virtual time: a minute on the road in a fraction of a second."""

from __future__ import annotations

from tickrig import Rig, SerialLine, SimLink, Station
from tickrig.device import Rrc
from tickrig.host import RrcClient, RrcEvent


def main() -> None:
    """Switch VR2 on, drive for a minute, let the host hang."""
    line, rrc = SerialLine(), Rrc()
    rig = Rig(Station(rrc, line.a))
    with RrcClient(SimLink(rig, line.b)) as client:
        client.start()
        rrc.inputs.set("power_button", 1)
        client.wait_for(RrcEvent.POWER_ON_SUCCESS, timeout_us=1_000_000)
        client.stablemode()
        client.watchdog(200_000)
        client.drive_by_host(v_pct=30, w_pct=0)
        client.run_for(60_000_000)  # renews the watchdog
        print(f"{client.now_us / 1e6:.3f} s: {rrc.read('state')}, {rrc.read('out_v_pct')} %")

        rig.run_for(300_000)  # time passes, but not in the client: the watchdog trips
        for event in client.events(timeout_us=0):
            print(f"{event.at_us / 1e6:.3f} s: EV:{event.value.name}")
        print(f"{client.now_us / 1e6:.3f} s: {rrc.read('state')}, {rrc.read('out_v_pct')} %")


if __name__ == "__main__":
    main()
