"""`acu-daemon report`: the report of a pass, made from its recording, and the index of a station's passes."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from acu_daemon.cli.outputs import refuse_unwritable
from acu_daemon.cli.pass_messages import write_messages
from acu_daemon.cli.pass_record import read_record
from acu_daemon.cli.replay_wire import ReplayedPass, replay_pass
from acu_daemon.edge.tape_file import SUFFIX, tapes_in
from acu_daemon.edge.writer import replace_file
from acu_daemon.errors import UsageError
from acu_daemon.report.pass_figures import pass_figures
from acu_daemon.report.pass_page import pass_page
from acu_daemon.report.pass_station import station_figures
from acu_daemon.report.pass_watch import PassWatch
from acu_daemon.report.passes_index import MOST_ROWS, index_figures, index_page

INDEX = "index"


def command(
    recordings: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="Recordings of passes, or the directory in which they are.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Where the reports go.  Default: beside each recording.")
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option("--config", help="The station's directory, for a [recording] send_to that stands beside it."),
    ] = None,
) -> None:
    """Make the report of recorded passes: FILE.html and FILE.json, and index.html with all reports of the directory.

    The page has no outside parts; every figure on it is in the JSON.

    Exit status: 0; 1 a recording does not replay as the daemon decided, so that its report may be wrong, or is damaged;
    2 wrong use, or there is none of one of them: those of all others are made.
    """
    files = [path for given in recordings for path in _recordings(given)]
    if not files:
        typer.echo(f"no recordings (*{SUFFIX}) there", err=True)
        raise typer.Exit(2)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    status = max(_report(path, out or path.parent, config) for path in files)
    for folder in {out or path.parent for path in files}:
        typer.echo(write_index(folder))
    if status:
        raise typer.Exit(status)


def _recordings(given: Path) -> list[Path]:
    return tapes_in(given) if given.is_dir() else [given]


def _report(path: Path, folder: Path, config: Path | None) -> int:
    """Make one, and say where, or what is wrong with it; the exit status."""
    try:
        done, page = make_report(path, folder, config)
    except UsageError as error:  # such as a recording of a daemon that was killed before its first line
        typer.echo(f"no report: {error}", err=True)
        return 2
    typer.echo(page)
    if done.torn:
        typer.echo(f"{path}: {done.torn}", err=True)
    if done.difference is not None:
        typer.echo(f"{path}: the replay decides otherwise: {done.difference}", err=True)
    return 1 if done.torn or done.difference is not None else 0


def make_report(path: Path, folder: Path, config: Path | None = None) -> tuple[ReplayedPass, Path]:
    """Replay a recording, and write what it shows, with its messages.

    UsageError: it is no recording, or the report cannot be written.
    """
    watch = PassWatch()
    done = replay_pass(path, watch)
    target = done.taped.target
    figures = pass_figures(done.taped.job, target.station, target.satellite, watch, is_whole=done.is_whole)
    figures["replay"] = {
        "is_same": done.difference is None,
        "difference": None if done.difference is None else str(done.difference),
    }
    record = read_record(path)
    figures["station"] = None if record is None else station_figures(record, done.taped.job, watch)
    if record is not None:
        figures["hooks"] = list(record.hooks)  # of the recording: those that had ended when it was closed
    name = path.name.removesuffix(SUFFIX)
    page, data = folder / f"{name}.html", folder / f"{name}.json"
    refuse_unwritable(page, data)
    replace_file(data, f"{json.dumps(figures, allow_nan=False)}\n".encode())
    replace_file(page, pass_page(figures).encode())
    write_messages(done.taped, watch, folder, name, config)
    return done, page


def write_index(folder: Path) -> Path:
    """Write the page of all reports in a directory."""
    reports: list[tuple[str, dict[str, Any]]] = []
    for path in sorted(folder.glob("*.json"), reverse=True):
        if len(reports) == MOST_ROWS:
            break
        if path.stem == INDEX:
            continue
        try:
            read = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        if isinstance(read, dict) and "outcome" in read and "curves" in read:
            reports.append((path.stem, read))
    index = index_figures(reports[::-1])
    page = folder / f"{INDEX}.html"
    refuse_unwritable(page)
    replace_file(folder / f"{INDEX}.json", f"{json.dumps(index, allow_nan=False)}\n".encode())
    replace_file(page, index_page(index).encode())
    return page
