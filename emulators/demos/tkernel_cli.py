"""The command `tickrig demo tkernel`."""

from __future__ import annotations

import click

from tickrig.host.cli.start import load, loading


@click.command()
@click.option("--no-caches", is_flag=True, help="Entries of the caches do not outlive the outage.")
def tkernel(no_caches: bool) -> None:
    """Let a robot keep its position by ucodes while the service that resolves them is gone.

    A cart of Reference Hardware 3 with worn wheels drives along a corridor
    with infra-red markers; a node on T-Kernel reads their ucodes. On the way
    back the resolution service is unreachable, and the caches of the node go
    on. In virtual time: the same lines each time.
    """
    with loading():
        run_demo = load("tickrig.emulators.demos.tkernel:run_demo")
        stage_type = load("tickrig.emulators.demos.tkernel:CorridorStage")
    run_demo(stage_type(caches=not no_caches), click.echo)
