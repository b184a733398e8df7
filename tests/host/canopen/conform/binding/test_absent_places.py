"""Where a node has nothing; one that answers all the same fails, with an EDS and without."""

from __future__ import annotations

import pytest

from tests.host.canopen.conform.r1 import EDS
from tickrig.device import make_epos
from tickrig.host.canopen.conform.binding.binding import BoundPlace, bind
from tickrig.host.canopen.conform.verdict import CheckVerdict
from tickrig.host.canopen.eds import read_sound
from tickrig.host.canopen.errors import SdoAborted
from tickrig.testing import conformance
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.canopen.sdo_frame import AbortCode

NO_SUBINDEX = bytes.fromhex("11000906")
NAMES = ("absent_object", "absent_sub", "sub_of_variable")


class Dictionary:
    """What a node has, and the places at which it answers without having anything there."""

    def __init__(self, device: EdsDevice, *hidden: tuple[int, int]) -> None:
        self._values = {(one.index, one.sub): one.power_on_data(5) for one in device.entries}
        self._values |= dict.fromkeys(hidden, bytes(4))

    def upload(self, index: int, sub: int) -> bytes:
        try:
            return self._values[index, sub]
        except KeyError:
            raise SdoAborted(index, sub, AbortCode.NO_SUBINDEX) from None


def places(*hidden: tuple[int, int]) -> tuple[list[str], tuple[str, ...]]:
    device = read_sound(EDS)[0]
    binding = bind(device, Dictionary(device, *hidden).upload)
    bound = [binding.bound[name] for name in NAMES]
    return [f"{at.index:04X}.{at.sub:02X}" for at in bound if isinstance(at, BoundPlace)], (
        binding.findings
    )


def test_a_place_at_which_there_can_be_nothing_is_taken_though_there_is_something() -> None:
    assert places() == (["5FFF.00", "1018.05", "1000.01"], ())
    found, findings = places((0x1005, 1), (0x1016, 5), (0x1014, 1))
    assert found == ["5FFF.00", "1016.05", "1005.01"]
    assert findings == tuple(
        f"{where} is not described, but the node has it"
        for where in ("1016h:05", "1005h:01", "1014h:01")
    )


def test_where_the_node_may_have_more_than_is_described_another_place_is_taken() -> None:
    assert places((0x5FFF, 0), (0x1600, 9), (0x1003, 9))[0] == ["5FFE.00", "1018.05", "1000.01"]
    found, findings = places(*((index, 0) for index in range(0x5F00, 0x6000)))
    assert found[0] == "5FFF.00", "it has every object"
    assert len(findings) == 256


class Slave:
    """A slave of ours, which may answer 43h for each sub-index that it does not have."""

    def __init__(self, anywhere: bool) -> None:
        self.slave, self._anywhere = make_epos(5), anywhere
        self.tick_us, self.reset = self.slave.tick_us, self.slave.reset

    @property
    def due_us(self) -> int:
        return self.slave.due_us

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        return tuple(map(self._bend, self.slave.tick(now_us, rx)))

    def _bend(self, frame: CanFrame) -> CanFrame:
        if frame.can_id != 0x585 or frame.data[4:] != NO_SUBINDEX or not self._anywhere:
            return frame
        return CanFrame(frame.can_id, b"\x43" + frame.data[1:4] + bytes(4))


@pytest.mark.parametrize("known", [True, False], ids=["EDS", "no EDS"])
@pytest.mark.parametrize("anywhere", [True, False])
def test_a_node_that_has_every_sub_index_fails(known: bool, anywhere: bool) -> None:
    slave = Slave(anywhere)
    eds = EdsFile("epos.eds", write_eds(slave.slave.dictionary.description)) if known else None
    report = conformance(slave, node_id=5, eds=eds, only=("UE-07", "UE-08", "DE-10"))
    verdict = CheckVerdict.FAIL if anywhere else CheckVerdict.PASS
    assert [result.outcome.verdict for result in report.results] == [verdict] * 3
    why = "is not described" if known else "cannot be there"
    assert (f"1000h:01 {why}, but the node has it" in report.findings) == anywhere
