from __future__ import annotations

import re
from xml.etree import ElementTree as Xml

import pytest

from tests.emulators.testing.plugin.conftest import Run, skip_if_too_slow
from tests.emulators.testing.plugin.test_bench_fixture import RRC
from tickrig.emulators.testing.report.report_file import read_run

pytest_plugins = ("pytester",)


def test_a_failure_tells_what_was_asked_what_happened_and_how_to_repeat_it(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.parametrize("name", ["a b"])
        def test_one(bench, name):
            bench.link.send(b"hello\\n")
            bench.run_for("1.5s")
            assert bench.get("state") == "Lost"
        """
    )
    result = run("--bench-seed", "7")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        [
            "*- bench -*",
            "rrc; virtual, seed 7, 1.500000 s old",
            "*- bench: what happened last -*",
            "0.*0 rrc > hello",
            "0.*0 rrc < ER:*",
            "*- bench: repeat it with -*",
            "pytest 'test_a_*.py::test_one[[]a b[]]' --bench-seed 7",
        ]
    )


def test_a_failure_shows_a_line_that_did_not_end(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        def test_one(bench):
            port = bench.serial(timeout=0.1)
            port.write(b"device\\nvers")
            bench.run_for("100ms")
            assert b"Version" in port.read(100)
        """
    )
    result = run()
    result.stdout.fnmatch_lines(
        ["0.* rrc > device", "0.* rrc < RRC", "0.* rrc > vers  (not ended)"]
    )


def test_a_failure_shows_what_was_heard_where_a_fault_changed_it(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        def ask(bench, fault):
            bench.fault(fault)
            port = bench.serial(timeout=0.1)
            port.write(b"device\\n")
            return port.read(100)

        def test_one(bench):
            bench.run_for("100ms")
            assert ask(bench, "cut") == b""
            bench.clear("cut")
            assert ask(bench, "dup=1") == b"OK:device"
        """
    )
    result = run("--bench-report", "run.html", "--bench-artifacts", "kept")
    result.assert_outcomes(failed=1)
    told = [
        "0.110000 rrc ! cut",
        "0.110000 rrc > device",
        "0.110000 rrc ~ the device hears nothing where the host sent device?n",
        "0.* rrc ! cut=0",
        "0.* rrc > device",
        "0.* rrc ~ the device hears ddeevviiccee?n?n where the host sent device?n",
        "0.* rrc ~ the host hears EERR::*?n?n where the device sent ER:*?n",
        "0.* rrc < EERR::*",
    ]
    result.stdout.fnmatch_lines(told)
    (transcript,) = (pytester.path / "kept").glob("*.txt")
    pytest.LineMatcher(transcript.read_text().splitlines()).fnmatch_lines(told)
    page = (pytester.path / "run.html").read_text()
    assert re.search('<li class="act"><i>[^<]*</i> ~ the device hears nothing where the ', page)


def test_frames_are_told_with_what_they_mean(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import pytest
        from tickrig.device import make_epos

        @pytest.fixture
        def bench_config():
            return {"left": make_epos(1), "right": make_epos(2)}

        def test_one(bench):
            bench["left"].fault("power_off@50ms")
            bench.run_for("100ms")
            assert not bench.now_us
        """
    )
    result = run()
    result.stdout.fnmatch_lines(
        [
            "left, right; virtual, seed 0, 0.100000 s old",
            "0.* can < 701#00  *boot*",
            "0.050000 left ! power_off=1",
        ]
    )


def test_what_blocks_a_test_is_no_failure_of_the_device(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import pytest
        from tickrig.emulators.testing.bench.errors import OperatorRefused, PortGone

        def test_one(bench):
            raise PortGone("/dev/ttyUSB0 is gone")

        @pytest.mark.xfail(reason="no wonder")
        def test_two(bench):
            raise OperatorRefused("power_button: the operator said no")
        """
    )
    result = run("--junitxml=out.xml")
    result.assert_outcomes(errors=2)
    result.stdout.fnmatch_lines(
        [
            "ERROR *::test_one - blocked: /dev/ttyUSB0 is gone",
            "ERROR *::test_two - blocked: power_button: the operator said no",
        ]
    )
    suite = Xml.parse(pytester.path / "out.xml").find("testsuite")
    assert suite is not None
    assert (suite.get("errors"), suite.get("failures")) == ("2", "0")


def test_the_traceback_of_what_blocks_a_test_is_that_of_the_test(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makefile(
        ".toml", rig='[device.rrc]\ntype = "rrc"\n[hardware.rrc]\nport = "/dev/nowhere"\n'
    )
    pytester.makepyfile("def test_one(bench):\n    bench.link\n")
    result = run("--bench", "rig.toml", "--bench-mode", "hardware")
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines([">       bench.link", "", "test_*.py:2: *"])
    result.stdout.no_fnmatch_line("*hardware_mode.py*")


def test_ctrl_c_leaves_a_report_of_what_has_run(pytester: pytest.Pytester, run_apart: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        def test_one(bench):
            pass

        def test_two(bench):
            raise KeyboardInterrupt

        def test_three(bench):
            pass
        """
    )
    result = run_apart("--bench-report", "run.json")
    assert result.ret == pytest.ExitCode.INTERRUPTED
    assert [test.nodeid[-3:] for test in read_run(pytester.path / "run.json").tests] == ["one"]


def test_blocked_tests_are_run_again_with_lf(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        from tickrig.emulators.testing.bench.errors import PortGone

        def test_well(bench):
            pass

        def test_blocked(bench):
            raise PortGone("/dev/ttyUSB0 is gone")

        def test_failed(bench):
            assert bench.now_us

        def test_last(bench):
            pass
        """
    )
    run().assert_outcomes(passed=2, errors=1, failed=1)
    run("--lf").assert_outcomes(errors=1, failed=1)
    run("-x").assert_outcomes(passed=1, errors=1)


BUS = """
        import can
        import pytest
        from tickrig.device import make_epos

        @pytest.fixture
        def bench_config():
            return make_epos(1)
"""


@pytest.mark.parametrize(("fault", "healthy"), [("bench.fault('corrupt=1')", True), ("", False)])
def test_error_frames_that_nobody_ordered_fail_the_test(
    pytester: pytest.Pytester, run: Run, fault: str, healthy: bool
) -> None:
    pytester.makepyfile(
        f"""{BUS}
        def test_one(bench):
            {fault or "bench._mode.act(lambda rig: rig.wire.arm('corrupt', '1'))"}
            bench.run_for("100ms")
        """
    )
    result = run()
    result.assert_outcomes(passed=healthy, failed=not healthy)
    if not healthy:
        result.stdout.fnmatch_lines(["can: an error frame that no fault ordered, at 0.* s: *"])


def test_what_found_a_buffer_full_fails_the_test_unless_a_fault_is_to_blame(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makepyfile(
        """
        import pytest
        from tickrig.device import Urg

        @pytest.fixture
        def bench_config():
            return Urg()

        def flood(bench):
            bench.run_for("3s")
            bench.link.send(b"SCIP2.0\\nBM\\nMD0044072501000\\n")
            bench.run_for("5s")

        def test_nobody_reads_what_was_asked_for(bench):
            flood(bench)

        def test_a_bad_line(bench):
            bench.fault("drop=0.001@6s")
            flood(bench)

        @pytest.mark.allows("lost")
        def test_it_may_be(bench):
            flood(bench)

        @pytest.mark.allows("loss")
        def test_what_no_marker_allows(bench):
            flood(bench)

        def test_told_once(bench):
            flood(bench)
            assert bench.now_us == 0
        """
    )
    result = run()
    result.assert_outcomes(passed=2, failed=2, errors=1)
    result.stdout.fnmatch_lines(
        [
            "no bench: allows('loss'): it can allow 'error frames', 'lost', 'clock', 'threads', "
            "'long waits'",
            "urg: * bytes found a buffer full",
        ]
    )
    assert result.stdout.str().count("found a buffer full") == 1


@pytest.mark.parametrize(
    ("safe", "said"),
    [
        ("{'state': 'Off'}", ""),
        ("{'out_v_pct': 0, 'state': 'Standby'}", "state is Off, and safe is Standby"),
        ("lambda bench: bench.get('out_v_pct') == 0", ""),
        ("lambda bench: bench.get('out_v_pct') > 0", "bench_safe says that it is not safe"),
        ("lambda bench: '' if bench.now_us else 'too young'", "too young"),
    ],
)
def test_outputs_are_safe_after_a_test(
    pytester: pytest.Pytester, run: Run, safe: str, said: str
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        f"""
        import pytest

        @pytest.fixture
        def bench_safe():
            return {safe}

        def test_one(bench):
            pass
        """
    )
    result = run()
    result.assert_outcomes(passed=not said, failed=bool(said))
    if said:
        result.stdout.fnmatch_lines(["after the test the bench is not as it has to be:", said])


def test_a_signal_without_a_value_fails_the_test(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makefile(
        ".toml",
        rig='[device.chair]\ntype = "rrc"\nstart.gauge = {formula = "sqrt(2 - t)"}\n',
    )
    pytester.makepyfile("def test_it(bench):\n    bench.run_for('3s')\n")
    result = run("--bench", "rig.toml")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*signal chair/gauge: nan is no value at 2.010000 s"])


@pytest.mark.realtime
def test_a_failure_on_a_machine_that_stood_still_is_none_of_the_device(
    pytester: pytest.Pytester, run_apart: Run
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import os
        import signal
        import subprocess
        from tickrig.host import RrcClient

        def stand_still():
            wake = f"sleep 0.2; kill -CONT {os.getpid()}"
            with subprocess.Popen(["sh", "-c", wake]):
                os.kill(os.getpid(), signal.SIGSTOP)

        def test_fails(bench):
            with RrcClient(bench.link) as client:
                client.start()
                stand_still()
                bench.run_for("20ms")
                assert bench.get("state") == "Lost"

        def test_passes(bench):
            bench.run_for("20ms")
            stand_still()
            bench.run_for("20ms")
        """
    )
    result = run_apart("--bench-mode", "real", "--junitxml=out.xml")
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines(
        ["*- bench: blocked -*", "the machine was too slow: host up to * ms, emulator up to * late"]
    )
    suite = Xml.parse(pytester.path / "out.xml").find("testsuite")
    assert suite is not None
    assert (suite.get("errors"), suite.get("failures")) == ("1", "0")


STANDING_STILL = """
    import asyncio
    import os
    import signal
    import subprocess
    import pytest
    from tickrig.host import RrcClient

    @pytest.fixture
    def late(bench):
        bench.run_for("20ms")
        wake = f"sleep 0.2; kill -CONT {os.getpid()}"
        with subprocess.Popen(["sh", "-c", wake]):
            os.kill(os.getpid(), signal.SIGSTOP)
        bench.run_for("20ms")
        return bench
"""


@pytest.mark.realtime
def test_a_mistake_in_a_test_is_a_failure_on_a_slow_machine_too(
    pytester: pytest.Pytester, run_apart: Run
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        STANDING_STILL
        + """
    async def forgotten():
        pass

    @pytest.mark.parametrize("mistake", [
        lambda bench: bench.pres("power_button"),
        lambda bench: bench.set("stik", 1, 1),
        lambda bench: bench.set("gauge", "a lot"),
        lambda bench: bench.get("staet"),
        lambda bench: bench.get(),
        lambda bench: bench.wait_until(lambda: bench.get("staet") == "Lost", within="20ms"),
        lambda bench: bench.wait_until(lambda: True, within="20 fortnights"),
        lambda bench: bench.run_for("5"),
        lambda bench: bench.run_for(None),
        lambda bench: bench.fault("cutt"),
        lambda bench: bench.fault("cut@2s-1s"),
        lambda bench: bench.serial(bytesize=99),
        lambda bench: bench.serial(nonsense=1),
        lambda bench: bench.can_bus(),
        lambda bench: bench["nobody"],
        lambda bench: bench.run(asyncio.sleep(1)),
        lambda bench: forgotten(),
        lambda bench: benhc,
        lambda bench: __import__("tickrig.hosts"),
        lambda bench: exec("from tickrig import Bensh"),
        lambda bench: RrcClient(bench.link).outptu(),
        lambda bench: RrcClient(bench.link, "more", "and more"),
    ])
    def test_mistake(late, mistake):
        mistake(late)

    def test_no_such_fixture(late, bench_tiem):
        pass
    """
    )
    result = run_apart("--bench-mode", "real")
    result.stdout.no_fnmatch_line("*too slow*")
    result.assert_outcomes(failed=22, errors=1)


@pytest.mark.realtime
def test_what_a_host_makes_of_silence_is_no_failure_on_a_slow_machine(
    pytester: pytest.Pytester, run_apart: Run
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        STANDING_STILL
        + """
    @pytest.mark.parametrize("symptom", [
        lambda: None.data,
        lambda: None["state"],
        lambda: int(""),
        lambda: [][0],
        lambda: {}["state"],
        lambda: pytest.fail("nothing came"),
    ])
    def test_symptom(late, symptom):
        symptom()

    def test_assertion(late):
        assert late.get("state") == "Lost"

    def test_host(late):
        with RrcClient(late.link, timeout_us=1) as client:
            client.device()
    """
    )
    result = run_apart("--bench-mode", "real")
    result.assert_outcomes(errors=8)


@pytest.mark.realtime
def test_a_bench_that_broke_down_is_told(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import pytest
        from tickrig.device import Rrc

        class Broken(Rrc):
            def tick(self, now_us, rx):
                if now_us > 5_000:
                    raise ZeroDivisionError("the device is broken")
                return super().tick(now_us, rx)

        @pytest.fixture
        def bench_config():
            return Broken()

        def test_it_is_waited_for(bench):
            bench.run_for("1s")

        def test_nobody_asks(bench):
            bench.link.send(b"hello\\n")
            while bench._mode._thread.running:
                pass
            assert 0

        def test_all_is_well(bench):
            pass
        """
    )
    result = run("--bench-mode", "real")
    outcomes = result.parseoutcomes()
    assert outcomes["passed"] == 1
    assert outcomes.get("failed", 0) + outcomes.get("errors", 0) == 2  # on a slow machine: errors
    result.stdout.fnmatch_lines_random(
        ["*ZeroDivisionError: the device is broken", "it is broken: *the device is broken*"]
    )


@pytest.mark.realtime
def test_a_host_that_does_not_read_loses_bytes(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import pytest

        def overflow(bench):
            (port,) = bench._mode.act(lambda rig: rig.ports["rrc"])
            bench._mode.act(lambda rig: port.send(0, bytes(5_000)))  # more than it keeps

        def talk(bench):
            with bench.serial(timeout=5) as host:
                host.write(b"device\\n")
                assert host.read_until(b"RRC\\n").endswith(b"RRC\\n")

        def test_unread(bench):
            talk(bench)
            overflow(bench)

        @pytest.mark.allows("lost")
        def test_allowed(bench):
            talk(bench)
            overflow(bench)

        def test_nobody_there(bench):
            overflow(bench)
        """
    )
    result = run("--bench-mode", "real")
    skip_if_too_slow(result)
    result.assert_outcomes(passed=2, failed=1)
    result.stdout.fnmatch_lines(["rrc: 5000 bytes dropped at its port: the host did not read"])
