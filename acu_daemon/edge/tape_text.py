"""A tape as lines of text and back: a letter, then its values; exact to the bit (edge/tape.py has the letters).

Times are written as whole steps since the one before on the same clock, nanoseconds of CLOCK_MONOTONIC and 2^-24 s of
TAI, as long as that says the number exactly; else "=" and the number itself.  Bytes are hexadecimal, "-" for none.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, astuple, dataclass
from typing import Any

import numpy as np

from acu_daemon.assist.session.refit import GateVerdict, RefitReply
from acu_daemon.control.receiver_signal import SignalSample
from acu_daemon.control.tick_input import Asking, HoldWish, NudgeWish, Request, SlaveWish, StowBy, StowWish
from acu_daemon.edge.tape import Record
from acu_daemon.errors import AcuDaemonError
from acu_daemon.model import AngleBias, Correction, FitResult, Model
from acu_daemon.units import Array

_TAI_STEPS = 2.0**24
_NS = 1e9


class TapeError(AcuDaemonError):
    """A line of a tape makes no sense; says which and why."""


@dataclass(frozen=True, slots=True)
class FitAnswer:
    """What the fit answered, without the buffer, which the replay makes anew."""

    fit: FitResult | None
    notes: tuple[str, ...]
    model: Model
    gate: GateVerdict


class _Steps:
    """One clock's times as whole steps since the one before."""

    def __init__(self, steps_per_s: float) -> None:
        self._per_s, self._last = steps_per_s, 0

    def text(self, time_s: float) -> str:
        steps = round(time_s * self._per_s)
        if steps / self._per_s != time_s:
            return f"={time_s!r}"
        since, self._last = steps - self._last, steps
        return str(since)

    def time_s(self, text: str) -> float:
        if text.startswith("="):
            return float(text[1:])
        self._last += int(text)
        return self._last / self._per_s


class TapeWriter:
    """Makes lines of records.  Owned by one thread."""

    def __init__(self) -> None:
        self._monotonic, self._tai = _Steps(_NS), _Steps(_TAI_STEPS)

    def line(self, record: Record) -> str:
        """One line with its end; the five of every tick first."""
        letter = record[0]
        if letter == "H":
            return "H\n"
        if letter == "D":
            return f"D{record[1]}\n"
        if letter == "R":
            return f"R{self._monotonic.text(record[1])} {record[2].hex() or '-'}\n"
        if letter == "X":
            return f"X{self._exchange(record)}\n"
        if letter == "T":
            return f"T{self._tick(record)}\n"
        return "G\n" if letter == "G" else f"{letter}{self._values(record)}\n"

    def _exchange(self, record: Record) -> str:
        _, started_s, started_tai_s, unread, frame = record
        times = f"{self._monotonic.text(started_s)} {self._tai.text(started_tai_s)}"
        return f"{times} {unread.hex() or '-'} {frame.hex() or '-'}"

    def _tick(self, record: Record) -> str:
        _, now_tai_s, silence_s, has_room, requests, signal = record
        silence = "0" if silence_s == 0.0 else repr(silence_s)
        said = ""
        if requests or signal is not None:
            more = [[_asking_json(one) for one in requests], None if signal is None else list(astuple(signal))]
            said = f" {json.dumps(more, separators=(',', ':'))}"
        return f"{self._tai.text(now_tai_s)} {silence} {int(has_room)}{said}"

    def _values(self, record: Record) -> str:
        match record:
            case ("B", now_tai_s, low_water_s):
                return f"{self._tai.text(now_tai_s)} {'-' if low_water_s is None else repr(low_water_s)}"
            case ("Z", now_tai_s, has_died, reason):
                return f"{self._tai.text(now_tai_s)} {int(has_died)} {json.dumps(reason)}"
            case ("F", RefitReply() as reply):
                return json.dumps(_fit_json(reply), separators=(",", ":"))
            case ("I", name, what):
                return f"{name} {json.dumps(what, separators=(',', ':'), allow_nan=False)}"
            case ("L" | "C" | "E", what):
                return json.dumps(what, separators=(",", ":"))
            case (("N" | "Q"), now_s):
                return self._monotonic.text(now_s)
            case (("P" | "S" | "A" | "U"), now_tai_s):
                return self._tai.text(now_tai_s)
        raise ValueError(f"{record[0]!r} is no kind of record")


class TapeReader:
    """Makes records of lines."""

    def __init__(self) -> None:
        self._monotonic, self._tai = _Steps(_NS), _Steps(_TAI_STEPS)

    def records(self, lines: Iterable[str], first: int = 1) -> Iterator[Record]:
        """first: the number of the first line, for messages.  TapeError: names line and reason."""
        for number, line in enumerate(lines, first):
            try:
                yield self._record(line[0], line[1:])
            except (ValueError, KeyError, TypeError, IndexError) as error:
                raise TapeError(f"line {number}: {line[:60]!r}: {error}") from None

    def _record(self, letter: str, text: str) -> Record:
        match letter:
            case "T":
                now, silence, room, *more = text.split(" ", 3)
                asked, signal = json.loads(more[0]) if more else ((), None)
                requests = tuple(_asking_of(one) for one in asked)
                said = None if signal is None else SignalSample(*signal)
                return letter, self._tai.time_s(now), float(silence), room == "1", requests, said
            case "X":
                started, started_tai, unread, frame = text.split(" ")
                times = self._monotonic.time_s(started), self._tai.time_s(started_tai)
                return letter, *times, _bytes(unread), _bytes(frame)
            case "R":
                arrival, data = text.split(" ")
                return letter, self._monotonic.time_s(arrival), _bytes(data)
            case "B":
                now, low = text.split(" ")
                return letter, self._tai.time_s(now), None if low == "-" else float(low)
            case "Z":
                now, died, reason = text.split(" ", 2)
                return letter, self._tai.time_s(now), died == "1", json.loads(reason)
            case "F":
                return letter, _fit_answer(json.loads(text))
            case "I":
                name, what = text.split(" ", 1)
                return letter, name, json.loads(what)
            case "L" | "C" | "E":
                return letter, json.loads(text)
            case "N" | "Q":
                return letter, self._monotonic.time_s(text)
            case "P" | "S" | "A" | "U":
                return letter, self._tai.time_s(text)
            case "D" | "G" | "H":
                return (letter, text) if text else (letter,)
        raise ValueError(f"{letter!r} is no kind of record")


def _asking_json(asking: Asking) -> Any:
    match asking:
        case StowWish(by, is_wanted):
            return [by, is_wanted]
        case HoldWish(is_wanted):
            return {"hold": is_wanted}
        case NudgeWish(along_s, across_deg):
            return {"nudge": [along_s, across_deg]}
        case SlaveWish():
            return {"slave": list(astuple(asking))}
        case _:
            return str(asking)


def _asking_of(read: Any) -> Asking:
    match read:
        case str():
            return Request(read)
        case {"hold": is_wanted}:
            return HoldWish(is_wanted)
        case {"nudge": [along_s, across_deg]}:
            return NudgeWish(along_s, across_deg)
        case {"slave": values}:
            return SlaveWish(*values)
        case [by, is_wanted]:
            return StowWish(StowBy(by), is_wanted)
    raise ValueError(f"{read!r} is nothing that is asked for")


def _bytes(text: str) -> bytes:
    return b"" if text == "-" else bytes.fromhex(text)


def _fit_json(reply: RefitReply) -> dict[str, Any]:
    gate = reply.gate
    said: dict[str, Any] = {"model": str(reply.model), "gate": [gate.rejecting, gate.counts, gate.reset_count]}
    if reply.notes:
        said["notes"] = reply.notes
    if (fit := reply.fit) is not None:
        said["fit"] = {
            "of": [fit.estimator, fit.at_tai_s, fit.reading_count, fit.rejected_count],
            "for_people": [fit.residual_rms_deg, fit.along_s, fit.across_deg],
            "correction": list(asdict(fit.correction).values()),
            "bias": list(asdict(fit.bias).values()),
            "shift_m": fit.station_shift_enu_m,
            "covariance": None if fit.covariance is None else _packed(fit.covariance),
        }
    return said


def _packed(matrix: Array) -> list[Any]:
    """Size, the rows that are not all zero, of these the upper triangle, and how much the lower one is off it.

    A covariance is symmetric but for rounding, which is kept in units of the last place.
    """
    used = np.flatnonzero(matrix.any(axis=0) | matrix.any(axis=1))
    part = np.ascontiguousarray(matrix[np.ix_(used, used)])
    upper = np.triu_indices(used.size)
    off = part.T.copy().view(np.int64)[upper] - part.view(np.int64)[upper]
    return [matrix.shape[0], used.tolist(), part[upper].tolist(), off.tolist()]


def _unpacked(read: list[Any]) -> Array:
    size, used, values, off = read
    part = np.zeros((len(used), len(used)))
    upper = np.triu_indices(len(used))
    part.T[upper] = (np.array(values).view(np.int64) + np.array(off, dtype=np.int64)).view(np.float64)
    part[upper] = values
    matrix = np.zeros((size, size))
    matrix[np.ix_(used, used)] = part
    return matrix


def _fit_answer(read: dict[str, Any]) -> FitAnswer:
    rejecting, counts, reset_count = read["gate"]
    fit = None
    if (said := read.get("fit")) is not None:
        estimator, at_tai_s, reading_count, rejected_count = said["of"]
        residual_rms_deg, along_s, across_deg = said["for_people"]
        east_m, north_m, up_m = said["shift_m"]
        fit = FitResult(
            estimator,
            Correction(*said["correction"]),
            at_tai_s,
            reading_count,
            rejected_count,
            residual_rms_deg,
            along_s,
            across_deg,
            AngleBias(*said["bias"]),
            (east_m, north_m, up_m),
            None if said["covariance"] is None else _unpacked(said["covariance"]),
        )
    gate = GateVerdict(rejecting, counts, reset_count)
    return FitAnswer(fit, tuple(read.get("notes", ())), Model(read["model"]), gate)
