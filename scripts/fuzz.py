"""Coverage-guided fuzzing of everything that reads what others wrote; scripts/fuzz.sh runs all targets.

    python scripts/fuzz.py TARGET [libFuzzer options] [corpus directory]

A target fails on any exception but the error that it promises, on a hang (-timeout) and on memory (-rss_limit_mb).
"""

import contextlib
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import atheris
import numpy as np
import structlog

with atheris.instrument_imports(include=["acu_daemon"]):
    from acu_daemon.acu.commands import AcuMode, Identify, Poll
    from acu_daemon.config.load import load_satellite, load_station
    from acu_daemon.drivers.sa3842.codec import CommandDecoder, ReplyDecoder, encode_command, encode_reply
    from acu_daemon.drivers.sa3842.exchange import HostExchange
    from acu_daemon.drivers.sa3842.messages import Status
    from acu_daemon.edge.carry_over_file import read_carry_over
    from acu_daemon.edge.elements_file import load_elements
    from acu_daemon.edge.recording import read_readings
    from acu_daemon.errors import AttitudeError, ConfigError, ElementsError, UsageError
    from acu_daemon.model import EarthOrientation
    from acu_daemon.onboard.aem import parse_aem
    from acu_daemon.onboard.aem_attitude import AemAttitude
    from acu_daemon.onboard.parameter_file import read as read_parameters
    from acu_daemon.onboard.recheck import check_certificate, check_peaks
    from acu_daemon.orbit.cpf import parse_cpf
    from acu_daemon.orbit.element_set import Problem
    from acu_daemon.orbit.ephemeris import Ephemeris
    from acu_daemon.orbit.ephemeris_segment import EphemerisSegment
    from acu_daemon.orbit.oem import parse_oem
    from acu_daemon.orbit.omm import parse_omm
    from acu_daemon.orbit.sp3 import parse_sp3
    from acu_daemon.orbit.tle import parse_tle
    from acu_daemon.sim.scenario import read_scenario

ROOT = Path(__file__).resolve().parents[1]
SCRATCH = Path(tempfile.mkdtemp(prefix="acu-fuzz-", dir="/dev/shm" if Path("/dev/shm").is_dir() else None))
LONGEST_FRAME = 133  # bytes: docs/protocol.md, Frame
NOW_TAI_S = 8.4e8
STATUS = Status(90.0, 45.0, AcuMode.REMOTE)  # angles that 16 bits hold exactly


def codec(data: bytes) -> None:
    """Any bytes, cut anywhere: nothing raises, memory is a frame's, and a good frame after them is read."""
    whole, cut = ReplyDecoder(), ReplyDecoder()
    cuts = [i for i, byte in enumerate(data) if byte % 7 == 0]
    pieces = [data[i:j] for i, j in zip([0, *cuts], [*cuts, len(data)], strict=True)]
    seen = whole.feed(data)
    assert seen == [event for piece in pieces for event in cut.feed(piece)], "segmentation changes what is read"
    good = encode_reply(0x31, STATUS)
    heard = [event for _ in range(LONGEST_FRAME // len(good) + 2) for event in whole.feed(good)]
    assert heard[-1].reply == STATUS, "no resynchronisation within the longest frame"
    host = HostExchange()
    host.begin(Poll(), 0.0)
    host.receive(data, 0.0)
    commands = CommandDecoder(gap_s=1e9)
    for event in commands.feed(data, 0.0):
        if event.command is not None:
            again = CommandDecoder(gap_s=1e9).feed(encode_command(event.command), 0.0)
            assert [item.cmd for item in again] == [event.cmd], "a command does not survive its own encoding"
    asked = encode_command(Identify())
    answers = [event for _ in range(LONGEST_FRAME // len(asked) + 2) for event in commands.feed(asked, 0.0)]
    assert answers[-1].command == Identify(), "the ACU's side does not resynchronise"


def config(data: bytes) -> None:
    """station.toml and a satellite's file, parted by a line of five dashes; elements are loaded where both are good."""
    station_text, _, satellite_text = data.partition(b"\n-----\n")
    (SCRATCH / "satellites").mkdir(exist_ok=True)
    (SCRATCH / "station.toml").write_bytes(station_text)
    (SCRATCH / "satellites" / "x.toml").write_bytes(satellite_text)
    with contextlib.suppress(ConfigError, ElementsError):
        station = load_station(SCRATCH)
        satellite, _ = load_satellite(SCRATCH, "x", station)
        if satellite.elements.kind == "brouwer":
            load_elements(satellite, SCRATCH / "satellites" / "x.toml", NOW_TAI_S)


def readings(data: bytes) -> None:
    path = SCRATCH / "readings.csv"
    path.write_bytes(data)
    with contextlib.suppress(UsageError):
        read_readings(path)


def scenario(data: bytes) -> None:
    path = SCRATCH / "scenario.toml"
    path.write_bytes(data)
    with contextlib.suppress(ConfigError):
        read_scenario(path)


def carry_over(data: bytes) -> None:
    path = SCRATCH / "carry.json"
    path.write_bytes(data)
    read_carry_over(path, "DEMO-1 (99901)")
    for left in SCRATCH.glob("carry.json*"):
        left.unlink()


def tle(data: bytes) -> None:
    parse_tle(data.decode("utf-8", "replace"), "f")


def omm(data: bytes) -> None:
    parse_omm(data.decode("utf-8", "replace"), "f")


def oem(data: bytes) -> None:
    parse_oem(data.decode("utf-8", "replace"), "f")


def cpf(data: bytes) -> None:
    _states(*parse_cpf(data.decode("utf-8", "replace"), "f"))


def sp3(data: bytes) -> None:
    _states(*parse_sp3(data.decode("utf-8", "replace"), "f"))


def _states(segments: list[EphemerisSegment], problems: list[Problem]) -> None:
    """Segments that are read give states, or are refused as no orbit; where there are none it is said why."""
    assert segments or problems
    for segment in segments:
        with contextlib.suppress(ElementsError):
            Ephemeris([segment], EarthOrientation()).states(segment.tai_s[:1])


def aem(data: bytes) -> None:
    """A message that is read can be asked for the attitude at its first state."""
    for segment in parse_aem(data.decode("utf-8", "replace"), "f")[0]:
        with contextlib.suppress(AttitudeError):
            AemAttitude([segment], EarthOrientation()).body_from_lvlh(segment.tai_s[:1], np.eye(3)[None])


def tracking_parameters(data: bytes) -> None:
    with contextlib.suppress(UsageError):
        found = read_parameters(data.decode("utf-8", "replace"), "f")
        check_peaks(found)
        check_certificate(found, None)


TARGETS: dict[str, Callable[[bytes], None]] = {
    target.__name__: target
    for target in (codec, config, readings, scenario, carry_over, tle, omm, oem, cpf, sp3, aem, tracking_parameters)
}


def main() -> None:
    if len(sys.argv) < 2 or sys.argv[1] not in TARGETS:
        sys.exit(f"usage: fuzz.py TARGET [libFuzzer options] [corpus]; targets: {', '.join(TARGETS)}")
    target = TARGETS[sys.argv.pop(1)]
    structlog.configure(logger_factory=structlog.ReturnLoggerFactory())  # what a reader warns of is no finding
    atheris.Setup(sys.argv, target)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
