"""The carry-over of a satellite in the state directory: one JSON file, whole at any time, written only here."""

import json
import math
import re
from collections.abc import Callable
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
import structlog

from acu_daemon.assist.estimators.full.carry_over import CarryOver
from acu_daemon.assist.estimators.full.estimated_states import MOUNT_TERMS, STATE_COUNT
from acu_daemon.edge.writer import Latest, Writer, replace_file
from acu_daemon.errors import OrbitError
from acu_daemon.model import AngleBias, Correction, FitResult, Station
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import Array

VERSION = 1
FORMER_STATE_COUNT = 13  # of files from before the mount's terms were states
SAVE_PERIOD_S = 10.0  # so much of a pass a crash may lose
_LARGEST_BYTES = 100_000
_ROUNDING = 1e-6  # of correlations and their eigenvalues


def carry_over_path(directory: Path, norad_id: int | None, name: str) -> Path:
    """The file of a satellite: by its catalogue number, else by its name."""
    label = str(norad_id) if norad_id is not None else re.sub(r"[^\w.-]+", "-", name)
    return directory / f"carry-over-{label}.json"


def read_carry_over(path: Path, satellite: str) -> CarryOver | None:
    """Read the file; None where there is none, or, with a log line, where it is another satellite's or not whole."""
    try:
        with path.open("rb") as file:
            text = file.read(_LARGEST_BYTES)
        return from_json(json.loads(text), satellite)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        structlog.get_logger("carry_over").warning("carry_over.unreadable", file=str(path), reason=reason_of(error))
        return None


def any_carry_over(path: Path) -> CarryOver | None:
    """The same, whatever the satellite is called in it; None where it cannot be used, and nothing is said of that."""
    try:
        with path.open("rb") as file:
            read = json.loads(file.read(_LARGEST_BYTES))
        return from_json(read, str(read["satellite"]))
    except (OSError, ValueError, TypeError, KeyError, OverflowError, RecursionError):
        return None


def write_carry_over(path: Path, satellite: str, carried: CarryOver) -> None:
    """Put the file in place, whole.  OSError: it cannot be."""
    replace_file(path, json.dumps(to_json(satellite, carried), indent=1, allow_nan=False).encode("ascii"))


class FitKeeper:
    """Saves the newest fit of a pass, at most once in ten seconds, and at the end.

    The loop never waits for the disk.  A write that fails never stops a pass: it is logged at each edge, and done again
    with the next fit, or at the end.
    """

    def __init__(
        self, path: Path, satellite: str, carry_over_of: Callable[[FitResult], CarryOver | None], writer: Writer
    ) -> None:
        self._path = path
        self._satellite = satellite
        self._carry_over_of = carry_over_of
        self._latest = Latest(writer, self._save)
        self._newest: FitResult | None = None
        self._saved_tai_s = -math.inf
        self.problem = ""  # why the newest one is not saved

    def offer(self, fit: FitResult) -> None:
        """Take an accepted fit."""
        self._newest = fit
        if self.problem or fit.at_tai_s - self._saved_tai_s >= SAVE_PERIOD_S:
            self.flush()

    def flush(self) -> None:
        """Save what is not saved yet."""
        fit = self._newest
        if fit is not None and (self.problem or fit.at_tai_s > self._saved_tai_s):
            self._saved_tai_s = fit.at_tai_s
            self._latest.offer(fit)

    def _save(self, fit: FitResult) -> None:
        log: Any = structlog.get_logger("carry_over")
        try:
            carried = self._carry_over_of(fit)
            if carried is not None:
                write_carry_over(self._path, self._satellite, carried)
        except (OSError, ValueError, OrbitError) as error:
            reason = reason_of(error) if isinstance(error, OSError) else str(error)
            if not self.problem:
                log.warning("carry_over.not_saved", file=str(self._path), reason=reason)
            self.problem = f"{self._path.name}: {reason}"
            return
        if self.problem:
            log.info("carry_over.saved_again", file=str(self._path))
            self.problem = ""


def to_json(satellite: str, carried: CarryOver) -> dict[str, Any]:
    return {
        "version": VERSION,
        "satellite": satellite,
        "utc": utc_text(carried.at_tai_s),
        "at_tai_s": carried.at_tai_s,
        "estimator": carried.estimator,
        "station": asdict(carried.station),
        "frame": carried.frame,
        "elements": {
            "kind": carried.elements_kind,
            "epoch_utc": utc_text(carried.elements_epoch_tai_s),
            "epoch_tai_s": carried.elements_epoch_tai_s,
            "states_teme_m_m_s": carried.states.tolist(),
        },
        "correction": asdict(carried.correction),
        "bias": asdict(carried.bias),
        "station_shift_enu_m": list(carried.station_shift_enu_m),
        "covariance": carried.covariance.tolist(),
    }


def from_json(read: Any, satellite: str) -> CarryOver:
    """Raises: ValueError, TypeError, KeyError: what is wrong, such as another satellite."""
    if not isinstance(read, dict) or read.get("version") != VERSION:
        raise ValueError(f"expected a JSON object with version {VERSION}")
    if read["satellite"] != satellite:
        raise ValueError(f"it is of {read['satellite']!r}, not of {satellite!r}")
    elements, station = read["elements"], read["station"]
    east_m, north_m, up_m = numbers(read["station_shift_enu_m"], (3,)).tolist()
    return CarryOver(
        at_tai_s=number(read["at_tai_s"]),
        estimator=str(read["estimator"]),
        station=Station(str(station["name"]), **_fields(station, Station, text="name")),
        elements_kind=str(elements["kind"]),
        elements_epoch_tai_s=number(elements["epoch_tai_s"]),
        states=numbers(elements["states_teme_m_m_s"], (2, 6)),
        correction=Correction(**_fields(read["correction"], Correction)),
        bias=AngleBias(**_fields(_with_axes(read["bias"]), AngleBias)),
        station_shift_enu_m=(east_m, north_m, up_m),
        covariance=_covariance(read["covariance"]),
        frame=str(read.get("frame", "")),
    )


def reason_of(error: Exception) -> str:
    """Why a file of state cannot be used, in words."""
    match error:
        case KeyError():
            return f"{error.args[0]} is missing"
        case OSError():
            return error.strerror or str(error)
        case json.JSONDecodeError() | UnicodeDecodeError() | RecursionError():
            return f"not JSON, or only a part: {error}"
        case ValueError():
            return str(error)
        case _:
            return f"not in the form in which it is written: {error}"


def number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{value!r}: expected a number")
    return float(value)


def _fields(values: Any, kind: type[Correction | AngleBias | Station], text: str = "") -> dict[str, float]:
    names = {field.name for field in fields(kind)}
    if not isinstance(values, dict) or set(values) != names:
        raise ValueError(f"expected {', '.join(sorted(names))}")
    return {name: number(value) for name, value in values.items() if name != text}


def _with_axes(bias: Any) -> Any:
    """Files from before the mount's terms were states have none of them."""
    return {**dict.fromkeys(MOUNT_TERMS, 0.0), **bias} if isinstance(bias, dict) else bias


def numbers(values: Any, shape: tuple[int, ...]) -> Array:
    array = np.array(values, dtype=np.float64)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"expected {' x '.join(map(str, shape))} numbers")
    return array


def _covariance(values: Any) -> Array:
    """Zeros belong to states that no fit changes, and to estimators that give none."""
    covariance = np.zeros((STATE_COUNT, STATE_COUNT))
    count = FORMER_STATE_COUNT if isinstance(values, list) and len(values) == FORMER_STATE_COUNT else STATE_COUNT
    covariance[:count, :count] = numbers(values, (count, count))
    variance = np.diag(covariance)
    is_state = variance > 0.0
    unit = np.sqrt(variance[is_state])
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is not bounded
        correlation = covariance[np.ix_(is_state, is_state)] / unit / unit[:, None]
    is_none = not covariance[~is_state].any() and not covariance[:, ~is_state].any()
    is_bounded = bool((np.abs(correlation) <= 1.0 + _ROUNDING).all())
    is_symmetric = is_bounded and bool((np.abs(correlation - correlation.T) <= _ROUNDING).all())
    if not (is_none and is_symmetric and (np.linalg.eigvalsh(correlation) >= -_ROUNDING).all()):
        raise ValueError("covariance: expected a symmetric matrix without negative eigenvalues")
    return covariance
