"""`acu-daemon mount`: what the station remembers of its antenna: shown, made of recordings, forgotten."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from acu_daemon.assist.mount_memory.mount_fit import RecordedPass, fit_mount
from acu_daemon.assist.session.estimator_comparison import locked_readings
from acu_daemon.cli.options import Config, antenna_of, load_target, whose_recording
from acu_daemon.cli.outputs import refuse_no_picture
from acu_daemon.config.load import load_station, satellite_names
from acu_daemon.config.station_tables import StationFile
from acu_daemon.config.to_settings import estimator_settings, pedestal_text
from acu_daemon.edge.control_socket import ask
from acu_daemon.edge.mount_memory_file import MOUNT, mount_files, read_mount_file, to_json
from acu_daemon.edge.recording import read_readings
from acu_daemon.edge.recording_whose import read_whose
from acu_daemon.edge.state_directory import older_folders, state_path
from acu_daemon.errors import AcuDaemonError, UsageError
from acu_daemon.pointing.mount import TERMS
from acu_daemon.report.mount_text import (
    pass_lines,
    plot_drift,
    plot_residuals,
    residual_lines,
    terms_lines,
    toml_lines,
)

State = Annotated[
    Path | None,
    typer.Option("--state", metavar="DIR", help="The --state of `run`.  Default: as of `run`."),
]
Rehearsal = Annotated[bool, typer.Option("--rehearsal", help="What rehearsals remember: they have their own.")]


def show(
    config: Config,
    state: State = None,
    rehearsal: Rehearsal = False,
    picture: Annotated[
        Path | None, typer.Option("--plot", metavar="OUT.png", help="Draw IA and IE of every pass over time.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="The file as it is, with its newest pass in it.")] = False,
) -> None:
    """Show the terms of the mount, their sigmas, which of them the passes tell, and the passes.

    Exit status: 0; 1 nothing is remembered yet, or it is of another pedestal; 2 wrong use or configuration.
    """
    refuse_no_picture(picture)
    station = load_station(config)
    path = _files(station, state, is_rehearsal=rehearsal)[0]
    settings = estimator_settings(station, None)
    kept = read_mount_file(path, pedestal_text(station))
    if kept is None:
        raise AcuDaemonError(f"{path}: nothing is remembered of this antenna; `run` begins with its first whole pass")
    kept, _ = kept.settled(settings)
    if as_json:
        typer.echo(json.dumps(to_json(kept)))
    else:
        count, last = kept.memory.pass_count, kept.rows[-1].utc if kept.rows else "never"
        head = f"{station.station.name}: {count} passes are remembered, the last of {last}"
        typer.echo("\n".join([head, *terms_lines(kept.memory, settings), *pass_lines(kept.rows)]))
    if picture is not None:
        plot_drift(picture, kept.rows, f"{station.station.name}: zero points of the encoders, pass by pass")


def fit(
    config: Config,
    recordings: Annotated[
        list[Path], typer.Argument(metavar="RECORDING...", help="CSV files of `run --record`, with their JSON.")
    ],
    satellite: Annotated[
        str | None,
        typer.Option("--satellite", metavar="NAME", help="Of recordings that have no JSON.  Default: as it says."),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option("--plot", metavar="OUT.png", help="Draw the residuals before and after.")
    ] = None,
) -> None:
    """Fit the mount's terms to recorded passes, of whatever satellites, and say what to put into [mount].

    Ten passes over much of the sky tell all terms; three tell the sums that matter.  Nothing is changed: neither the
    configuration nor what `run` remembers.

    Exit status: 0; 1 the passes tell nothing; 2 wrong use or configuration.
    """
    refuse_no_picture(picture)
    station = load_station(config)
    passes = sorted((_recorded(config, one, satellite) for one in recordings), key=lambda one: one.readings.tai_s[0])

    def on_done(count: int) -> None:
        if sys.stderr.isatty():
            typer.echo(f"\r\033[Kpass {count} of {len(passes)}", err=True, nl=count == len(passes))

    try:
        memory, fitted = fit_mount(passes, on_done)
    except ValueError as error:
        raise AcuDaemonError(f"{error}: at least a minute of each pass is needed") from None
    settings = estimator_settings(station, None)
    typer.echo("\n".join([*terms_lines(memory, settings), "", *residual_lines(fitted)]))
    if picture is not None:
        plot_residuals(picture, fitted, f"{station.station.name}: what the best orbits leave of {len(fitted)} passes")
    if memory.pass_count == 0:
        raise AcuDaemonError("no pass tells anything of the mount; the reasons stand beside them")
    given_deg = dict(zip(TERMS, station.mount.mount().terms_deg().tolist(), strict=True))
    typer.echo("\nto have it in every command, from the first second of a pass on, put this into station.toml:\n")
    typer.echo("\n".join(toml_lines(memory, settings, given_deg)))


def forget(config: Config, state: State = None, rehearsal: Rehearsal = False) -> None:
    """Forget what is remembered of the antenna, as after work on it.  Stop `run` first.

    Exit status: 0 forgotten, or nothing was remembered; 1 a daemon runs that would write it again; 2 wrong use.
    """
    for path in _files(load_station(config), state, is_rehearsal=rehearsal):
        try:
            ask(path.parent, "status")
        except AcuDaemonError:
            pass
        else:
            raise AcuDaemonError(f"{path.parent}: a daemon runs, and would write it again: stop it first")
        try:
            path.unlink()
        except FileNotFoundError:
            typer.echo(f"{path}: nothing was remembered")
        except OSError as error:
            raise UsageError(f"{path}: {error.strerror}") from None
        else:
            typer.echo(f"{path}: forgotten")


def _files(station: StationFile, state: Path | None, *, is_rehearsal: bool) -> list[Path]:
    """The antenna's files, the newest first; where there is none, where it would be."""
    base, antenna = state_path(state, is_rehearsal=is_rehearsal), antenna_of(station)
    folder = antenna.folder(base)
    return mount_files(folder, () if is_rehearsal else older_folders(base, antenna)) or [folder / MOUNT]


def _recorded(config: Path, path: Path, satellite: str | None) -> RecordedPass:
    """A recording as a pass to fit.  UsageError: whose it is, or that there is nothing in it."""
    lines = read_readings(path, lambda said: typer.echo(f"warning: {said}", err=True))
    if not lines:
        raise UsageError(f"{path}: no readings below the header")
    name = satellite or _satellite_of(config, path, lines[0][2])
    target = load_target(config, name, lines[0][2])
    station = target.station
    readings = locked_readings([(tai_s, one) for _, one, tai_s in lines], station.receiver.lock_dwell_s)
    if len(readings) == 0:
        raise UsageError(f"{path}: no locked readings: leave it out")
    settings = estimator_settings(station, target.satellite)
    label = f"{path.name}, {target.elements.label}"
    return RecordedPass(label, target.elements.propagator, station.site, settings, readings)


def _satellite_of(config: Path, path: Path, tai_s: float) -> str:
    """The NAME of the satellite that the JSON beside a recording tells.  UsageError: it tells none of these."""
    try:
        said = read_whose(path)
    except ValueError as error:
        raise UsageError(f"{path}: {error}; name its satellite with --satellite") from None
    if said is None:
        raise UsageError(f"{path} does not say whose it is: name its satellite with --satellite")
    names = satellite_names(config)
    for name in names:
        try:
            asked = whose_recording(load_target(config, name, tai_s, is_strict=False), is_rehearsal=said.is_rehearsal)
        except AcuDaemonError:
            continue
        if said.is_of_satellite(asked) and said.is_at_station(asked):
            return name
    raise UsageError(f"{path} is of {said}: none of {', '.join(names) or 'no satellites'} in {config}")
