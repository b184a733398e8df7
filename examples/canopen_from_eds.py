"""Make a CANopen slave of an EDS alone, and look at what it puts onto the bus."""

from __future__ import annotations

from pathlib import Path

from tickrig import CanFrame, read_eds
from tickrig.device import Ds401, make_slave

EDS = Path(__file__).with_name("io_module.eds")


def main() -> None:
    """Start node 5, set an input, write an output, all within one second of virtual time."""
    slave = make_slave(read_eds(EDS).make_dictionary(), node_id=5, application=Ds401)
    module = Ds401.of(slave)
    master = {10_000: "000#0105", 200_000: "205#5A"}  # start the node, write its outputs
    for now_us in range(0, 1_000_000, slave.tick_us):
        if now_us == 100_000:
            module.inputs.set("di1", 1)
            module.inputs.set("di8", 1)
        sent = [CanFrame.parse(master[now_us])] if now_us in master else []
        for frame in (*sent, *slave.tick(now_us, tuple(sent))):
            print(f"{now_us / 1e6:.3f} {frame}")
    print(f"the outputs are {module.read('do'):02X}h")


if __name__ == "__main__":
    main()
