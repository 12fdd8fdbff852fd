"""`acu-daemon replay`: recorded readings through the daemon's own fit and prediction."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from acu_daemon.assist.estimator import ESTIMATORS
from acu_daemon.cli.options import Config, Satellite, load_target
from acu_daemon.config import estimator_settings
from acu_daemon.control.refit import RefitSetup
from acu_daemon.control.replay import Replayed, replay
from acu_daemon.edge.recording import read_readings
from acu_daemon.errors import UsageError


def command(
    config: Config,
    satellite: Satellite,
    readings: Annotated[
        Path, typer.Option("--readings", metavar="IN.csv", help="Recorded readings: utc,az_deg,el_deg,locked.")
    ],
    out: Annotated[
        Path, typer.Option("--out", metavar="OUT.csv", help="Predictions: utc,az_deg,el_deg,sigma_deg,source.")
    ],
    estimator: Annotated[
        str | None,
        typer.Option("--estimator", metavar="E", help=f"{', '.join(ESTIMATORS)}.  Default: the satellite's TOML."),
    ] = None,
) -> None:
    """Predict every recorded instant from the locked readings before it, as the daemon would have.

    Readings: any rate from 0.2 Hz up; `locked` is the raw flag, 0 or 1; angles may be empty where it is 0.
    """
    if out.exists() and readings.exists() and out.samefile(readings):
        raise UsageError(f"--out {out} is the recording itself; give the predictions a file of their own")
    lines = read_readings(readings)
    if not lines:
        raise UsageError(f"{readings}: no readings below the header")
    target = load_target(config, satellite, lines[0][2])
    name = estimator or target.station.tracking.estimator
    for warning in target.elements.warnings:
        typer.echo(f"warning: {warning}", err=True)
    setup = RefitSetup(
        target.elements.propagator,
        target.station.site,
        name,
        estimator_settings(target.station, target.satellite),
        target.station.acu.azimuth.limits(),
    )
    on_progress = _progress(len(lines)) if sys.stderr.isatty() else None
    results = replay(
        setup, [(tai_s, one) for _, one, tai_s in lines], target.station.receiver.lock_dwell_s, on_progress
    )
    rows = ["utc,az_deg,el_deg,sigma_deg,source"]
    rows += [_row(utc, result) for (utc, _, _), result in zip(lines, results, strict=True)]
    try:
        out.write_text("\n".join(rows) + "\n", encoding="ascii")
    except OSError as error:
        raise UsageError(f"--out {out}: {error.strerror}") from None
    if on_progress is not None:
        typer.echo(f"\r\033[K{len(lines)} lines written to {out}", err=True)


def _row(utc: str, result: Replayed) -> str:
    sigma = "" if result.sigma_deg is None else f"{result.sigma_deg:.5f}"
    az = f"{result.az_deg:.5f}"
    return f"{utc},{'0.00000' if az == '360.00000' else az},{result.el_deg:.5f},{sigma},{result.source}"


def _progress(total: int) -> Callable[[int], None]:
    def show(count: int) -> None:
        typer.echo(f"\r\033[Kreplay {count / total:4.0%}", err=True, nl=False)

    return show
