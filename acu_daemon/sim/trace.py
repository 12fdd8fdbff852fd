"""SIMULATION: what really happened, ten times a second, for reports and tests."""

import csv
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from acu_daemon.acu.commands import AcuMode
from acu_daemon.errors import UsageError
from acu_daemon.orbit.timescales import utc_text

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


class TraceWriter:
    """Writes rows to a CSV as they come; angles with five decimals, empty where there is no satellite."""

    def __init__(self, path: Path) -> None:
        try:
            self._file = path.open("w", encoding="ascii", newline="")
        except OSError as error:
            raise UsageError(f"--trace {path}: {error.strerror}") from None
        self._lines = csv.writer(self._file, lineterminator="\n")
        self._lines.writerow(HEADER)

    def add(self, row: TraceRow) -> None:
        """Write one row."""
        self._lines.writerow(_cells(row))

    def __enter__(self) -> "TraceWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()


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
