"""A file that says where satellites are: its text, unpacked, and which format it has."""

import zlib
from collections.abc import Callable
from pathlib import Path

from acu_daemon.edge.state_directory import refuse_world_writable
from acu_daemon.errors import ElementsError
from acu_daemon.orbit.contents import FileKind, binary_kind, decoded, kind_of, what_else
from acu_daemon.orbit.cpf import parse_cpf
from acu_daemon.orbit.element_set import ElementSet, Problem
from acu_daemon.orbit.ephemeris_segment import EphemerisSegment
from acu_daemon.orbit.oem import parse_oem
from acu_daemon.orbit.omm import parse_omm
from acu_daemon.orbit.sp3 import parse_sp3
from acu_daemon.orbit.tle import parse_tle

GZIP = b"\x1f\x8b"
_BEGIN_BYTES = 8192
MOST_BYTES = 256 * 2**20  # of a file, unpacked

SetParser = Callable[[str, str], tuple[list[ElementSet], list[Problem]]]
EphemerisParser = Callable[[str, str], tuple[list[EphemerisSegment], list[Problem]]]
SET_PARSERS: dict[str, SetParser] = {"tle": parse_tle, "omm": parse_omm}
EPHEMERIS_PARSERS: dict[str, EphemerisParser] = {"oem": parse_oem, "cpf": parse_cpf, "sp3": parse_sp3}


def read_orbit_file(path: Path) -> tuple[FileKind, str]:
    """Give format and text of a file.

    Raises: ElementsError: it is of no format that is known here, or everybody may write it.  OSError.
    """
    refuse_world_writable(path)
    return contents_of(path.read_bytes(), path)


def begins_with_sets(path: Path) -> bool:
    """Whether a file holds element sets, by its begin alone; one that is packed is not looked into.  OSError."""
    with path.open("rb") as file:
        begin = file.read(_BEGIN_BYTES)
    return not begin.startswith(GZIP) and kind_of(decoded(begin)) in SET_PARSERS


def contents_of(data: bytes, path: Path) -> tuple[FileKind, str]:
    """Format and text of a file's bytes.  ElementsError: names the path and what it is instead."""
    data = unpacked(data, path)
    if what := binary_kind(data):
        raise ElementsError(f"{path}: {what}; a file of elements is text")
    text = decoded(data)
    kind = kind_of(text)
    if kind is None:
        raise ElementsError(f"{path}: {what_else(text)}")
    return kind, text


def unpacked(data: bytes, path: Path) -> bytes:
    """What a gzip file holds; other files as they are.  ElementsError: it is damaged, or too much."""
    if not data.startswith(GZIP):
        return data
    found = b""
    try:
        while data:  # members one after another
            unpacker = zlib.decompressobj(wbits=31)
            found += unpacker.decompress(data, MOST_BYTES + 1 - len(found))
            if len(found) > MOST_BYTES:
                most = f"{MOST_BYTES // 2**20} MB"
                raise ElementsError(f"{path}: more than {most} when it is unpacked: no file of elements")
            if not unpacker.eof:
                raise ElementsError(f"{path}: a gzip archive that was cut: fetch it anew")
            data = unpacker.unused_data if unpacker.unused_data.startswith(GZIP) else b""
    except zlib.error as error:
        raise ElementsError(f"{path}: a gzip archive that is damaged: {error}; fetch it anew") from None
    return found
