"""A leader and two followers, whose connections are changed while all of them run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tickrig import open_bench
from tickrig.host.rtc.canopen.definition import PdoName  # internal
from tickrig.host.rtc.canopen.serve import open_server, serve  # internal
from tickrig.host.rtc.canopen.view import ServerView  # internal
from tickrig.rtc import Time, TimedShort

HERE = Path(__file__).parent


def main() -> None:
    """Let one follow through the PC, then the other, then both, one of them by PDO link."""
    bench = open_bench(HERE / "rigs" / "followers.toml")
    server = open_server(HERE / "rtc_canopen" / "followers.yaml")
    link: Any = bench.link
    view = ServerView(server)
    serve(server, link, until_us=1_000_000)
    view.connect("Leader.angle", "Second.reference")
    for degrees in (30, 60, 90):
        if degrees == 60:
            view.disconnect("Leader.angle", "Second.reference")
            view.connect("Leader.angle", "Third.reference")
        server.put("Leader.reference", TimedShort(Time(), degrees * 32_767 // 180))
        serve(server, link, link.now_us + 1_000_000)
        print(*(f"{float(bench[name].get('angle_deg')):.1f}" for name in bench.devices))
        if degrees == 60:
            view.link(PdoName(32, "tpdo2"), PdoName(33, "rpdo2"))


if __name__ == "__main__":
    main()
