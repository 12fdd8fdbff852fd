"""A configuration directory for tests: the shortest files that load, and ways to change them."""

from pathlib import Path

STATION = """
[station]
latitude_deg = -15.53
longitude_deg = -56.07
height_m = 277.0
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
"""
BROUWER = """
[satellite]
name = "SCD-1"
[elements]
kind = "brouwer"
epoch_utc = 1989-01-31T09:58:00Z
semi_major_axis_km = 7180.0
eccentricity = 0.0436
inclination_deg = 23.82
raan_deg = 240.14
arg_perigee_deg = 15.47
mean_anomaly_deg = 350.56
"""


def write(directory: Path, station: str | bytes = STATION, **satellites: str | bytes) -> Path:
    """Make DIR/station.toml and DIR/satellites/NAME.toml; satellites: name and text, by default scd=BROUWER."""
    (directory / "satellites").mkdir(parents=True, exist_ok=True)
    for path, text in [
        (directory / "station.toml", station),
        *((directory / "satellites" / f"{name}.toml", text) for name, text in (satellites or {"scd": BROUWER}).items()),
    ]:
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return directory


def replaced(text: str, old: str, new: str) -> str:
    """Change one line of a text; the line must be there."""
    assert old in text
    return text.replace(old, new, 1)


def from_file(name: str, kind: str, file: str, norad_id: int | None = None) -> str:
    """Text of a satellite's file whose elements are in a file of their own."""
    number = "" if norad_id is None else f"norad_id = {norad_id}\n"
    return f'[satellite]\nname = "{name}"\n{number}[elements]\nkind = "{kind}"\nfile = "{file}"\n'
