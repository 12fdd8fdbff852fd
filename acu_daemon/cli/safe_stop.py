"""`acu-daemon safe-stop`: stop the antenna once, without a daemon; what the service runs at its end."""

import asyncio
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from acu_daemon.cli.options import Config
from acu_daemon.config.load import load_station
from acu_daemon.config.station_tables import StationFile
from acu_daemon.config.to_settings import driver_of
from acu_daemon.daemon.port import AcuPort
from acu_daemon.daemon.stopping import DEADLINE_S, stop_antenna
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.event_loop import run_loop
from acu_daemon.edge.link import make_link
from acu_daemon.edge.logs import configure_logs
from acu_daemon.errors import NoAcuError

NOT_RESTARTED = "2"  # RestartPreventExitStatus= of the unit: a refused configuration
FINAL = "final"  # the file in $RUNTIME_DIRECTORY that says: this stop was asked for, nothing starts again after it


def command(
    config: Config,
    after_service: Annotated[
        bool,
        typer.Option(
            "--after-service",
            help="For ExecStopPost= of the service: do nothing after a clean end, nor between a crash and its restart.",
        ),
    ] = False,
) -> None:
    """Stop the antenna: STOP is sent until the ACU acknowledges it, then the register watchdog is cleared.

    For the end of a service whose daemon could not stop the antenna itself, and for a person in a hurry while no daemon
    runs (a running one holds the ACU: stop it instead, it does the same).  An antenna under the local panel, stowed or
    in fault is left alone.

    Exit status: 0 stopped or left alone; 1 not acknowledged; 2 wrong use or configuration; 3 no ACU within 5 s.
    """
    if after_service and (reason := why_not(os.environ)):
        typer.echo(f"safe-stop: {reason}")
        return
    if not run_loop(_stop, load_station(config)):
        raise typer.Exit(1)


def why_not(environment: Mapping[str, str]) -> str:
    """Why an ended service needs no safe stop; empty: it does (systemd.exec(5), $SERVICE_RESULT)."""
    result, status = environment.get("SERVICE_RESULT", ""), environment.get("EXIT_STATUS", "")
    if result == "exit-code" and status == NOT_RESTARTED:
        return ""
    if result == "success" and environment.get("EXIT_CODE") == "killed":
        return ""  # by the signal of a stop, while it started: its predecessor may have left the antenna moving
    if result == "success":
        return "the daemon ended by itself: its STOP was acknowledged, or it did not hold the antenna"
    if not (Path(environment.get("RUNTIME_DIRECTORY", "/nonexistent")) / FINAL).exists():
        return f"the daemon ended by {result or 'an unknown cause'} and is started again: a stop would end an autotrack"
    return ""


async def _stop(station: StationFile) -> bool:
    clock = SystemClock()
    configure_logs(clock.tai_s, tags={}, is_terminal=sys.stdout.isatty())
    acu = station.acu
    port = AcuPort(make_link(acu.url), clock, driver_of(station), acu.period_s, acu.device_delay_s)
    begun_s, keeper = clock.monotonic_s(), asyncio.create_task(port.keep())
    try:
        async with asyncio.timeout(DEADLINE_S):
            await port.wait_until_up()
        clears_watchdog = station.safety.register_watchdog_s > 0.0
        left_s = DEADLINE_S + begun_s - clock.monotonic_s()
        return await stop_antenna(port, left_s, clears_watchdog=clears_watchdog)
    except TimeoutError:
        why = port.problem or "no answer"
        raise NoAcuError(f"no ACU within {DEADLINE_S:g} s: {why}; look at the antenna") from None
    finally:
        keeper.cancel()
        await asyncio.gather(keeper, return_exceptions=True)
        clock.close()
