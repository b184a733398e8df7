"""Whatever happens on the line, proxy and node come back to a defined state.

Defined is, on a line that is clean again: a proxy that was lost has been
removed and a new one is there; proxy and node are both Inactive, or both
Active, or the proxy is in Error. From Error a reset leads both to Inactive; an
Inactive proxy whose node is elsewhere goes to Error when it is activated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.host.rtc.lite.bench import PERIOD_US, Bench
from tickrig.device.rtc_lite.component import LiteEcho
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.emulators.rig.faults import Fault, FaultArguments, FaultTrigger, FaultType
from tickrig.host.rtc import OutPort, connect
from tickrig.host.rtc.lite import ProxySettings, RtcLiteProxy
from tickrig.wire.rtc_lite.codes import LiteContextType
from tickrig.wire.rtc_lite.frame import Framing
from tickrig.wire.rtc_types.rtc import Time, TimedLong

NOISY_US = 3_000_000
QUIET_US = 6_000_000
"""Long enough for a fatal error, the removal and the rediscovery."""

Spoil = Callable[[bytes], bytes]


def keep(data: bytes) -> bytes:
    return data


def lose(data: bytes) -> bytes:
    return b""


def double(data: bytes) -> bytes:
    return data * 2


def halve(data: bytes) -> bytes:
    return data[: len(data) // 2]


def turn(data: bytes) -> bytes:
    return bytes(byte ^ 0x10 if at == len(data) // 2 else byte for at, byte in enumerate(data))


def insert(noise: bytes) -> Spoil:
    return lambda data: noise + data


NOISE = st.binary(max_size=12) | st.sampled_from(
    [
        b"\n",
        b"\nPS\x0f\x2d",
        b"\nQV\x0f\x2d",
        b"\nCX@A",
        b"\nZz\xd4",
        b"\nCY@\x01\xdd",
        b"\nAE@A\x07",
    ]
)
SPOILS = st.lists(
    st.sampled_from([keep, keep, lose, double, halve, turn]) | NOISE.map(insert), max_size=40
)


CONFIGS = [
    LiteConfig(),
    LiteConfig(context=LiteContextType.TIMER),
    LiteConfig(framing=Framing.RTNO),
]


def spoilt_bench(spoils: list[Spoil], config: LiteConfig) -> Bench:
    """An active echo on a line that spoils what passes, each way in turn, until all is used up."""
    bench = Bench(LiteEcho, config=config)
    bench.attach(0, "Echo", ProxySettings(framing=config.framing, rediscover=True))
    bench.context.start()
    bench.manager.activate("Echo0")
    bench.run_to(2 * PERIOD_US)
    ways: Iterator[Spoil] = iter(spoils)

    def make(trigger: FaultTrigger, arguments: FaultArguments) -> Fault[bytes]:
        return lambda now_us, data: next(ways, keep)(data)

    kind: FaultType[bytes] = FaultType("as the test wants", make, rated=False)
    bench.lines[0].fault_types = {"spoil": kind}
    bench.lines[0].arm("spoil")
    return bench


def bring_to_active(bench: Bench) -> None:
    """Do what a person would do: reset what is in Error, activate what is Inactive."""
    for _ in range(4):
        state = bench.manager.state_of("Echo0").name
        if state == "ERROR":
            bench.manager.reset("Echo0")
        elif state == "INACTIVE":
            bench.manager.activate("Echo0")
        bench.run_for(2 * PERIOD_US)


def echoed(bench: Bench) -> list[int]:
    """Write a number to the proxy, and return what comes out."""
    proxy = bench.manager.find("Echo0")
    assert isinstance(proxy, RtcLiteProxy)
    out = OutPort("out", TimedLong)
    connect(out, proxy.ports["in"])
    out.write(TimedLong(Time(), 42))
    bench.run_for(4 * PERIOD_US)
    value = bench.nodes[0].read("out.out")
    return [int(value)] if isinstance(value, int) else []


@settings(max_examples=80)
@given(SPOILS, st.sampled_from(CONFIGS))
def test_a_pair_comes_back_from_any_noise(spoils: list[Spoil], config: LiteConfig) -> None:
    bench = spoilt_bench(spoils, config)
    bench.run_for(NOISY_US)
    bench.lines[0].clear("spoil")
    bench.run_for(QUIET_US)
    states = bench.states()
    assert list(states) == ["Echo0"]
    node = bench.nodes[0].read("state")
    assert states["Echo0"] in {"ERROR", "INACTIVE", str(node).upper()}
    bring_to_active(bench)
    assert bench.states() == {"Echo0": "ACTIVE"}
    assert bench.nodes[0].read("state") == "Active"
    assert echoed(bench) == [42]


def test_a_count_that_noise_made_larger_swallows_the_pings_and_the_device_is_found_again() -> None:
    """A node waits for the rest of a frame as long as a PING for its answer (L7, L14)."""
    bench = Bench(LiteEcho)
    bench.context.set_rate(1_000_000 / 100_450)  # the phase between two ticks of the node
    proxy = bench.attach(0, "Echo", ProxySettings(rediscover=True))
    bench.context.start()
    bench.manager.activate("Echo0")
    bench.run_to(250_000)
    out = OutPort("out", TimedLong)
    connect(out, proxy.ports["in"])
    out.write(TimedLong(Time(), 1))
    bench.links[0].spoil = lambda frame: frame.replace(b"PS\x02\x04", b"PS\x02\x34")
    bench.run_for(QUIET_US)
    kinds = [kind for kind, _ in bench.announced()]
    assert kinds == ["FatalError", "Removed", "Rediscovered"]
    assert bench.states() == {"Echo0": "INACTIVE"}
