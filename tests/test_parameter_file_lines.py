"""The tracking-parameter file line by line: what is written, what comes back, and what is refused with its line."""

import numpy as np
import pytest

from acu_daemon.errors import UsageError
from acu_daemon.onboard.bound import Bound
from acu_daemon.onboard.checks import Check
from acu_daemon.onboard.parameter_file import ParameterFile, read, write
from acu_daemon.onboard.profile import Profile
from acu_daemon.onboard.quintic import Path
from acu_daemon.orbit.timescales import tai_from_utc

START = tai_from_utc("2026-03-04T05:06:07Z")
SAME_DEG = 1e-7


def path(starts: list[float], end_s: float, seed: int) -> Path:
    first = np.random.default_rng(seed).normal(size=(1, 6)) / 10.0 ** np.arange(6)
    whole = Path(np.zeros(1), np.array([end_s]), first)
    return whole.cut(np.zeros(1), end_s) if len(starts) == 1 else _split(whole, starts, end_s)


def _split(whole: Path, starts: list[float], end_s: float) -> Path:
    times = np.linspace(0.0, end_s, 40)
    fitted = [np.polynomial.Polynomial(whole.coefficients[0]) for _ in starts]
    moved = [poly(np.polynomial.Polynomial([start, 1.0])).coef for poly, start in zip(fitted, starts, strict=True)]
    found = Path(np.array(starts), np.diff([*starts, end_s]), np.array(moved))
    assert found.value(times) == pytest.approx(whole.value(times), abs=1e-8)
    return found


AZIMUTH, ELEVATION = path([0.0, 4.0, 7.125], 12.0, 1), path([0.0, 5.5], 12.0, 2)
BOUND = Bound(1.5, 3.25, 40.0, 9.75, 30.25)
CHECKS = [Check("a", 1.0, 2.0, "deg", is_met=True), Check("b", 3.0, 2.0, "s", is_met=False, detail=" here")]


def text(bound: Bound | None = BOUND, **about: str) -> str:
    return write(START, Profile("three", AZIMUTH, ELEVATION, bound), about, CHECKS)


def test_what_is_written_comes_back() -> None:
    found = read(text(SATELLITE="X = 1", NUMBER="-2.5e3"), "a.tpf")
    assert found.start_tai_s == START
    assert found.end_s == 12.0
    assert found.profile.method == "three"
    assert found.profile.bound == BOUND
    starts = [0.0, 4.0, 5.5, 7.125]
    times = np.linspace(0.0, 12.0, 97)
    for got, put in ((found.profile.azimuth, AZIMUTH), (found.profile.elevation, ELEVATION)):
        assert got.start_s.tolist() == starts
        assert got.length_s.tolist() == [4.0, 1.5, 1.625, 4.875]
        for k in range(3):
            assert got.value(times, k) == pytest.approx(put.value(times, k), abs=SAME_DEG)
    assert found.header["SATELLITE"] == "X = 1"
    assert found.header["STOP_UTC"] == "2026-03-04T05:06:19.000Z"
    assert found.header["CHECK"].split("\n") == [str(one) for one in CHECKS]
    assert (found.number("NUMBER"), found.number("NONE")) == (-2500.0, None)
    with pytest.raises(UsageError, match=r"^SATELLITE: 'X = 1' is not a number"):
        found.number("SATELLITE")


def test_the_lines_are_in_their_order() -> None:
    lines = [line for line in text(FIRST="1", SECOND="2").splitlines() if not line.startswith("#")]
    assert lines[:10] == [
        "TRACKING_PARAMETER_FILE = 1",
        "START_UTC = 2026-03-04T05:06:07.000Z",
        "STOP_UTC = 2026-03-04T05:06:19.000Z",
        "METHOD = three",
        "FIRST = 1",
        "SECOND = 2",
        "CHECK = ok   a: 1 of 2 deg",
        "CHECK = FAIL b: 3 of 2 s here",
        "CERTIFICATE = RATE_DEG_S 1.500000000e+00 LOW_S 3.250 LOW_DEG 40.000000000 HIGH_S 9.750 HIGH_DEG 30.250000000",
        "PIECES = 4",
    ]
    assert [" ".join(line.split()[:3]) for line in lines[10:]] == [
        f"{axis} 2026-03-04T05:06:{start}Z {length}"
        for start, length in (("07.000", "4.000"), ("11.000", "1.500"), ("12.500", "1.625"), ("14.125", "4.875"))
        for axis in ("AZ", "EL")
    ]  # fmt: skip


def test_a_profile_without_a_bound_has_no_certificate() -> None:
    assert "\nCERTIFICATE" not in text(None)
    assert read(text(None), "a.tpf").profile.bound is None


def piece(axis: str, start: str, length: str, more: str = "1 2 3 4 5 6") -> str:
    return f"{axis} 2026-03-04T{start}Z {length} {more}"


def small(*pieces: str, count: int = 1, **header: str) -> str:
    keys = {
        "TRACKING_PARAMETER_FILE": "1",
        "START_UTC": "2026-03-04T05:06:07Z",
        "PIECES": str(count),
        "METHOD": "single",
        **header,
    }
    return "\n".join([*(f"{key} = {value}" for key, value in keys.items() if value), *pieces])


AZ, EL = piece("AZ", "05:06:07.000", "5"), piece("EL", "05:06:07.000", "5")


def refusal(given: str) -> str:
    with pytest.raises(UsageError) as told:
        read(given, "a.tpf")
    return str(told.value)


def test_comments_blanks_and_the_order_of_lines_do_not_matter() -> None:
    found = read(f"# x\n\n  {EL}\n\t\n# y = z\n{small(AZ)}\n", "a.tpf")
    assert found.profile.azimuth.coefficients.tolist() == [[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]]
    again = read(small(AZ, EL, NOTE="a") + "\nNOTE = b\n", "a.tpf")
    assert again.header["NOTE"] == "b"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (small(AZ, EL) + "\nwhat is this", "line 7: expected KEY = VALUE, or a piece"),
        (small(AZ + " 7", EL), "line 5: 10 fields in a piece, expected 9"),
        (small(AZ, EL[:-2]), "line 6: 8 fields in a piece, expected 9"),
        (small(piece("AZ", "05:06:07", "5s"), EL), "line 5: '5s' is not a number"),
        (small(piece("AZ", "05:06:07", "5", "1 2 3 4 5 nan"), EL), "line 5: 'nan' is not a number"),
        (small(piece("AZ", "05:06:07", "5", "1e999 2 3 4 5 6"), EL), "line 5: '1e999' is not a number"),
        (small(piece("AZ", "05:06:07", "5", "1_0 2 3 4 5 6"), EL), "line 5: '1_0' is not a number"),
        (small(AZ, EL, TRACKING_PARAMETER_FILE="2"), "expected TRACKING_PARAMETER_FILE = 1"),
        (small(AZ, EL, TRACKING_PARAMETER_FILE=""), "expected TRACKING_PARAMETER_FILE = 1"),
        (small(AZ, EL, START_UTC=""), "START_UTC is missing"),
        (small(AZ, EL, PIECES=""), "PIECES is missing"),
        (small(AZ, EL, METHOD=""), "METHOD is missing"),
        (small(AZ, EL, METHOD="Free"), "METHOD = 'Free': expected one of single, three, search, free"),
        (small(AZ), "0 pieces of EL, PIECES = 1: the file is not whole"),
        (small(EL), "0 pieces of AZ, PIECES = 1: the file is not whole"),
        (small(count=0), "0 pieces of AZ, PIECES = 0: the file is not whole"),
        (small(AZ, EL, count=2), "1 pieces of AZ, PIECES = 2"),
        (small(AZ, EL, PIECES="01"), "1 pieces of AZ, PIECES = 01"),
        (small(AZ, piece("EL", "05:06:07", "4")), "AZ and EL have different pieces"),
        (small(piece("AZ", "05:06:07.001", "5"), EL), "piece 1 of AZ does not begin where the one before ends"),
        (small(piece("AZ", "05:06:06.999", "5"), EL), "piece 1 of AZ does not begin"),
        (small(piece("AZ", "05:06:07", "0"), EL), "piece 1 of AZ does not begin"),
        (small(AZ, piece("EL", "05:06:07", "-1")), "piece 1 of EL does not begin"),
        (small(AZ, EL, CERTIFICATE="RATE_DEG_S 1 LOW_S 2"), "CERTIFICATE: expected RATE_DEG_S .. LOW_S"),
        (
            small(AZ, EL, CERTIFICATE="RATE_DEG_S 1 LOW_S 2 LOW_DEG 3 HIGH_DEG 4 HIGH_S 5"),
            "CERTIFICATE: expected RATE_DEG_S .. LOW_S .. LOW_DEG .. HIGH_S .. HIGH_DEG",
        ),
        (
            small(AZ, EL, CERTIFICATE="RATE_DEG_S 1 LOW_S 2 LOW_DEG 3 HIGH_S 4 HIGH_DEG"),
            "CERTIFICATE: expected RATE_DEG_S",
        ),
        (
            small(AZ, EL, CERTIFICATE="RATE_DEG_S 1 LOW_S 2 LOW_DEG x HIGH_S 4 HIGH_DEG 5"),
            "a.tpf: 'x' is not a number",
        ),
    ],
)
def test_what_is_wrong_is_told_with_its_line(given: str, said: str) -> None:
    told = refusal(given)
    assert said in told
    assert told.startswith("a.tpf, line " if said.startswith("line") else "a.tpf: ")


@pytest.mark.parametrize(("start", "is_read"), [("12.000", True), ("12.001", False), ("11.999", False)])
def test_a_piece_begins_where_the_one_before_ends(start: str, is_read: bool) -> None:
    rows = [piece(axis, f"05:06:{at}", "5") for axis in ("AZ", "EL") for at in ("07.000", start)]
    if is_read:
        assert read(small(*rows, count=2), "a.tpf").profile.elevation.start_s.tolist() == [0.0, 5.0]
    else:
        assert "piece 2 of AZ does not begin where the one before ends" in refusal(small(*rows, count=2))


def test_the_first_gap_is_named() -> None:
    starts = ("07.000", "12.000", "18.000", "25.000")
    rows = [piece(axis, f"05:06:{at}", "5") for axis in ("AZ", "EL") for at in starts]
    assert "piece 3 of AZ" in refusal(small(*rows, count=4))


@pytest.mark.parametrize(("length", "is_read"), [("86400", True), ("86400.5", False)])
def test_a_profile_lasts_a_day_at_most(length: str, is_read: bool) -> None:
    given = small(*(piece(axis, "05:06:07", length) for axis in ("AZ", "EL")))
    if is_read:
        found: ParameterFile = read(given, "a.tpf")
        assert found.end_s == 86400.0
    else:
        assert "more than a day" in refusal(given)


@pytest.mark.parametrize("number", ["1", "-1.5", "+2.", "3e-5", "4.25E+10", "007"])
def test_numbers_are_plain_decimals(number: str) -> None:
    given = small(AZ, EL, VALUE=number)
    assert read(given, "a.tpf").number("VALUE") == float(number)


@pytest.mark.parametrize(
    ("length", "is_read"), [("5.0004", True), ("4.9996", True), ("5.0006", False), ("4.9994", False)]
)
def test_lengths_are_rounded_to_half_a_millisecond(length: str, is_read: bool) -> None:
    rows = [
        piece(axis, f"05:06:{at}", long) for axis in ("AZ", "EL") for at, long in (("07.000", length), ("12.000", "5"))
    ]
    if is_read:
        assert read(small(*rows, count=2), "a.tpf").profile.azimuth.length_s.tolist() == [float(length), 5.0]
    else:
        assert "piece 2 of AZ does not begin where the one before ends" in refusal(small(*rows, count=2))
