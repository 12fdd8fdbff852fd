"""`acu-daemon run` without a satellite: one process for the station's passes, rests and moves."""

import asyncio
import gc
import os
import signal
from dataclasses import asdict

import structlog

from acu_daemon.cli.options import Target
from acu_daemon.cli.station_runs import StationRuns
from acu_daemon.cli.station_setup import StationSetup
from acu_daemon.daemon.live import LiveLine
from acu_daemon.daemon.service import Outcome
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.control_socket import ControlSocket
from acu_daemon.edge.logs import tell_loop_problem, tell_signal
from acu_daemon.edge.signals import take_signals


async def run_station(setup: StationSetup, clock: SystemClock, first: Target, live: LiveLine | None) -> Outcome:
    """Run the station until SIGTERM or --duration.

    SIGHUP reads the files again, where no terminal belongs to this process; with one it is a safe stop, as ever.
    """
    runs = StationRuns(setup, first, live)
    loop = asyncio.get_running_loop()
    loop.set_exception_handler(tell_loop_problem)
    take_signals(loop, runs.stop, tell_signal)
    if not _has_terminal():
        loop.add_signal_handler(signal.SIGHUP, runs.day.ask_reload)
    control = ControlSocket(setup.directory, runs.outlets.counted(runs.answer))
    await control.open()
    await runs.outlets.open()
    await runs.page.open()
    await runs.day.wind.open()
    sync = asyncio.create_task(clock.watch_synchronisation())
    try:
        await runs.day.keeper.first_plan()
        gc.freeze()
        outcome = await runs.run()
        structlog.get_logger("station").info("station.done", **asdict(outcome))
        return outcome
    finally:
        sync.cancel()
        await control.close()
        await runs.page.close()
        await runs.outlets.close()
        await runs.close()
        if live is not None:
            live.clear()
        clock.close()


def _has_terminal() -> bool:
    try:
        os.close(os.open("/dev/tty", os.O_RDWR | os.O_NOCTTY))
    except OSError:
        return False
    return True
