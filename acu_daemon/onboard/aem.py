"""Attitude ephemeris messages (CCSDS 504.0), versions 1 and 2, KVN and XML: quaternions or Euler angles in segments.

Rates, where a message has them, are passed over: angles are interpolated by cubics.  Spin is refused.  A quaternion, or
a sequence of Euler angles, is read as the standard writes it: it turns the coordinates of REF_FRAME_A into those of
REF_FRAME_B (version 1 may say the opposite by ATTITUDE_DIR).  Euler angles stand in the order of their rotations.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from acu_daemon.onboard.gimbal_frames import turn
from acu_daemon.orbit.element_set import Problem, place
from acu_daemon.orbit.ephemeris_segment import Frame
from acu_daemon.orbit.oem import (
    SUPPORTED_FRAMES,
    epoch_tai_s,
    frame_named,
    numbers,
    required,
    time_system,
    useable_span_tai_s,
)
from acu_daemon.orbit.oem_text import BadSegmentError, Layout, RawSegment, read_segments
from acu_daemon.units import DEG, Array

ReferenceFrame = Frame | Literal["LVLH", "RTN"]

_ORBITAL: dict[str, ReferenceFrame] = {
    **dict.fromkeys(("LVLH", "LVLH_ROTATING", "LVLH_INERTIAL"), "LVLH"),
    **dict.fromkeys(("RTN", "RSW", "QSW", "RSW_ROTATING", "RSW_INERTIAL"), "RTN"),
}
_BODY = re.compile(r"SC_BODY(_\w+)?", re.ASCII)
_TYPE = re.compile(r"(QUATERNION|EULER_ANGLE)(/(DERIVATIVE|RATE|ANGVEL))?")
_SEQUENCE = re.compile(r"[XYZ]{3}")
_LEAST_STATES = 4  # a cubic
TURN_PER_GAP_DEG = 2.0  # what the body may turn between two states
SHORT_S, LONGEST_S = 2.0, 30.0  # a gap this short always passes, one longer than that never does
_MOST_TURN_DEG = 45.0  # between two states, however short the step
_FAR = 1e3  # no part of a unit quaternion; its square is no overflow
_NEIGHBOURS = 3  # intervals on either side whose rates a gap is judged by


def _row_of_leaves(leaves: Mapping[str, str]) -> list[str]:
    for keys in (("Q1", "Q2", "Q3", "QC"), ("ANGLE_1", "ANGLE_2", "ANGLE_3"), ("rotation1", "rotation2", "rotation3")):
        if keys[0] in leaves:
            return [leaves[key] for key in keys]
    raise KeyError("a quaternion or three angles")


AEM = Layout(
    message="aem",
    version_key="CCSDS_AEM_VERS",
    row="attitudeState",
    row_text="a time with a quaternion or three angles (and rates)",
    counts=(3, 4, 6, 7, 8),
    kept=4,
    values=_row_of_leaves,
)


@dataclass(frozen=True, slots=True)
class Gap:
    """Two neighbouring states too far apart for the turning between them."""

    start_tai_s: float
    end_tai_s: float
    fastest_deg_s: float
    allowed_s: float
    line: int


@dataclass(frozen=True, slots=True)
class AemSegment:
    """Attitudes of one body at rising times: rotations from the reference frame to the body."""

    name: str
    reference: ReferenceFrame
    body: str
    start_tai_s: float
    end_tai_s: float
    tai_s: Array = field(repr=False)  # (N,)
    quaternion: Array = field(repr=False)  # (N, 4): three of the axis, then the scalar; of steady sign
    gaps: tuple[Gap, ...]
    file: str
    line: int

    @property
    def where(self) -> str:
        return place(self.file, self.line, None)


def parse_aem(text: str, file: str, body: str | None = None) -> tuple[list[AemSegment], list[Problem]]:
    """Read every segment, KVN or XML as the first character says.

    body: the name of the frame that is the satellite's body; without one, SC_BODY or SC_BODY_n.
    Returns: the good segments in the order of the file, and for each other one a problem with its line.
    """
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    segments: list[AemSegment] = []
    problems: list[Problem] = []
    try:
        found = read_segments(text, AEM)
    except BadSegmentError as error:
        return [], [Problem(file, error.line, str(error))]
    for raw in found:
        try:
            segments.append(_segment(raw, file, body, is_xml=text.lstrip()[:1] == "<"))
        except BadSegmentError as error:
            problems.append(Problem(file, error.line, str(error)))
    if not found:
        problems.append(Problem(file, None, "no attitude ephemeris message in it (KVN or XML)"))
    return segments, problems


def _segment(raw: RawSegment, file: str, body: str | None, *, is_xml: bool) -> AemSegment:
    kind = required(raw, "ATTITUDE_TYPE").upper().replace(" ", "_")
    if _TYPE.fullmatch(kind) is None:
        reason = f"ATTITUDE_TYPE is {kind[:40]!r}; QUATERNION and EULER_ANGLE, with or without rates, can be used"
        raise BadSegmentError(reason, raw.line)
    if raw.problem is not None:
        raise raw.problem
    reference, body_name, is_forward = _frames(raw, body)
    system = time_system(raw)
    if len(raw.states) < _LEAST_STATES:
        raise BadSegmentError(f"{len(raw.states)} states, at least {_LEAST_STATES} are needed", raw.line)
    tai_s = np.array([epoch_tai_s(epoch, system, line) for line, epoch, _ in raw.states])
    falling = np.flatnonzero(np.diff(tai_s) <= 0.0)
    if falling.size:
        line, epoch, _ = raw.states[int(falling[0]) + 1]
        raise BadSegmentError(f"the times must rise, {epoch} does not", line)
    start_tai_s, end_tai_s = useable_span_tai_s(raw, system, tai_s)
    quaternion = _quaternions(raw, kind, is_xml=is_xml)
    if not is_forward:
        quaternion = quaternion * [-1.0, -1.0, -1.0, 1.0]
    return AemSegment(
        name=raw.fields.get("OBJECT_NAME", "") or "(no OBJECT_NAME)",
        reference=reference,
        body=body_name,
        start_tai_s=start_tai_s,
        end_tai_s=end_tai_s,
        tai_s=tai_s,
        quaternion=quaternion,
        gaps=_gaps(raw, tai_s, quaternion),
        file=file,
        line=raw.line,
    )


def _frames(raw: RawSegment, body: str | None) -> tuple[ReferenceFrame, str, bool]:
    """The reference frame, the body's name, and whether the attitude turns from the one to the other."""
    names = [required(raw, f"REF_FRAME_{letter}").upper().replace(" ", "_") for letter in "AB"]
    is_body = [name == body.upper() if body else _BODY.fullmatch(name) is not None for name in names]
    if is_body[0] == is_body[1]:
        wanted = f"{body!r}" if body else "SC_BODY or SC_BODY_n"
        reason = f"REF_FRAME_A and _B are {names[0][:40]!r} and {names[1][:40]!r}, one must be {wanted}"
        raise BadSegmentError(f"{reason}; name the body's frame by [attitude] body_frame", raw.line)
    other = names[0] if is_body[1] else names[1]
    reference = _ORBITAL.get(other) or frame_named(other)
    if reference is None:
        known = f"{SUPPORTED_FRAMES}, {', '.join(_ORBITAL)}"
        raise BadSegmentError(f"the reference frame is {other[:40]!r}; {known} can be used", raw.line)
    direction = raw.fields.get("ATTITUDE_DIR", "A2B").upper()
    if direction not in ("A2B", "B2A"):
        raise BadSegmentError(f"ATTITUDE_DIR is {direction[:40]!r}, expected A2B or B2A", raw.line)
    return reference, names[is_body.index(True)], is_body[1] == (direction == "A2B")


def _quaternions(raw: RawSegment, kind: str, *, is_xml: bool) -> Array:
    """Unit quaternions (N, 4), scalar last, whose sign does not jump."""
    if kind.startswith("QUATERNION"):
        rows = [numbers(values, line) for line, _, values in raw.states]
        if short := [line for (line, _, _), row in zip(raw.states, rows, strict=True) if len(row) < 4]:
            raise BadSegmentError("four numbers of a quaternion are needed", short[0])
        quaternion = np.array(rows)
        if not is_xml and raw.fields.get("QUATERNION_TYPE", "LAST").upper() == "FIRST":
            quaternion = np.roll(quaternion, -1, axis=1)
        size = np.linalg.norm(np.clip(quaternion, -_FAR, _FAR), axis=1)
        off = np.flatnonzero(np.abs(size - 1.0) > 1e-3)
        if off.size:
            raise BadSegmentError(f"a quaternion of length {size[off[0]]:.4f}, expected 1", raw.states[int(off[0])][0])
        quaternion /= size[:, None]
    else:
        sequence = required(raw, "EULER_ROT_SEQ").upper().translate(str.maketrans("123", "XYZ"))
        if _SEQUENCE.fullmatch(sequence) is None:
            raise BadSegmentError(f"EULER_ROT_SEQ is {sequence[:40]!r}, expected three axes such as ZXZ", raw.line)
        angles = np.array([numbers(values[:3], line) for line, _, values in raw.states])
        turns = [turn(axis, angles[:, k]) for k, axis in enumerate(sequence)]
        quaternion = _quaternion_of(turns[2] @ turns[1] @ turns[0])
    flips = np.sign(np.sum(quaternion[1:] * quaternion[:-1], axis=1))
    steady: Array = quaternion * np.concatenate([[1.0], np.cumprod(np.where(flips < 0.0, -1.0, 1.0))])[:, None]
    return steady


def _quaternion_of(matrix: Array) -> Array:
    """Quaternions (N, 4) of passive rotations (N, 3, 3), by the largest of the four parts (Shepperd's method)."""
    m = matrix
    trace = np.trace(m, axis1=1, axis2=2)
    squares = np.stack([*(1.0 + 2.0 * m[:, k, k] - trace for k in range(3)), 1.0 + trace], axis=1) / 4.0
    products = np.zeros((m.shape[0], 4, 4))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        products[:, i, j] = products[:, j, i] = (m[:, i, j] + m[:, j, i]) / 4.0
        products[:, i, 3] = products[:, 3, i] = (m[:, j, k] - m[:, k, j]) / 4.0
        products[:, i, i] = squares[:, i]
    products[:, 3, 3] = squares[:, 3]
    largest = np.argmax(squares, axis=1)
    rows = products[np.arange(m.shape[0]), largest]
    unit: Array = rows / np.linalg.norm(rows, axis=1)[:, None]
    return unit


def matrices(quaternion: Array) -> Array:
    """Passive rotations (N, 3, 3) of unit quaternions (N, 4), scalar last."""
    v, c = quaternion[:, :3], quaternion[:, 3]
    cross = np.zeros((v.shape[0], 3, 3))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        cross[:, j, k], cross[:, k, j] = -v[:, i], v[:, i]
    inner = (c * c - np.sum(v * v, axis=1))[:, None, None] * np.eye(3)
    matrix: Array = inner + 2.0 * v[:, :, None] * v[:, None, :] - 2.0 * c[:, None, None] * cross
    return matrix


def _gaps(raw: RawSegment, tai_s: Array, quaternion: Array) -> tuple[Gap, ...]:
    """Between two states the body may turn by 2 deg, as fast as it turns there or in the intervals around."""
    step_s = np.diff(tai_s)
    turn_deg = 2.0 * np.arccos(np.minimum(1.0, np.abs(np.sum(quaternion[1:] * quaternion[:-1], axis=1)))) / DEG
    rates = np.pad(turn_deg / step_s, _NEIGHBOURS, mode="edge")
    fastest = np.max([rates[k : k + step_s.size] for k in range(2 * _NEIGHBOURS + 1)], axis=0)
    allowed_s = np.clip(TURN_PER_GAP_DEG / np.maximum(fastest, 1e-9), SHORT_S, LONGEST_S)
    bad = np.flatnonzero((step_s > allowed_s + 1e-6) | (turn_deg > _MOST_TURN_DEG))
    return tuple(
        Gap(float(tai_s[k]), float(tai_s[k + 1]), float(fastest[k]), float(allowed_s[k]), raw.states[k + 1][0])
        for k in bad.tolist()
    )
