"""SIMULATION: what really happened, ten times a second, for reports and tests."""

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from acu_daemon.orbit.timescales import utc_text
from acu_daemon.protocol.messages import AcuMode

HEADER = (
    *("utc", "boresight_az_deg", "boresight_el_deg", "encoder_az_deg", "encoder_el_deg"),
    *("satellite_az_deg", "satellite_el_deg", "beam_error_deg", "mode", "acquired", "agc_db"),
    *("register_az_deg", "register_el_deg", "followed", "signal"),
)


@dataclass(frozen=True, slots=True)
class TraceRow:
    """One instant.  Azimuths are in [0, 360) but the encoder's, which is continuous; no satellite: None."""

    tai_s: float
    boresight_az_deg: float
    boresight_el_deg: float
    encoder_az_deg: float
    encoder_el_deg: float
    satellite_az_deg: float | None
    satellite_el_deg: float | None
    beam_error_deg: float | None
    mode: AcuMode
    is_acquired: bool
    agc_db: float
    register_az_deg: float
    register_el_deg: float
    is_followed: bool
    has_signal: bool  # the satellite transmits and the receiver is connected, wherever the beam points


def write_trace(path: Path, rows: Iterable[TraceRow]) -> None:
    """Write rows as a CSV; angles with five decimals, empty where there is no satellite."""
    with path.open("w", newline="") as file:
        lines = csv.writer(file)
        lines.writerow(HEADER)
        lines.writerows(map(_cells, rows))


def _cells(row: TraceRow) -> list[str]:
    def angle(value_deg: float | None) -> str:
        return "" if value_deg is None else f"{value_deg:.5f}"

    return [
        utc_text(row.tai_s),
        angle(row.boresight_az_deg),
        angle(row.boresight_el_deg),
        angle(row.encoder_az_deg),
        angle(row.encoder_el_deg),
        angle(row.satellite_az_deg),
        angle(row.satellite_el_deg),
        angle(row.beam_error_deg),
        row.mode.name,
        str(int(row.is_acquired)),
        f"{row.agc_db:.2f}",
        angle(row.register_az_deg),
        angle(row.register_el_deg),
        str(int(row.is_followed)),
        str(int(row.has_signal)),
    ]
