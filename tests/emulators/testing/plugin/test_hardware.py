"""Real devices: here an emulated one at a pty, that nobody but the operator can get at."""

from __future__ import annotations

import pytest

from tests.emulators.testing.plugin.conftest import Run, skip_if_too_slow
from tests.host.live import live_rrc, pty
from tickrig.emulators.testing.report.report_file import read_run

pytest_plugins = ("pytester",)


@pytest.mark.realtime
def test_tests_run_on_real_devices(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import pytest
        from tickrig.host import RrcClient

        def test_answer(bench):
            with RrcClient(bench.link) as client:
                client.start()

        def test_answer_and_fail(bench):
            bench.link.send(b"hello\\n")
            bench.run_for("100ms")
            assert 0

        @pytest.mark.needs("virtual")
        def test_virtual(bench):
            pass

        @pytest.mark.needs("device:rrc", "input:stick", "fault:bus_unplugged")
        def test_twin(bench):
            bench.fork()
        """
    )
    with pty() as port, live_rrc(port):
        text = f'[device.rrc]\ntype = "rrc"\n[hardware.rrc]\nport = "{port.path}"\n'
        pytester.makefile(".toml", rig=text)
        options = ("--bench", "rig.toml", "--bench-mode", "hardware")
        result = run(*options, "--bench-report", "run.json", "--bench-artifacts", "kept")
    skip_if_too_slow(result)
    result.assert_outcomes(passed=1, failed=1, skipped=2)
    result.stdout.fnmatch_lines(
        [
            "rig.toml with rrc; hardware, seed 0, * s old",
            "*rrc > hello",
            "pytest *::test_answer_and_fail --bench rig.toml --bench-mode hardware",
            "kept/*.txt",
            "SKIPPED *needs virtual, and this bench is hardware",
            "SKIPPED *real devices have no twins",
        ]
    )
    tests = read_run(pytester.path / "run.json").tests
    assert [test.mode for test in tests] == ["hardware"] * 4


def test_an_error_frame_of_a_real_bus_fails_the_test(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makefile(
        ".toml",
        rig="""
        [device.drive]
        type = "epos"
        node_id = 5
        [hardware.can]
        interface = "virtual"
        channel = "error frames"
        """,
    )
    pytester.makepyfile(
        """
        import can
        import pytest

        def disturb(bench):
            host = bench.can_bus()
            with can.Bus("error frames", "virtual") as drive:
                drive.send(can.Message(arbitration_id=0x88, data=b"\\0\\0\\4", is_error_frame=True))
            host.recv(0)

        def test_disturbed(bench):
            disturb(bench)

        @pytest.mark.allows("error frames")
        def test_allowed(bench):
            disturb(bench)

        def test_quiet(bench):
            bench.can_bus().recv(0)
        """
    )
    result = run("--bench", "rig.toml", "--bench-mode", "hardware")
    skip_if_too_slow(result)
    result.assert_outcomes(passed=2, failed=1)
    result.stdout.fnmatch_lines(["can: an error frame that no fault ordered, at * bit stuffing*"])
