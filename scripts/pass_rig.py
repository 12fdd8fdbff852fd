"""One satellite pass in real time: its configuration, and the real daemon beside the simulated ACU as processes.

Shared by scripts/bench_pass.py and the tests of the real processes.
"""

import contextlib
import json
import math
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

from process_load import try_nice
from real_pass import pass_names, truth_path, truth_span, write_config

from acu_daemon.cli.options import coming_pass, load_target
from acu_daemon.control.tracking.pass_plan import plan_pass
from acu_daemon.orbit.timescales import tai_from_utc, utc_text

DEFAULT_PASS = "iss-2022-Huntsville-20220211T2156"
DEMO_UTC = "2026-08-20T00:20:00Z"  # in a pass of the demo's satellite that its drive can follow, 73.6 deg high
LINKS = ("tcp", "pty")
ACU_DAEMON = (sys.executable, "-m", "acu_daemon")
NOISE_DEG = 0.03
LOSS_FROM, LOSS_TO = 0.40, 0.75  # of the time benched
LEAD_S = 4.0  # both processes need this long to start
STARTS = 4.0  # and on a busy machine this many times what one start takes
BEFORE_RISE_S = 30.0  # a whole pass begins this long before the rise
SAY_EVERY_S = 5.0
DAEMON_NICENESS = -10  # as its unit says
HARDWARE_NICENESS = -15  # of what stands for hardware, where permitted: a real ACU does not share the host's processor

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
    """A configuration directory with station.toml, the satellite's file and scenario.toml, and what it is about."""

    config: Path
    satellite: str
    truth: Path | None
    label: str
    start_tai_s: float
    end_tai_s: float
    is_window: bool


def make_scene(directory: Path, pass_name: str | None, window_s: float | None, at_share: float = 0.5) -> Scene:
    """Write the files of a bench.  pass_name: of ../shared/data/passes; None: the demo's satellite.

    at_share: where in the pass the window lies, from 0, at its begin, to 1, at its end.
    """
    config = directory / "config"
    if pass_name is None:
        truth, sky = None, {"along_track_s": 0.9, "delta_raan_deg": 0.015}
        satellite, near_tai_s = _copy_demo(config), tai_from_utc(DEMO_UTC)
    else:
        sky = {"along_track_s": 0.0, "delta_raan_deg": 0.0}
        satellite, truth = _write_real(config, pass_name), truth_path(pass_name)
        near_tai_s = sum(map(tai_from_utc, truth_span(pass_name))) / 2
    target = load_target(config, satellite, near_tai_s)
    coming = coming_pass(target, near_tai_s)
    span_s = coming.set_tai_s - coming.rise_tai_s
    start_tai_s, end_tai_s = coming.rise_tai_s, coming.set_tai_s
    if window_s is not None and window_s < span_s:
        start_tai_s += (span_s - window_s) * at_share
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
    start_tai_s -= 0.0 if is_window else BEFORE_RISE_S
    return Scene(config, satellite, truth, pass_name or "demo", start_tai_s, end_tai_s, is_window)


def _copy_demo(config: Path) -> str:
    """Write the configuration of the demo; return the satellite's file name."""
    with resources.as_file(resources.files("acu_daemon.cli") / "demo_config") as files:
        shutil.copytree(files, config)
    return "demo-1"


def _write_real(config: Path, name: str) -> str:
    """Write the configuration of a real pass; return the satellite's file name."""
    if name not in pass_names():
        raise BenchError(f"there is no pass {name}; there are: {', '.join(pass_names()) or 'none'}")
    return write_config(config, name)


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
    is_ahead: bool = False  # the daemon has its unit's niceness
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

    @property
    def kept(self) -> Path:
        """The folder of the daemon's state, once it has one."""
        state = self.directory / "state-rehearsal"
        return next(state.glob("*@*"), state)

    def arguments(self, command: str) -> list[str]:
        """What both commands have in common."""
        clock = ["--at", utc_text(self.scene.start_tai_s, 6), "--at-monotonic", f"{self.at_monotonic_s:.6f}"]
        return [*ACU_DAEMON, command, "--config", str(self.config), "--satellite", self.scene.satellite, *clock]

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
                [*self.arguments("fake-acu"), *where, *files, *more],
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                start_new_session=True,
            )
        said = self.acu.stdout.readline() if self.acu.stdout else ""
        if not said.startswith("listening "):
            raise BenchError(f"the simulated ACU did not start: {(self.directory / 'acu.err').read_text()}")
        keep_time_of(self.acu.pid)
        self.url = said.split()[1]
        station = self.config / "station.toml"
        station.write_text(station.read_text().replace("tcp://127.0.0.1:3842", self.url))

    def add_page(self, token: bytes) -> None:
        """Let the daemon serve the operator's page on a free port, and take orders of who has the token."""
        path, station = self.config / "token", self.config / "station.toml"
        path.touch(mode=0o600)
        path.write_bytes(token)
        station.write_text(station.read_text() + '\n[web]\nlisten = "127.0.0.1:0"\ntoken_file = "token"\n')

    def start_daemon(self, *more: str) -> None:
        """Start the daemon, as far ahead of others as its unit puts it where that is permitted.

        Its log goes to `log`, its complaints to `errors`.
        """
        self._start_daemon([*self.arguments("run"), *more])

    def start_station(self, *more: str) -> None:
        """Start the daemon as a station's, which chooses its passes itself."""
        arguments = self.arguments("run")
        at = arguments.index("--satellite")
        self._start_daemon([*arguments[:at], *arguments[at + 2 :], *more])

    def _start_daemon(self, arguments: list[str]) -> None:
        arguments += ["--state", str(self.directory / "state")]
        with self.log.open("w") as log, self.errors.open("w") as errors:
            self.daemon = subprocess.Popen(arguments, stdout=log, stderr=errors, text=True, start_new_session=True)
        self.is_ahead = try_nice(self.daemon.pid, DAEMON_NICENESS)

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


def keep_time_of(pid: int) -> None:
    """Let what stands for hardware, and has begun, run before all daemons of this machine, where that is permitted.

    In a session of its own: among the processes of this one it would wait while a daemon starts.
    """
    try_nice(pid, HARDWARE_NICENESS)


@contextlib.contextmanager
def rigs(scene: Scene, links: Sequence[str], directory: Path, lead_s: float = LEAD_S) -> Iterator[list[Rig]]:
    """Rigs that share one clock, at the scene's start in lead_s; their processes end with the context."""
    at_monotonic_s = time.monotonic() + lead_s
    made = [Rig(link, scene, directory / link, at_monotonic_s) for link in links]
    try:
        yield made
    finally:
        for rig in made:
            rig.stop()


def _lead_s(scene: Scene) -> float:
    """How long all processes need to start: what is late then has less to fit before the loss."""
    began_s = time.monotonic()
    passes = [*ACU_DAEMON, "passes", "--config", str(scene.config), "--from", utc_text(scene.start_tai_s, 0)]
    subprocess.run(passes, stdout=subprocess.DEVNULL, check=True)
    return max(LEAD_S, STARTS * (time.monotonic() - began_s))


def run_pass(scene: Scene, links: Sequence[str], directory: Path, say: Callable[[str], None] = print) -> list[Rig]:
    """Run the pass, or its window, on every link at once; the rigs' files hold what happened."""
    with rigs(scene, links, directory, _lead_s(scene)) as made:
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
