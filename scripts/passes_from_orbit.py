#!/usr/bin/env python3
"""Passes of a satellite over stations, cut out of an orbit file that a person has downloaded: CPF, SP3 or CCSDS OEM.

    scripts/passes_from_orbit.py jason3_cpf_180613_16401.cne --out passes
    scripts/passes_from_orbit.py stella.sp3.gz --object L56 --station Home,48.1,11.6,520 --out passes
    scripts/passes_from_orbit.py iss.oem --earth-orientation finals2000A.all --elements iss.tle --out passes

For each pass two files, SATELLITE-STATION-TIME.truth.csv (utc,az_deg,el_deg,range_km once a second, geometric: no
refraction, no light time, azimuth from true north) and .json (station, largest elevation, Earth orientation); with
--elements also .tle or .omm.json, the set that an operator would have had: the newest before the rise.  The daemon's
simulator flies such a truth (`acu-daemon fake-acu --truth`), and the figures of real passes are made from a folder of
them:  REAL_PASSES=passes .venv/bin/python scripts/figures.py.

Earth-fixed files (CPF, SP3, OEM in ITRF) need no Earth orientation.  Where to get them: predictions of the ILRS (CPF)
and orbits of the IDS, the ILRS and the IGS (SP3) at CDDIS and EDC, OEM of the ISS at NASA.
"""

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tables.console import say
from tables.outputs import output_folder

from acu_daemon.edge.earth_orientation_file import read_earth_orientation
from acu_daemon.edge.orbit_file import EPHEMERIS_PARSERS, SET_PARSERS, read_orbit_file
from acu_daemon.errors import AcuDaemonError, ElementsError, OrbitError
from acu_daemon.model import EarthOrientation, Pass, Site, Station
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.ephemeris import Ephemeris, EphemerisPropagator
from acu_daemon.orbit.look import Look, look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.selection import select_segments
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DAY_S, DEG, Array

STATIONS = (  # of the project's real passes
    Station("Huntsville", 34.73, -86.64, 190.0),
    Station("Cuiaba", -15.53, -56.07, 277.0),
    Station("CachoeiraPaulista", -22.683, -44.997, 570.0),
    Station("Svalbard", 78.23, 15.39, 450.0),
    Station("Wallops", 37.94, -75.46, 10.0),
    Station("AliceSprings", -23.76, 133.88, 550.0),
    Station("Tsukuba", 36.07, 140.13, 50.0),
)


@dataclass(frozen=True)
class Orbit:
    """What a file says, once it is read."""

    path: Path
    name: str
    propagator: EphemerisPropagator
    orientation: EarthOrientation


def station_of(text: str) -> Station:
    """NAME,LATITUDE,LONGITUDE,HEIGHT.  ArgumentTypeError: what was expected."""
    name, *numbers = text.split(",")
    try:
        latitude_deg, longitude_deg, height_m = (float(one) for one in numbers)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected NAME,LATITUDE,LONGITUDE,HEIGHT (deg, deg, m)") from None
    if not (name and abs(latitude_deg) <= 90.0 and -180.0 <= longitude_deg <= 360.0 and np.isfinite(height_m)):
        raise argparse.ArgumentTypeError(f"{text!r}: expected a name, -90 to 90, -180 to 360 deg and metres")
    return Station(name, latitude_deg, longitude_deg, height_m)


def read_orbit(path: Path, wanted: str | None, earth: Path | None) -> Orbit:
    """Read a file.  AcuDaemonError, OSError: it cannot be used."""
    kind, text = read_orbit_file(path)
    if kind not in EPHEMERIS_PARSERS:
        raise ElementsError(f"{path}: elements ({kind}); expected CPF, SP3 or OEM")
    segments, problems = EPHEMERIS_PARSERS[kind](text, str(path))
    for problem in problems[:5]:
        say(f"left out: {problem}")
    if not segments:
        raise ElementsError(f"{path}: no orbit in it can be read")
    labels = {one.label for one in segments}
    if wanted is None and len(labels) > 1:
        raise ElementsError(f"{path}: holds {', '.join(sorted(labels)[:8])}; say which by --object")
    if wanted is not None:
        segments, _ = select_segments(segments, None, wanted, is_whole=False)
    orientation = EarthOrientation()
    if earth is not None:
        used = read_earth_orientation(earth, segments[0].start_tai_s)
        orientation = used.orientation
        if used.warning:
            say(f"warning: {used.warning}")
    elif segments[0].frame != "ITRF":
        say(f"warning: {path} is inertial ({segments[0].frame}): without --earth-orientation up to 0.03 deg off")
    for segment in segments:
        for note in segment.notes:
            say(f"note: {note}")
    return Orbit(path, segments[0].name, EphemerisPropagator(Ephemeris(segments, orientation)), orientation)


def seconds_of(one: Pass) -> Array:
    """The whole seconds of UTC within a pass."""
    whole = np.arange(np.ceil(one.rise_tai_s), np.floor(one.set_tai_s) + 1.0)
    return whole[(whole >= one.rise_tai_s) & (whole <= one.set_tai_s)]


def write_truth(path: Path, tai_s: Array, seen: Look) -> None:
    """The truth CSV of docs/architecture.md."""
    rows = zip(tai_s.tolist(), seen.az_deg.tolist(), seen.el_deg.tolist(), (seen.range_m / 1e3).tolist(), strict=True)
    lines = [f"{utc_text(t)},{az:.5f},{el:.5f},{range_km:.4f}" for t, az, el, range_km in rows]
    path.write_text("\n".join(["utc,az_deg,el_deg,range_km", *lines, ""]))


def newest_before(path: Path, at_tai_s: float) -> tuple[ElementSet, str, str] | None:
    """The newest set of a file before a time, its text, and the ending of its file; None where there is none."""
    kind, text = read_orbit_file(path)
    if kind not in SET_PARSERS:
        raise ElementsError(f"{path}: an ephemeris ({kind}); expected element sets, TLE or OMM")
    sets, _ = SET_PARSERS[kind](text, str(path))
    before = [one for one in sets if one.epoch_tai_s <= at_tai_s]
    if len({one.norad_id for one in sets}) > 1:
        raise ElementsError(f"{path}: holds several satellites; expected the sets of one")
    if not before:
        return None
    newest = max(before, key=lambda one: one.epoch_tai_s)
    if kind == "omm" or newest.line is None:
        return newest, text, "omm"
    lines = text.split("\n")
    return newest, "\n".join([*lines[newest.line - 1 : newest.line + 1], ""]), "tle"


def largest_angle_deg(truth: Look, other: Look) -> float:
    """Between two directions at the same times."""
    units = [
        np.stack([np.cos(s.el_deg * DEG) * np.sin(s.az_deg * DEG), np.cos(s.el_deg * DEG) * np.cos(s.az_deg * DEG),
                  np.sin(s.el_deg * DEG)])
        for s in (truth, other)
    ]  # fmt: skip
    return float(np.degrees(2.0 * np.arcsin(np.linalg.norm(units[0] - units[1], axis=0).max() / 2.0)))


def write_pass(orbit: Orbit, name: str, site: Site, one: Pass, asked: argparse.Namespace) -> str:
    """Write the files of a pass; returns a line about it."""
    tai_s = seconds_of(one)
    seen = look_at(orbit.propagator, tai_s, site)
    stem = f"{name}-{site.station.name}-{utc_text(one.rise_tai_s, 0)[:16].replace('-', '').replace(':', '')}"
    write_truth(asked.out / f"{stem}.truth.csv", tai_s, seen)
    about = {
        "satellite": name,
        "station": site.station.name,
        "latitude_deg": site.station.latitude_deg,
        "longitude_deg": site.station.longitude_deg,
        "height_m": site.station.height_m,
        "truth_source": orbit.path.name,
        "max_el_deg": round(float(seen.el_deg.max()), 2),
        "seconds": int(tai_s.size),
        "ut1_utc_s": site.orientation.ut1_utc_s,
        "polar_motion_arcsec": [site.orientation.polar_x_arcsec, site.orientation.polar_y_arcsec],
    }
    line = f"{stem}: {tai_s.size} s, up to {about['max_el_deg']} deg"
    if asked.elements is not None and (found := newest_before(asked.elements, one.rise_tai_s)) is not None:
        elements, text, ending = found
        (asked.out / f"{stem}.{ending}").write_text(text)
        about["element_age_days"] = round((one.rise_tai_s - elements.epoch_tai_s) / DAY_S, 2)
        try:
            off_deg = largest_angle_deg(seen, look_at(Sgp4Propagator(elements), tai_s, site))
            about["largest_error_of_the_elements_deg"] = round(off_deg, 4)
            line += f", elements {about['element_age_days']} days old are up to {off_deg:.4f} deg off"
        except OrbitError as error:
            line += f", the elements say nothing: {error}"
    (asked.out / f"{stem}.json").write_text(json.dumps(about, indent=1) + "\n")
    return line


def cut(path: Path, asked: argparse.Namespace) -> int:
    """Cut the passes out of a file; returns how many."""
    orbit = read_orbit(path, asked.object, asked.earth_orientation)
    name = asked.name or orbit.name
    spans = orbit.propagator.spans_tai_s
    edges = {edge for span in spans for edge in span}
    say(f"{path}: {orbit.propagator.ephemeris.label}, {orbit.propagator.ephemeris.coverage}")
    count = 0
    for station in asked.station or STATIONS:
        site = Site(station, orbit.orientation)
        found = find_passes(orbit.propagator, site, spans[0][0], spans[-1][1], asked.min_elevation)
        whole = [one for one in found if not {one.rise_tai_s, one.set_tai_s} & edges]
        if len(whole) < len(found):
            say(f"{station.name}: left out: {len(found) - len(whole)} that an end of the orbit cuts")
        for one in whole:
            if one.culmination_el_deg >= asked.min_culmination and seconds_of(one).size >= 2:
                say(write_pass(orbit, name, site, one, asked))
                count += 1
    return count


def main() -> int:
    """Cut the passes out of all files.  Exit status: 0; 1 there is none; 2 wrong use, or a file that cannot be read."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="CPF, SP3 or OEM, gzip too")
    parser.add_argument("--out", type=output_folder, required=True, metavar="DIR", help="where the passes go")
    parser.add_argument("--object", metavar="NAME", help="which satellite of a file of several, such as L56")
    parser.add_argument("--name", metavar="NAME", help="the satellite's name in files; default: the file's")
    parser.add_argument(
        "--station", type=station_of, action="append", metavar="NAME,LAT,LON,HEIGHT",
        help="deg, deg east, m; repeat it for more.  Default: " + ", ".join(one.name for one in STATIONS),
    )  # fmt: skip
    parser.add_argument("--min-elevation", type=float, default=5.0, metavar="DEG", help="of rise and set (default 5)")
    parser.add_argument(
        "--min-culmination", type=float, default=10.0, metavar="DEG", help="lower ones are left out (10)"
    )
    parser.add_argument("--earth-orientation", type=Path, metavar="FILE", help="finals2000A or C04, for inertial files")
    parser.add_argument("--elements", type=Path, metavar="FILE", help="element sets of the satellite, TLE or OMM")
    asked = parser.parse_args()
    try:
        count = sum(cut(path, asked) for path in asked.files)
    except AcuDaemonError as error:
        parser.error(str(error))
    except OSError as error:
        parser.error(f"{error.filename}: {error.strerror}")
    say(f"{count} passes in {asked.out}")
    return 0 if count else 1


if __name__ == "__main__":
    sys.exit(main())
