"""`acu-daemon groundtrack from-passes`: D of a satellite from this station's own recordings."""

import json
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from acu_daemon.assist.reading_gate import Dwell
from acu_daemon.assist.session.refit import RefitSetup
from acu_daemon.cli.groundtrack_elements import AsJson, Csv, CycleText, Plot, parsed_cycle, write_csv
from acu_daemon.cli.options import Config, Satellite, load_target
from acu_daemon.cli.outputs import refuse_no_picture, refuse_unwritable
from acu_daemon.config.to_settings import estimator_settings
from acu_daemon.edge.campaign import progress_bar
from acu_daemon.edge.flux_file import load_flux
from acu_daemon.edge.recording import read_readings
from acu_daemon.errors import OrbitError, UsageError
from acu_daemon.groundtrack.environment import Flux, Spacecraft
from acu_daemon.groundtrack.history import History, history_of
from acu_daemon.groundtrack.kinks import FoundManoeuvre, find_manoeuvres
from acu_daemon.groundtrack.lunisolar import sun
from acu_daemon.groundtrack.outlook import Outlook, outlook
from acu_daemon.groundtrack.seen_pass import SeenPass, seen_pass
from acu_daemon.model import Reading, Readings
from acu_daemon.orbit.timescales import gmst_rad, utc_text
from acu_daemon.units import DAY_S

PASS_GAP_S = 1200.0  # without readings: another pass
LEAST_READINGS = 30
REAL_BALLISTIC_M2_KG = 0.022  # of a CBERS: Cd A / m
DEFAULT_KP = 2.0


def command(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="Recordings of `run --record`, a file or more of each pass.")
    ],
    config: Config,
    satellite: Satellite,
    cycle: CycleText = None,
    flux: Annotated[
        str,
        typer.Option(
            "--flux", help="F10.7 in sfu, taken as constant; or a CSV file date,f107_sfu,kp that covers the passes."
        ),
    ] = "120",
    ballistic_m2_kg: Annotated[
        float, typer.Option("--ballistic", min=1e-4, max=1.0, help="Cd A / m, m2/kg: the drag factor is against it.")
    ] = REAL_BALLISTIC_M2_KG,
    limit_m: Annotated[
        float | None,
        typer.Option(
            "--limit-m",
            min=-1e6,
            max=1e6,
            help="D at which the next manoeuvre comes.  Default: where the last ones were made.",
        ),
    ] = None,
    csv: Csv = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Show how a phased satellite's ground track moved, from passes over this station, and when it will manoeuvre.

    Every pass is fitted again, with the elements of its date, as `replay` does it; D is taken where that orbit crosses
    the equator, with the fit's own sigma.  D is in metres, east positive, less its median.
    """
    refuse_unwritable(csv)
    refuse_no_picture(plot)
    chosen_cycle, of_sun = parsed_cycle(cycle), _flux(flux)
    seen = _seen(directory, config, satellite)
    history, gaps = history_of([one.crossing for one in seen], [one.mean for one in seen], chosen_cycle)
    for text in [*gaps, *_outside(of_sun, history)]:
        typer.echo(f"warning: {text}", err=True)
    sigma_m = np.array([one.sigma_m for one in seen])
    found = find_manoeuvres(history)
    craft = Spacecraft(history.reference, ballistic_m2_kg, _node_hour(seen[-1]))
    ahead = outlook(craft, of_sun, history, sigma_m, found, limit_m)
    if csv is not None:
        points = zip(history.tai_s, history.d_m, sigma_m, strict=True)
        write_csv(csv, "utc,d_m,sigma_m", [f"{utc_text(t)},{d:.1f},{s:.1f}" for t, d, s in points])
    if as_json:
        typer.echo(json.dumps(_as_object(satellite, history, sigma_m, found, ahead), indent=1))
    else:
        _print(satellite, history, sigma_m, found, ahead)
    if plot is not None:
        from acu_daemon.report.groundtrack_plot import plot_outlook

        plot_outlook(plot, history, sigma_m, found, ahead, satellite)


def _seen(directory: Path, config: Path, satellite: str) -> list[SeenPass]:
    """Every pass of the recordings that a fit can be made of, oldest first."""
    if not directory.is_dir():
        raise UsageError(f"{directory}: there is no such directory of recordings")
    passes = sorted(_passes(directory), key=lambda one: one[1][0].tai_s)
    seen: list[SeenPass] = []
    with progress_bar("passes") as on_done:
        for count, (path, readings) in enumerate(passes, start=1):
            if on_done is not None:
                on_done(count, len(passes))
            where = f"{path.name}, pass of {utc_text(readings[0].tai_s, 0)}"
            try:
                found = _fitted(config, satellite, readings)
            except OrbitError as error:
                found = str(error)
            if isinstance(found, str):
                typer.echo(f"warning: {where}: left out: {found}", err=True)
            else:
                seen.append(found)
    if not passes:
        raise UsageError(f"{directory}: no recording (*.csv with utc,az_deg,el_deg,locked) with a pass in it")
    ordered = sorted(seen, key=lambda one: one.crossing.tai_s)
    return [one for k, one in enumerate(ordered) if k == 0 or one.crossing.tai_s - ordered[k - 1].crossing.tai_s > 60.0]


def _passes(directory: Path) -> Iterator[tuple[Path, list[Reading]]]:
    """The locked readings of every pass in the recordings; files that are no recordings are named."""
    for path in sorted(directory.glob("*.csv")):
        try:
            lines = read_readings(path, lambda said: typer.echo(f"warning: {said}", err=True))
        except UsageError as error:
            typer.echo(f"warning: left out: {error}", err=True)
            continue
        locked = [reading for _, reading, _ in lines if reading is not None and reading.is_locked]
        ends = [k for k, (one, other) in enumerate(pairwise(locked), start=1) if other.tai_s - one.tai_s > PASS_GAP_S]
        for start, end in pairwise([0, *ends, len(locked)]):
            if end - start >= LEAST_READINGS:
                yield path, locked[start:end]
            elif end > start:
                typer.echo(f"warning: {path.name}: {end - start} locked readings are too few for a fit", err=True)


def _fitted(config: Path, satellite: str, readings: list[Reading]) -> SeenPass | str:
    target = load_target(config, satellite, readings[0].tai_s, is_strict=False)
    if target.elements.errors:
        return target.elements.errors[0]
    dwell = Dwell(target.station.receiver.lock_dwell_s)
    kept = [one for one in readings if dwell.is_locked(one)]
    if len(kept) < LEAST_READINGS:
        return f"{len(kept)} readings after the dwell are too few for a fit"
    setup = RefitSetup(
        target.elements.propagator,
        target.station.site,
        "full",
        estimator_settings(target.station, target.satellite),
        target.station.acu.azimuth.limits(),
    )
    return seen_pass(setup, Readings.of(kept))


def _flux(text: str) -> Flux:
    """A constant flux over all times, or a file's."""
    try:
        flux = float(text)
    except ValueError:
        return load_flux(text)
    if not 50.0 <= flux <= 400.0:
        raise UsageError(f"--flux {text}: expected sfu, 50 to 400")
    century = np.full(36525, flux)
    return Flux(0.0, century, np.full(century.size, DEFAULT_KP))


def _outside(flux: Flux, history: History) -> list[str]:
    first, last = float(history.tai_s[0]), float(history.tai_s[-1])
    if flux.start_tai_s <= first and last <= flux.end_tai_s:
        return []
    covered = f"{utc_text(flux.start_tai_s, 0)} to {utc_text(flux.end_tai_s, 0)}"
    return [
        f"--flux covers {covered}, the passes are of {utc_text(first, 0)} to {utc_text(last, 0)}: the edge is taken"
    ]


def _node_hour(seen: SeenPass) -> float:
    """Local time of the ascending node by the true sun, hours."""
    when = np.array([seen.crossing.tai_s])
    x, y, _ = sun(when).direction[0]
    node = float(gmst_rad(when, 0.0)[0]) + seen.crossing.longitude_rad
    return float(((node - np.arctan2(y, x)) * 12.0 / np.pi + 12.0) % 24.0)


def _as_object(
    satellite: str, history: History, sigma_m: Any, found: list[FoundManoeuvre], ahead: Outlook
) -> dict[str, Any]:
    cycle = history.reference.cycle
    return {
        "satellite": satellite,
        "cycle_revolutions": cycle.revolutions,
        "cycle_days": cycle.days,
        "d": [
            {"utc": utc_text(t), "d_m": round(float(d), 1), "sigma_m": round(float(s), 1)}
            for t, d, s in zip(history.tai_s, history.d_m, sigma_m, strict=True)
        ],
        "manoeuvres": [
            {"utc": utc_text(one.tai_s), "delta_a_m": round(one.delta_a_m, 2), "sigma_m": round(one.sigma_m, 2)}
            for one in found
        ],
        "at_utc": utc_text(ahead.tai_s),
        "d_m": round(ahead.d_m, 1),
        "d_sigma_m": round(ahead.d_sigma_m, 1),
        "rate_m_day": round(ahead.rate_m_day, 2),
        "rate_sigma_m_day": round(ahead.rate_sigma_m_day, 2),
        "drag_factor": round(ahead.drag_factor, 3),
        "drag_factor_sigma": round(ahead.drag_factor_sigma, 3),
        "limit_m": None if ahead.limit_m is None else round(ahead.limit_m, 1),
        "next_manoeuvre_utc": None if ahead.next_tai_s is None else utc_text(ahead.next_tai_s, 0),
        "next_manoeuvre_sigma_days": None if ahead.next_tai_s is None else round(ahead.next_sigma_days, 2),
    }


def _print(satellite: str, history: History, sigma_m: Any, found: list[FoundManoeuvre], ahead: Outlook) -> None:
    cycle = history.reference.cycle
    typer.echo(
        f"{satellite}: {history.tai_s.size} passes, {utc_text(history.tai_s[0], 0)} to "
        f"{utc_text(history.tai_s[-1], 0)}; cycle of {cycle.revolutions} revolutions in {cycle.days} days"
    )
    for t, d, s in zip(history.tai_s, history.d_m, sigma_m, strict=True):
        typer.echo(f"{utc_text(t, 0)}  D {d:+8.0f} m  +- {s:.0f}")
    for one in found:
        typer.echo(f"{utc_text(one.tai_s, 0)}  manoeuvre {one.delta_a_m:+.1f} m  +- {one.sigma_m:.1f}")
    typer.echo(
        f"at {utc_text(ahead.tai_s, 0)}: D {ahead.d_m:+.0f} +- {ahead.d_sigma_m:.0f} m, "
        f"dD/dt {ahead.rate_m_day:+.1f} +- {ahead.rate_sigma_m_day:.1f} m/day, "
        f"drag {ahead.drag_factor:.2f} +- {ahead.drag_factor_sigma:.2f} of the model's"
    )
    if ahead.next_tai_s is not None:
        typer.echo(
            f"D reaches {ahead.limit_m:+.0f} m, where the next manoeuvre comes, on "
            f"{utc_text(ahead.next_tai_s, 0)[:10]} +- {ahead.next_sigma_days:.1f} days"
        )
    elif ahead.limit_m is None:
        typer.echo("no manoeuvre was seen; say with --limit-m at which D the next one is expected")
    else:
        days = (ahead.ahead_tai_s[-1] - ahead.tai_s) / DAY_S if ahead.ahead_tai_s.size else 0.0
        typer.echo(f"D does not reach {ahead.limit_m:+.0f} m within {days:.0f} days")
