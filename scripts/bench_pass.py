#!/usr/bin/env python3
"""Bench one satellite pass in real time: the real daemon against the simulated ACU, each a process of its own.

What it does
  1. Takes a real pass of ../shared/data/passes (element set and true sky), or the demo's satellite where that folder is
     absent, and writes a configuration and a scenario: encoder noise of 0.03 deg, no signal from 40 % to 75 %.
  2. Starts `acu-daemon fake-acu` and `acu-daemon run` with one shared clock, for each link asked for:
       tcp   loopback TCP
       pty   a pseudo terminal paced at 9600 baud in both directions
  3. Reads what the simulated ACU saw, prints asked and measured figures side by side, and says whether all are met.

Takes as long as the pass (8.5 minutes by default); with --window 60 a minute out of its middle.

Exit status: 0 all asked figures are met; 1 at least one is not; 2 the bench itself could not run.

Examples
  scripts/bench_pass.py --window 60                     both links side by side, one minute
  scripts/bench_pass.py --link tcp --json tcp.json      the whole pass over TCP, figures also as JSON
  scripts/bench_pass.py --pass jason-1-Cuiaba-20030108T1414     through the zenith, where the drive cannot follow
"""

import argparse
import contextlib
import json
import math
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

from acu_daemon.cli.options import coming_pass, load_target
from acu_daemon.control.plan import plan_pass
from acu_daemon.errors import AcuDaemonError
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.report.trace import read_trace
from acu_daemon.report.wire import LossFigures, WriteFigures, measure_losses, measure_writes, read_writes

PASSES = Path(__file__).resolve().parents[2] / "shared" / "data" / "passes"
DEFAULT_PASS = "iss-2022-Huntsville-20220211T2156"
DEMO_UTC = "2026-08-20T00:20:00Z"  # in a pass of the demo's satellite that its drive can follow, 73.6 deg high
LINKS = ("tcp", "pty")
SATELLITE = "bench"
NOISE_DEG = 0.03
LOSS_FROM, LOSS_TO = 0.40, 0.75  # of the time benched
LEAD_S = 4.0  # both processes need this long to start
BEFORE_RISE_S = 30.0  # a whole pass begins this long before the rise
SAY_EVERY_S = 5.0

STATION = """\
[station]
name = "{station}"
latitude_deg = {latitude_deg:.6f}
longitude_deg = {longitude_deg:.6f}
height_m = {height_m:.1f}
[acu]
url = "tcp://127.0.0.1:3842"
[acu.azimuth]
min_deg = -270.0
max_deg = 270.0
max_rate_deg_s = 20.0
max_acceleration_deg_s2 = 10.0
[acu.elevation]
min_deg = 0.0
max_deg = 90.0
max_rate_deg_s = 5.0
max_acceleration_deg_s2 = 5.0
[receiver]
beamwidth_deg = 1.0
[time]
ut1_utc_s = {ut1_utc_s}
polar_motion_x_arcsec = {polar_motion_arcsec[0]}
polar_motion_y_arcsec = {polar_motion_arcsec[1]}
[readings]
sigma_azimuth_deg = {noise_deg}
sigma_elevation_deg = {noise_deg}
"""
REAL_SATELLITE = """\
[satellite]
name = "{satellite}"
[elements]
kind = "tle"
file = "bench.tle"
"""
SCENARIO = """\
[sky]
along_track_s = {along_track_s}
delta_raan_deg = {delta_raan_deg}
[encoder]
noise_deg = {noise_deg}
[acu]
azimuth_deg = {azimuth_deg:.3f}
elevation_deg = {elevation_deg:.3f}
[[loss]]
cause = "receiver"
from_utc = {from_utc}
to_utc = {to_utc}
"""


class BenchError(Exception):
    """The bench itself could not run."""


@dataclass(frozen=True)
class Scene:
    """A configuration directory with station.toml, satellites/bench.toml and scenario.toml, and what it is about."""

    config: Path
    truth: Path | None
    label: str
    start_tai_s: float
    end_tai_s: float
    is_window: bool


def make_scene(directory: Path, pass_name: str | None, window_s: float | None) -> Scene:
    """Write the files of a bench.  pass_name: of ../shared/data/passes; None: the demo's satellite."""
    config = directory / "config"
    (config / "satellites").mkdir(parents=True)
    if pass_name is None:
        truth, sky = None, {"along_track_s": 0.9, "delta_raan_deg": 0.015}
        label, near_tai_s = "DEMO-1 over Cuiaba", tai_from_utc(DEMO_UTC)
        _copy_demo(config)
    else:
        truth, sky = PASSES / f"{pass_name}.truth.csv", {"along_track_s": 0.0, "delta_raan_deg": 0.0}
        label, near_tai_s = pass_name, _write_real(config, pass_name)
    target = load_target(config, SATELLITE, near_tai_s)
    coming = coming_pass(target, near_tai_s)
    span_s = coming.set_tai_s - coming.rise_tai_s
    start_tai_s, end_tai_s = coming.rise_tai_s, coming.set_tai_s
    if window_s is not None and window_s < span_s:
        start_tai_s += (span_s - window_s) / 2
        end_tai_s = start_tai_s + window_s
    from_tai_s, to_tai_s = (start_tai_s + part * (end_tai_s - start_tai_s) for part in (LOSS_FROM, LOSS_TO))
    limits = target.station.acu.azimuth.limits()
    plan = plan_pass(target.elements.propagator, target.station.site, coming, 0.0, limits, start_tai_s)
    scenario = SCENARIO.format(
        **sky,
        noise_deg=NOISE_DEG,
        azimuth_deg=plan.start_az_deg,
        elevation_deg=plan.start_el_deg,
        from_utc=utc_text(from_tai_s),
        to_utc=utc_text(to_tai_s),
    )
    (config / "scenario.toml").write_text(scenario)
    is_window = start_tai_s > coming.rise_tai_s
    return Scene(config, truth, label, start_tai_s - (0.0 if is_window else BEFORE_RISE_S), end_tai_s, is_window)


def _copy_demo(config: Path) -> None:
    with resources.as_file(resources.files("acu_daemon.cli") / "demo_config") as files:
        shutil.copy(files / "station.toml", config)
        shutil.copy(files / "satellites" / "demo-1.tle", config / "satellites")
        shutil.copy(files / "satellites" / "demo-1.toml", config / "satellites" / f"{SATELLITE}.toml")


def _write_real(config: Path, name: str) -> float:
    """Write the configuration of a real pass; return a time in it."""
    try:
        about = json.loads((PASSES / f"{name}.json").read_text())
        first, *_, last = (PASSES / f"{name}.truth.csv").read_text().splitlines()[1:]
        shutil.copy(PASSES / f"{name}.tle", config / "satellites" / "bench.tle")
    except OSError as error:
        known = ", ".join(sorted(path.stem for path in PASSES.glob("*.json"))) or "none"
        raise BenchError(f"pass {name}: {error}; passes there: {known}") from None
    (config / "station.toml").write_text(STATION.format(**about, noise_deg=NOISE_DEG))
    (config / "satellites" / f"{SATELLITE}.toml").write_text(REAL_SATELLITE.format(**about))
    return sum(tai_from_utc(line.split(",")[0]) for line in (first, last)) / 2


@dataclass
class Rig:
    """A simulated ACU and a daemon on one link and one clock; a directory of its own holds their files."""

    link: str
    scene: Scene
    directory: Path
    at_monotonic_s: float
    acu: "subprocess.Popen[str] | None" = None
    daemon: "subprocess.Popen[str] | None" = None
    url: str = ""
    config: Path = field(init=False)

    def __post_init__(self) -> None:
        self.directory.mkdir(parents=True)
        self.config = self.directory / "config"
        shutil.copytree(self.scene.config, self.config)

    @property
    def trace(self) -> Path:
        return self.directory / "trace.csv"

    @property
    def wire_log(self) -> Path:
        return self.directory / "wire.csv"

    @property
    def log(self) -> Path:
        return self.directory / "daemon.jsonl"

    @property
    def errors(self) -> Path:
        return self.directory / "daemon.err"

    def arguments(self, command: str) -> list[str]:
        """What both commands have in common."""
        clock = ["--at", utc_text(self.scene.start_tai_s, 6), "--at-monotonic", f"{self.at_monotonic_s:.6f}"]
        return [*ACU_DAEMON, command, "--config", str(self.config), "--satellite", SATELLITE, *clock]

    def start_acu(self, *more: str) -> None:
        """Start the simulated ACU, wait until it listens, and write its URL into the daemon's configuration.

        A second start takes the same place again.
        """
        where = ["--listen", self.url.removeprefix("tcp://") or "127.0.0.1:0"]
        if self.link == "pty":
            where = ["--pty", str((self.directory / "acu").absolute())]
        files = ["--scenario", str(self.config / "scenario.toml"), "--trace", str(self.trace)]
        files += ["--wire-log", str(self.wire_log)]
        if self.scene.truth is not None:
            files += ["--truth", str(self.scene.truth)]
        with (self.directory / "acu.err").open("w") as errors:
            self.acu = subprocess.Popen(
                [*self.arguments("fake-acu"), *where, *files, *more], stdout=subprocess.PIPE, stderr=errors, text=True
            )
        said = self.acu.stdout.readline() if self.acu.stdout else ""
        if not said.startswith("listening "):
            raise BenchError(f"the simulated ACU did not start: {(self.directory / 'acu.err').read_text()}")
        self.url = said.split()[1]
        station = self.config / "station.toml"
        station.write_text(station.read_text().replace("tcp://127.0.0.1:3842", self.url))

    def start_daemon(self, *more: str) -> None:
        """Start the daemon: its log goes to `log`, its complaints to `errors`."""
        arguments = [*self.arguments("run"), "--state", str(self.directory / "state"), *more]
        with self.log.open("w") as log, self.errors.open("w") as errors:
            self.daemon = subprocess.Popen(arguments, stdout=log, stderr=errors, text=True)

    def events(self, name: str) -> list[dict[str, Any]]:
        """Lines of the daemon's log about one event."""
        whole = [line for line in self.log.read_text().splitlines(keepends=True) if line.endswith("\n")]
        return [entry for entry in map(json.loads, whole) if entry["event"] == name]

    @property
    def state(self) -> str:
        """The daemon's present state."""
        changes = self.events("state.changed")
        return str(changes[-1]["state"]) if changes else "starting"

    def stop(self) -> None:
        """End both, the daemon first, so that its safe stop finds an ACU."""
        for process in (self.daemon, self.acu):
            if process is None:
                continue
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
            try:
                process.wait(10.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            if process.stdout is not None:
                process.stdout.close()


ACU_DAEMON = (sys.executable, "-m", "acu_daemon")


@contextlib.contextmanager
def rigs(scene: Scene, links: Sequence[str], directory: Path) -> Iterator[list[Rig]]:
    """Rigs that share one clock; their processes end with the context."""
    at_monotonic_s = time.monotonic() + LEAD_S
    made = [Rig(link, scene, directory / link, at_monotonic_s) for link in links]
    try:
        yield made
    finally:
        for rig in made:
            rig.stop()


def run_pass(scene: Scene, links: Sequence[str], directory: Path, say: Callable[[str], None] = print) -> list[Rig]:
    """Run the pass, or its window, on every link at once; the rigs' files hold what happened."""
    with rigs(scene, links, directory) as made:
        for rig in made:
            rig.start_acu()
        left_s = scene.end_tai_s - scene.start_tai_s + made[0].at_monotonic_s - time.monotonic()
        for rig in made:
            rig.start_daemon(*(["--duration", f"{left_s:.3f}"] if scene.is_window else []))
        _watch(made, time.monotonic() + left_s, say)
    return made


def _watch(made: list[Rig], end_s: float, say: Callable[[str], None]) -> None:
    said_s = -math.inf
    while any(rig.daemon is not None and rig.daemon.poll() is None for rig in made):
        now_s = time.monotonic()
        if now_s - said_s >= SAY_EVERY_S:
            said_s = now_s
            say(f"SIMULATION  {max(0.0, end_s - now_s):4.0f} s left  " + "  ".join(f"{r.link} {r.state}" for r in made))
        if now_s > end_s + 60.0:
            raise BenchError("the daemon did not end with its pass")
        time.sleep(0.25)


@dataclass(frozen=True)
class Result:
    """What was measured on one link."""

    exit_status: int
    writes: WriteFigures
    losses: LossFigures
    tick_count: int
    skipped_tick_count: int
    lateness_p50_ms: float
    lateness_p99_ms: float
    refusal_count: int
    connect_count: int
    refit_count: int
    refit_failed_count: int


def measure(rig: Rig) -> Result:
    """Sum up a rig whose processes have ended.  BenchError: it has nothing to show."""
    done = rig.events("run.done")
    if rig.daemon is None or not done:
        raise BenchError(f"{rig.link}: the daemon did not finish: {rig.errors.read_text().strip() or rig.state}")
    station = load_target(rig.config, SATELLITE, rig.scene.start_tai_s).station
    limits = station.acu.azimuth.limits(), station.acu.elevation.limits()
    trace = read_trace(rig.trace)
    counts = {name: done[0][name] for name in Result.__dataclass_fields__ if name in done[0]}
    try:
        writes = measure_writes(read_writes(rig.wire_log), trace, *limits)
        return Result(rig.daemon.returncode, writes, measure_losses(trace, *limits), **counts)
    except ValueError as error:
        raise BenchError(f"{rig.link}: {error}") from None


@dataclass(frozen=True)
class Row:
    """One line of the table; a figure nobody asked for is always met."""

    name: str
    asked: str
    shown: Callable[[Result], str]
    is_met: Callable[[Result], bool] = lambda _: True


ROWS = (
    Row(
        "beam error in the loss, largest, deg",
        "<= 0.1",
        lambda r: f"{r.losses.beam_error_max_deg:.3f}",
        lambda r: r.losses.beam_error_max_deg <= 0.1,
    ),
    Row("beam error in the loss, median, deg", "", lambda r: f"{r.losses.beam_error_median_deg:.3f}"),
    Row("length of the loss, s", "", lambda r: f"{r.losses.loss_s:.1f}"),
    Row("of which too fast for the drive, s", "", lambda r: f"{r.losses.cannot_follow_s:.1f}"),
    Row(
        "signal back to relock, s",
        "<= 1",
        lambda r: f"{r.losses.relock_s:.1f}",
        lambda r: r.losses.relock_s <= 1.0,
    ),
    Row(
        "register writes a second",
        "10.0 +- 0.1",
        lambda r: f"{r.writes.writes_per_s:.3f}",
        lambda r: abs(r.writes.writes_per_s - 10.0) <= 0.1,
    ),
    Row(
        "gaps up to 120 ms, %",
        ">= 99",
        lambda r: f"{100.0 * r.writes.share_of_short_gaps:.2f}",
        lambda r: r.writes.share_of_short_gaps >= 0.99,
    ),
    Row("longest gap, ms", "", lambda r: f"{1e3 * r.writes.longest_gap_s:.0f}"),
    Row(
        "followed registers / axis rate, %",
        "<= 100",
        lambda r: f"{100.0 * r.writes.rate_share:.1f}",
        lambda r: r.writes.rate_share <= 1.0,
    ),
    Row(
        "registers in autotrack, largest, deg",
        "<= 0.1",
        lambda r: f"{r.writes.autotrack_max_deg:.3f}",
        lambda r: r.writes.autotrack_max_deg <= 0.1,
    ),
    Row("registers in autotrack, 99 %, deg", "", lambda r: f"{r.writes.autotrack_p99_deg:.3f}"),
    Row("ticks / skipped", "", lambda r: f"{r.tick_count} / {r.skipped_tick_count}"),
    Row("ticks late, 50 % / 99 %, ms", "", lambda r: f"{r.lateness_p50_ms:.2f} / {r.lateness_p99_ms:.2f}"),
    Row("fits / failed", "", lambda r: f"{r.refit_count} / {r.refit_failed_count}"),
    Row("exit status of the daemon", "0", lambda r: str(r.exit_status), lambda r: r.exit_status == 0),
)


def missed(results: dict[str, Result]) -> list[str]:
    """Asked figures that were not met."""
    return [f"{link}: {row.name}" for link, result in results.items() for row in ROWS if not row.is_met(result)]


def table(results: dict[str, Result]) -> str:
    """Asked and measured, side by side."""
    lines = [f"{'':38}{'asked':>14}" + "".join(f"{link:>16}" for link in results)]
    for row in ROWS:
        cells = (row.shown(r) + (" " if row.is_met(r) else "!") for r in results.values())
        lines.append(f"{row.name:38}{row.asked:>14}" + "".join(f"{cell:>16}" for cell in cells))
    return "\n".join(lines)


def main() -> int:
    """Run the bench as the command line asks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--link", choices=(*LINKS, "both"), default="both", help="default: both, side by side")
    parser.add_argument("--pass", dest="pass_name", metavar="NAME", help=f"default: {DEFAULT_PASS}; demo: no real one")
    parser.add_argument(
        "--window", type=float, metavar="S", help="only this many seconds around the middle of the pass"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="keep traces and logs here (a new directory)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures here")
    options = parser.parse_args()
    pass_name = options.pass_name or (DEFAULT_PASS if PASSES.is_dir() else "demo")
    links = LINKS if options.link == "both" else (options.link,)
    with tempfile.TemporaryDirectory(prefix="acu-daemon-bench-") as temporary:
        directory = options.out or Path(temporary) / "out"
        try:
            directory.mkdir(parents=True)
            scene = make_scene(directory, None if pass_name == "demo" else pass_name, options.window)
            seconds = scene.end_tai_s - scene.start_tai_s
            print(f"SIMULATION of {scene.label} from {utc_text(scene.start_tai_s, 0)}: {seconds:.0f} s in real time")
            results = {rig.link: measure(rig) for rig in run_pass(scene, links, directory, _say)}
        except (BenchError, AcuDaemonError, OSError) as error:
            print(f"bench_pass: {error}", file=sys.stderr)
            return 2
    failed = missed(results)
    print("\n" + table(results))
    print("\nnot met: " + "; ".join(failed) if failed else "\nall asked figures are met")
    if options.json is not None:
        links_json = {link: asdict(result) for link, result in results.items()}
        about = {"pass": scene.label, "seconds": seconds, "is_window": scene.is_window}
        options.json.write_text(json.dumps({**about, "links": links_json, "missed": failed}, indent=1) + "\n")
    return 1 if failed else 0


def _say(text: str) -> None:
    print(text, flush=True)


if __name__ == "__main__":
    sys.exit(main())
