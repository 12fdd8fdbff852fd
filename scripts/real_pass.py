"""The real passes of ../shared/data/passes as configuration directories, for scripts and tests.

REAL_PASSES names another folder of such, as scripts/passes_from_orbit.py makes.
"""

import json
import os
from pathlib import Path

_PASSES = Path(__file__).resolve().parents[2] / "shared" / "data" / "passes"
PASSES = Path(os.environ.get("REAL_PASSES", _PASSES))

STATION = """\
[station]
name = "{station}"
latitude_deg = {latitude_deg}
longitude_deg = {longitude_deg}
height_m = {height_m}
[acu]
url = "{url}"
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
beamwidth_deg = {beamwidth_deg}
[time]
ut1_utc_s = {ut1_utc_s}
[readings]
sigma_azimuth_deg = 0.03
sigma_elevation_deg = 0.03
"""

SATELLITE = """\
[satellite]
name = "{satellite}"
[elements]
kind = "tle"
file = "{tle}"
"""

VACUUM = """\
[atmosphere]
refraction = false
"""


def pass_names() -> list[str]:
    """Names of the real passes; none where the folder is absent."""
    return sorted(path.stem for path in PASSES.glob("*.json"))


def truth_path(name: str) -> Path:
    """The truth CSV of a pass."""
    return PASSES / f"{name}.truth.csv"


def truth_span(name: str) -> tuple[str, str]:
    """UTC of the first and the last line of the truth."""
    lines = truth_path(name).read_text().splitlines()
    return lines[1].split(",")[0], lines[-1].split(",")[0]


def write_config(
    directory: Path,
    name: str,
    url: str = "tcp://127.0.0.1:3842",
    beamwidth_deg: float = 1.0,
    *,
    is_vacuum: bool = False,
) -> str:
    """Write station.toml and satellites/NAME.toml for a pass, in standard air or a vacuum; returns NAME."""
    about = json.loads((PASSES / f"{name}.json").read_text())
    (directory / "satellites").mkdir(parents=True, exist_ok=True)
    (directory / "station.toml").write_text(
        STATION.format(**about, url=url, beamwidth_deg=beamwidth_deg) + (VACUUM if is_vacuum else "")
    )
    tle = (PASSES / f"{name}.tle").as_posix()
    (directory / "satellites" / f"{about['satellite']}.toml").write_text(SATELLITE.format(**about, tle=tle))
    return str(about["satellite"])
