"""A trace of our EPOS-like drive and the canopen library, decoded; and by other decoders."""

from __future__ import annotations

from tests.host.canmon.model.decode.drive_trace import GOLDEN, NOISE, decoded, line, peer, record

WIRESHARK_KINDS = {
    "nmt": ("NMT:",),
    "sync": ("SYNC",),
    "time": ("TIME STAMP",),
    "emcy": ("EMCY",),
    "boot-up": ("NMT Error Control: Boot-up",),
    "heartbeat": ("NMT Error Control:",),
    "guard": ("NMT Error Control:", "ID: 1797"),  # it leaves remote frames alone
    "sdo": ("Default-SDO",),
    "lss": ("LSS",),
    "tpdo1": ("PDO1 (tx)",),
    "rpdo1": ("PDO1 (rx)",),
    "unmapped": ("PDO2 (tx)",),
}
NUMBERS = {
    "emcy": ("canopen.em.err_code", "canopen.em.err_reg"),
    "heartbeat": ("canopen.nmt_guard.state",),
    "boot-up": ("canopen.nmt_guard.state",),
    "guard": ("canopen.nmt_guard.state",),
    "time": ("canopen.time_stamp_days", "canopen.time_stamp_ms"),
}
LENS_KINDS = {"boot-up": "HEARTBEAT", "guard": "HEARTBEAT", "unmapped": "TPDO2"}


def test_the_trace_of_a_drive_reads_like_this() -> None:
    lines = [line(*pair) for pair in zip(record(), decoded(), strict=True)]
    assert "\n".join(lines) + "\n" == (GOLDEN / "drive.txt").read_text()


def test_wireshark_sees_the_same_services_and_nodes() -> None:
    for mine, other in zip(decoded(), peer("drive.tshark.txt"), strict=True):
        assert other["_ws.col.Info"].startswith(WIRESHARK_KINDS[mine.kind])
        if mine.kind not in ("nmt", "lss", "sync", "time") and other["canopen.node_id"]:
            assert int(other["canopen.node_id"], 16) == mine.node


def test_wireshark_sees_the_same_objects_but_in_block_transfers() -> None:
    for mine, other in zip(decoded(), peer("drive.tshark.txt"), strict=True):
        if not other["canopen.sdo.main_idx"]:
            continue
        entry = int(other["canopen.sdo.main_idx"], 16), int(other["canopen.sdo.sub_idx"], 16)
        if mine.text.startswith("segment 1 of a block"):
            assert "Abort" in other["_ws.col.Info"]  # 81h: it knows no state
        else:
            assert mine.entry == entry


def test_wireshark_sees_the_same_abort_codes_emcys_and_states() -> None:
    for mine, other in zip(decoded(), peer("drive.tshark.txt"), strict=True):
        code, error = other["canopen.sdo.abort_code"], other["canopen.em.err_code"]
        if code and not mine.text.startswith("segment 1 of a block"):
            assert mine.transfers[-1].abort_code == int(code, 16)
        if error:
            assert mine.signals[0].value == int(error, 16)
        if state := other["canopen.nmt_guard.state"]:
            assert mine.signals[0].value == int(state, 16)


def test_wireshark_reads_noise_in_the_same_way() -> None:
    for mine, other in zip(decoded(NOISE), peer("noise.tshark.txt"), strict=True):
        kinds = ("PDO",) if mine.kind == "unmapped" else WIRESHARK_KINDS[mine.kind]
        assert other["_ws.col.Info"].startswith(kinds)
        if mine.node is not None and mine.kind != "nmt":
            assert mine.node == int(other["canopen.node_id"], 16)
        if code := other["canopen.sdo.abort_code"]:
            assert mine.transfers[-1].abort_code == int(code, 16)
        if index := other["canopen.sdo.main_idx"]:
            assert mine.entry == (int(index, 16), int(other["canopen.sdo.sub_idx"], 16))
        values = [signal.value for signal in mine.signals]
        if columns := NUMBERS.get(mine.kind):
            assert values == [int(other[column], 0) for column in columns]


def test_canopen_lens_sees_the_same_services() -> None:
    for mine, other in zip(decoded(), peer("drive.lens.txt"), strict=True):
        kind = LENS_KINDS.get(mine.kind, mine.kind.upper())
        assert other["type"].removesuffix("_REQ").removesuffix("_RESP") == kind


def test_canopen_lens_sees_the_same_drive_states_where_the_mapping_was_heard() -> None:
    for mine, other in zip(decoded(), peer("drive.lens.txt"), strict=True):
        if mine.kind != "tpdo1":
            continue
        assert mine.signals[0].value == int(other["statusword"], 16)
        state = other["axis_state"].lower().replace("_", " ")
        assert mine.signals[0].text.endswith(f"[{state}]")
