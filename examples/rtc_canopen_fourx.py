"""FourX on four emulated motor core units, driven by a joystick component, in virtual time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tickrig import open_bench
from tickrig.host.rtc.canopen.robots import FourX, Joystick  # internal
from tickrig.host.rtc.canopen.serve import open_server, serve  # internal

WAY = ((0, 0, 1), (60, 0, 3), (40, 50, 2), (0, -100, 1), (0, 0, 1))


def main() -> None:
    """Drive straight on, along an arc, on the spot; stand before and after."""
    here = Path(__file__).parent
    bench = open_bench(here / "rigs" / "fourx.toml")
    server = open_server(here / "rtc_canopen" / "fourx.yaml")
    stick = server.manager.add(Joystick("Joystick0"), rate_hz=20.0)
    base = server.manager.add(FourX("Fourx0"), rate_hz=100.0)
    server.manager.activate("Joystick0", "Fourx0")
    link: Any = bench.link  # on a robot: CanLink.open("can0", "socketcan")
    server.start()
    for forward_pct, left_pct, duration_s in WAY:
        stick.tilt(forward_pct, left_pct)
        serve(server, link, link.now_us + 1_000_000 * duration_s)
        x_m, y_m = (float(bench.get(f"body/{name}")) for name in ("x_m", "y_m"))
        print(f"at {x_m:.2f} {y_m:.2f}; thinks {base.pose.x:.2f} {base.pose.y:.2f}")


if __name__ == "__main__":
    main()
