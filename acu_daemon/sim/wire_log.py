"""SIMULATION: every register write that the ACU accepted, with its time, to judge the daemon by."""

import csv
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from acu_daemon.acu.commands import AcuMode
from acu_daemon.errors import UsageError
from acu_daemon.orbit.timescales import utc_text

HEADER = ("utc", "az_deg", "el_deg", "mode", "followed")


@dataclass(frozen=True, slots=True)
class RegisterWrite:
    """One accepted 32h or 41h: when it was applied, the registers' values, and the mode that it met."""

    tai_s: float
    az_deg: float
    el_deg: float
    mode: AcuMode
    is_followed: bool


class WireLogWriter:
    """Writes them to a CSV as they come; times in microseconds, angles with five decimals."""

    def __init__(self, path: Path) -> None:
        try:
            self._file = path.open("w", encoding="ascii", newline="")
        except OSError as error:
            raise UsageError(f"--wire-log {path}: {error.strerror}") from None
        self._lines = csv.writer(self._file, lineterminator="\n")
        self._lines.writerow(HEADER)

    def add(self, write: RegisterWrite) -> None:
        """Write one line."""
        angles = (f"{write.az_deg:.5f}", f"{write.el_deg:.5f}")
        self._lines.writerow((utc_text(write.tai_s, 6), *angles, write.mode.name, int(write.is_followed)))

    def __enter__(self) -> "WireLogWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()
