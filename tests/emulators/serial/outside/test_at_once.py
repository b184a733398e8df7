"""A port that lets whole lines come at once does what one does that looks at every byte."""

from __future__ import annotations

from typing import Any

from hypothesis import example, given
from hypothesis import strategies as st

from tests.emulators.serial.outside.lines import BAUD, SETTING
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.serial.bridge import HostEnd
from tickrig.emulators.serial.outside.serial_side import SerialSide
from tickrig.emulators.serial.outside.sim_serial import SimSerial
from tickrig.emulators.serial.serial_line import SerialLine


class ByteByByte(HostEnd):
    """An end that does not know what is on its way."""

    @property
    def coming(self) -> bytes:
        """Nothing that anybody knew."""
        return b""

    def arrival_us(self, count: int) -> int:
        """Return when the next byte comes."""
        return self.due_us


sends = st.lists(
    st.tuples(st.integers(0, 30_000), st.text("ab\r\n>", min_size=1, max_size=30).map(str.encode)),
    max_size=12,
)
steps = st.lists(
    st.one_of(
        st.tuples(st.just("read"), st.integers(0, 40)),
        st.tuples(st.just("readline"), st.sampled_from([-1, -1, -1, 3])),
        st.tuples(
            st.just("read_until"), st.sampled_from([b"\n", b"\r\n", b">", (b">", 4), (b"\n", 9)])
        ),
        st.tuples(st.just("timeout"), st.sampled_from([0, 0.00005, 0.0015, 0.02])),
        st.tuples(st.just("inter_byte_timeout"), st.sampled_from([None, 0, 0.00005, 0.003])),
        st.tuples(st.just("run"), st.integers(0, 9_000)),
    ),
    max_size=30,
)


def play(
    sends: list[tuple[int, bytes]], steps: list[tuple[str, Any]], cancels: list[int], *, known: bool
) -> list[object]:
    """Let a device send and a host do its steps; return what the host saw, with the times."""
    line, rig = SerialLine(BAUD), Rig()
    end = line.b if known else ByteByByte(line.b, lambda *heard: None)
    port = SimSerial(SerialSide(rig, end, SETTING), timeout=0.02)
    for number, (t_us, data) in enumerate(sends):
        rig.event_queue.put(number, t_us, lambda now_us, data=data: line.a.send(now_us, data))  # type: ignore[misc]
    for t_us in cancels:
        rig.event_queue.put(-1 - t_us, t_us, lambda now_us: port.cancel_read())
    seen = list[object]()
    for verb, what in steps:
        if verb == "run":
            rig.run_for(what)
        elif verb.endswith("timeout"):
            setattr(port, verb, what)
        else:
            given = what if isinstance(what, tuple) else (what,)
            seen.append((getattr(port, verb)(*given), rig.now_us))
    return [*seen, port.in_waiting]


@given(sends, steps, st.lists(st.integers(1, 30_000), max_size=3))
@example([(6_037, b">>\n")], [("read_until", b"\n")], [6_240])
def test_it_reads_the_same_at_the_same_times(
    sends: list[tuple[int, bytes]], steps: list[tuple[str, Any]], cancels: list[int]
) -> None:
    known = play(sends, steps, cancels, known=True)
    assert known == play(sends, steps, cancels, known=False)
