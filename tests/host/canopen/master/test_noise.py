"""Whatever is on the bus, a master goes on."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tests.host.canopen.master.network import HEARTBEAT, VENDOR
from tickrig.host.canopen.bus_file.bus_values import BusPdo, DriveChannel
from tickrig.host.canopen.master.assignment import MasterPlan, SlaveAssignment
from tickrig.host.canopen.master.cia402.drive_driver import DriveNode, DriveSettings
from tickrig.host.canopen.master.nmt_master import NmtMaster, ProcessData
from tickrig.host.canopen.master.process_image import ProcessImage
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.pdo import MappedObject

SLAVES = (
    SlaveAssignment(2, "drive", mandatory=True, writes=(HEARTBEAT,), heartbeat_us=30_000),
    SlaveAssignment(3, reset_communication=False, vendor_id=VENDOR, guard_us=5_000),
    SlaveAssignment(4, software_version=1, restore_sub=1),
)
PDOS = (
    BusPdo(1, True, 0x182, 1, mapping=(MappedObject(0x6041, 0, 16), MappedObject(0x6061, 0, 8))),
    BusPdo(1, False, 0x202, 255, mapping=(MappedObject(0x6040, 0, 16),)),
    BusPdo(2, False, 0x302, 1, mapping=(MappedObject(0x607A, 0, 32),)),
)

CAN_IDS = st.sampled_from([0x000, 0x080, 0x082, 0x182, 0x582, 0x583, 0x584, 0x702, 0x703, 0x704])
ANSWERS = st.sampled_from(
    ["4300100092010200", "6017100000000000", "8000100000000006", "00", "7F", "05", "85", ""]
).map(bytes.fromhex)
FRAMES = st.builds(
    CanFrame,
    CAN_IDS | st.integers(0, 0x7FF),
    ANSWERS | st.binary(max_size=8),
    st.just(False),
    st.booleans(),
)


def master() -> NmtMaster:
    nmt = NmtMaster(MasterPlan(SLAVES, node_id=1, heartbeat_us=10_000, sync_us=4_000))
    image = ProcessImage(PDOS, nmt.send)
    axes = (DriveSettings(DriveChannel("one")), DriveSettings(DriveChannel("two"), axis=1))
    nmt.process_data = ProcessData({2: image}, (DriveNode(nmt.slaves[2], image, axes, 10_000),))
    return nmt


@given(st.lists(st.tuples(st.integers(0, 20_000), st.lists(FRAMES, max_size=3)), max_size=60))
def test_noise_leaves_a_master_at_work(ticks: list[tuple[int, list[CanFrame]]]) -> None:
    nmt, now_us, syncs = master(), 0, 0
    for wait_us, frames in ticks:
        now_us += wait_us
        sent = nmt.tick(now_us, tuple((now_us, frame) for frame in frames))
        assert all(frame == frame.checked() for frame in sent)
        assert nmt.due_us > now_us
        syncs += sum(frame.can_id == 0x080 for frame in sent)
    if now_us > 30_000:
        assert syncs > 0
    nmt.tick(now_us + 10_000_000, ())
    assert any(slave.booting or slave.outcome is not None for slave in nmt.slaves.values())
