"""Gpredict itself, under a virtual screen: it engages the daemon's rotctld port, leads the antenna along its own pass,
and lets it go.  Its windows are worked with the mouse, as by a person."""

import contextlib
import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import ImageGrab
from script_modules import load
from sgp4.api import WGS72, Satrec, jday
from sgp4.exporter import export_tle

from acu_daemon.edge.control_socket import ask
from acu_daemon.model import Site, Station, sky_angle_deg
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import tai_from_unix
from acu_daemon.orbit.tle import parse_tle

PROGRAMS = ("gpredict", "Xvfb", "xdotool")
pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(
        any(shutil.which(name) is None for name in PROGRAMS), reason="needs gpredict, Xvfb, xdotool (Debian's)"
    ),
]
PATIENCE_S = 90.0
CYCLE_S, THRESHOLD_DEG = 0.5, 0.1
COPENHAGEN = Station("Copenhagen", 55.6167, 12.65, 5.0)  # of Gpredict's own sample
MENU, ANTENNA_CONTROL, TRACK, ENGAGE, MONITOR = (681, 45), (763, 240), (347, 197), (780, 197), (618, 230)
MOST_OFF_DEG = 1.5  # a cycle of each, and the threshold
pass_rig = load("pass_rig")


def tle_over(station: Station, now_unix_s: float) -> tuple[str, str]:
    """A satellite that is up for some minutes: of orbits that pass by now, one between 25 and 60 deg that is slow."""
    day, fraction = jday(*time.gmtime(now_unix_s)[:6])
    epoch_days = day + fraction - 2433281.5
    tai_s = tai_from_unix(now_unix_s) + np.array([0.0, 90.0])
    for raan, anomaly in ((raan, anomaly) for raan in range(0, 360, 10) for anomaly in range(0, 360, 5)):
        satellite = Satrec()
        motion = 13.0 * 2 * np.pi / 1440.0
        satellite.sgp4init(
            *(WGS72, "i", 99999, epoch_days, 0.0, 0.0, 0.0, 0.0005, 0.0, np.radians(70.0)),
            *(np.radians(anomaly), motion, np.radians(raan)),
        )
        one, two = export_tle(satellite)
        [found], _ = parse_tle(f"{one}\n{two}\n", "made")
        seen = look_at(Sgp4Propagator(found), tai_s, Site(station))
        if np.all((seen.el_deg > 25.0) & (seen.el_deg < 60.0)):
            return one, two
    raise AssertionError("no orbit passes by")


def wait_until(is_so: Callable[[], Any], log: Path | None = None) -> Any:
    end_s = time.monotonic() + PATIENCE_S
    while True:
        if found := is_so():
            return found
        assert time.monotonic() < end_s, f"it never came true {log.read_text() if log else ''}"
        time.sleep(0.2)


@dataclass
class Screen:
    """A virtual screen, and the mouse on it."""

    display: str
    environment: dict[str, str]
    log: Path  # of Gpredict

    def windows(self) -> str:
        words = ["xdotool", "search", "--onlyvisible", "--name", "Gpredict", "getwindowname", "%@"]
        return subprocess.run(words, env=self.environment, capture_output=True, text=True, check=False).stdout

    def click(self, at: tuple[int, int]) -> None:
        words = ["xdotool", "mousemove", str(at[0]), str(at[1]), "sleep", "0.2", "click", "1"]
        subprocess.run(words, env=self.environment, check=True)

    def shot(self, path: Path) -> None:
        ImageGrab.grab(xdisplay=self.display).save(path)


@contextlib.contextmanager
def screen(home: Path) -> Iterator[Screen]:
    reading, writing = os.pipe()
    words = ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1280x900x24", "-nolisten", "tcp"]
    with (home / "xvfb.log").open("w") as log, os.fdopen(reading) as told:
        server = subprocess.Popen(words, stdout=log, stderr=log, pass_fds=[writing])
        os.close(writing)
        display = f":{told.readline().strip()}"  # a free one, once it can be used
    assert display != ":", (home / "xvfb.log").read_text()
    kept = {key: value for key, value in os.environ.items() if not key.startswith("XDG_")}
    environment = kept | {"HOME": str(home), "DISPLAY": display, "NO_AT_BRIDGE": "1"}
    started = [server]
    try:
        with (home / "gpredict.log").open("w") as log:
            started.append(subprocess.Popen(["gpredict"], env=environment, stdout=log, stderr=log))
        yield Screen(display, environment, home / "gpredict.log")
    finally:
        for process in reversed(started):
            process.send_signal(signal.SIGTERM)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(5.0)
            process.kill()
            process.wait(PATIENCE_S)


def gpredict_home(home: Path, port: int, tle: tuple[str, str]) -> Path:
    """Gpredict's files: one satellite, its sample place, one rotator."""
    made = home / ".config" / "Gpredict"
    for name in ("hwconf", "modules", "satdata", "trsp"):
        (made / name).mkdir(parents=True)
    shutil.copy("/usr/share/gpredict/data/sample.qth", made)
    (made / "modules" / "Amateur.mod").write_text("[GLOBAL]\nSATELLITES=99999;\nQTHFILE=sample.qth\n")
    (made / "satdata" / "99999.sat").write_text(
        f"[Satellite]\nVERSION=1.1\nNAME=MADE\nNICKNAME=MADE\nTLE1={tle[0]}\nTLE2={tle[1]}\nSTATUS=1\n"
    )
    (made / "hwconf" / "daemon.rot").write_text(
        f"[Rotator]\nHost=127.0.0.1\nPort={port}\nMinAz=0\nMaxAz=360\nMinEl=0\nMaxEl=90\nAzType=0\nAzStopPos=0\n"
        f"Cycle={1e3 * CYCLE_S:.0f}\nThreshold={THRESHOLD_DEG}\n"
    )
    return home


def off_deg(rig: Any, satellite: Sgp4Propagator) -> float:
    """Between the antenna and Gpredict's satellite over Gpredict's place, now."""
    seen = json.loads(ask(rig.kept, "status"))
    at = look_at(satellite, np.array([tai_from_unix(time.time())]), Site(COPENHAGEN))
    return sky_angle_deg(seen["az_deg"], seen["el_deg"], float(at.az_deg[0]), float(at.el_deg[0]))


def test_gpredict_engages_leads_the_antenna_along_its_pass_and_lets_it_go(tmp_path: Path) -> None:
    tle = tle_over(COPENHAGEN, time.time())
    [elements], _ = parse_tle("\n".join(tle) + "\n", "made")
    satellite = Sgp4Propagator(elements)
    scene = pass_rig.make_scene(tmp_path / "scene", None, 180.0)
    with pass_rig.rigs(scene, ["tcp"], tmp_path) as [rig]:
        rig.start_acu()
        station = rig.config / "station.toml"
        station.write_text(station.read_text() + '\n[rotctld]\nlisten = "127.0.0.1:0"\nstop = "lease"\n')
        rig.start_daemon()
        opened = wait_until(lambda: rig.events("rotctld.open"))[0]["address"]
        wait_until(lambda: rig.state == "AUTOTRACK/FITTED")
        home = gpredict_home(tmp_path / "home", int(opened.rsplit(":", 1)[1]), tle)
        with screen(home) as shown:
            wait_until(lambda: "Gpredict: Amateur" in shown.windows(), shown.log)
            time.sleep(1.0)  # until it is drawn
            shown.click(MENU)
            time.sleep(0.5)
            shown.click(ANTENNA_CONTROL)
            wait_until(lambda: "Rotator Control" in shown.windows())
            time.sleep(1.0)
            shown.click(MONITOR)
            shown.click(ENGAGE)
            time.sleep(3.0)
            shown.shot(tmp_path / "monitor.png")
            assert rig.state.startswith("AUTOTRACK")  # it reads, and disturbs nothing
            shown.click(ENGAGE)
            shown.click(MONITOR)
            shown.click(TRACK)
            assert ask(rig.kept, "grant to=127.0.0.1 name=Gpredict lasts_s=6").startswith("127.0.0.1 may lead")
            shown.click(ENGAGE)
            time.sleep(2.0)
            shown.shot(tmp_path / "engaged.png")
            wait_until(lambda: rig.state == "SLAVED")
            wait_until(lambda: off_deg(rig, satellite) < MOST_OFF_DEG / 3.0)  # it is on its way first
            off = [off_deg(rig, satellite) for _ in range(10) if time.sleep(0.5) is None]
            shown.shot(tmp_path / "gpredict.png")
            assert max(off) < MOST_OFF_DEG
            assert json.loads(ask(rig.kept, "status"))["slaved_by"] == "Gpredict"
            shown.click(ENGAGE)  # off again
            wait_until(lambda: rig.events("slaved.ends"))
            wait_until(lambda: rig.state.endswith("/FITTED"))
        assert (tmp_path / "gpredict.png").stat().st_size > 10_000
        assert not rig.events("fence.refused")
        assert not rig.events("axis.latched")
