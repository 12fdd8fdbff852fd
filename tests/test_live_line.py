"""The live line of a terminal: one line, all an operator needs, nothing invented."""

import io
import re
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.health import status_line
from acu_daemon.daemon.live import LiveLine, live_text
from acu_daemon.daemon.overview import status_lines, steering
from acu_daemon.daemon.snapshot import Snapshot, snapshot_of
from acu_daemon.daemon.verdict import Level, verdict
from acu_daemon.orbit.timescales import tai_from_utc

SEEN = Snapshot(
    tai_s=tai_from_utc("2026-08-18T12:44:11.4Z"),
    state="AUTOTRACK/FITTED",
    az_deg=167.432,
    el_deg=58.01,
    reading_age_s=0.09,
    command_az_deg=167.4,
    command_el_deg=58.0,
    agc_db=6.0,
    is_acquired=True,
    miss_deg=0.0214,
    along_s=-0.874,
    across_deg=0.031,
    fit_age_s=0.4,
    sigma_deg=0.012,
    inside_s=61.0,
    buffer_s=88.7,
    buffer_kind="FITTED",
    lag_az_s=0.0125,
    lag_el_s=0.0125,
    tick_count=100,
    skipped_tick_count=0,
    write_count=93,
    refusal_count=0,
    is_link_up=True,
    link_problem="",
    is_rehearsal=False,
    is_simulation=False,
    utc="2026-08-18T12:44:11.4Z",
    satellite="NOAA-20",
    station="Cuiaba",
    state_s=42.0,
    off_path_deg=0.0214,
    is_on_path=True,
    path="fit",
    half_beam_deg=0.5,
    rise_utc="2026-08-18T12:40:00Z",
    set_utc="2026-08-18T12:48:43Z",
    rise_in_s=-251.4,
    set_in_s=272.0,
    culmination_deg=63.2,
)
HOLDING = replace(SEEN, state="HOLD/FITTED", is_acquired=False, miss_deg=None)
WAITING = replace(SEEN, state="IDLE", off_path_deg=None, is_on_path=None, rise_in_s=3750.0, set_in_s=4350.0)
LONG = "run.json: No space left on device; the recording, in a directory of a very long name, cannot be written either"
WIDTH = 79  # of a terminal of 80 columns: the last one stays empty


def test_it_says_verdict_pass_pointing_angles_correction_and_buffer() -> None:
    text = live_text(SEEN)
    assert text.startswith("TRACKING ")
    for part in (
        "NOAA-20 sets in 4:32",
        "ON path 0.02 deg",
        "az 167.43 el 58.01",
        "12:44:11Z",
        "AUTOTRACK/FITTED",
        "0.87 s early",
        "+0.031 deg across",
        "prediction good for 61 s",
        "buffer  89 s FITTED",
    ):
        assert part in text
    assert "\n" not in text


def test_at_80_columns_it_says_in_one_line_what_a_person_needs() -> None:
    for seen, line in (
        (SEEN, "TRACKING    NOAA-20 sets in 4:32  ON path 0.02 deg  az 167.4 el 58.0  12:44:11Z"),
        (HOLDING, "HOLDING 42 s  NOAA-20 sets in 4:32  ON path 0.02 deg  prediction good for 61 s"),
        (WAITING, "WAITING     NOAA-20 rises in 1:02:30  at 12:40:00Z up to 63 deg for 10 min"),
    ):
        assert live_text(seen, columns=WIDTH) == line
        assert len(line) <= WIDTH


def test_an_antenna_behind_its_path_at_the_zenith_is_off_in_words_and_nothing_says_that_it_is_in_the_beam() -> None:
    """An azimuth drive of 8 deg/s, 1.45 deg behind: it was shown as holding, in beam for more than 87 s."""
    seen = replace(HOLDING, off_path_deg=1.45, is_on_path=False, inside_s=88.7, agc_db=0.0)
    for text in (live_text(seen), live_text(seen, columns=WIDTH), status_line(seen), "\n".join(status_lines(seen))):
        assert text.startswith("OFF PATH")
        assert "OFF" in text
        assert "1.45" in text
        assert "in beam" not in text
    assert "prediction good for >89 s" in live_text(seen)
    assert "good for >89 s" in "\n".join(status_lines(seen))


def test_a_hold_after_a_failed_search_looks_worse_than_one_on_the_fit() -> None:
    searched = "-10.0 to +10.0 s of +-10 s along, -2.00 to +2.00 deg of +-2.0 deg across"
    lost = replace(HOLDING, state="HOLD/TLE", search=searched, path="elements")
    assert live_text(lost).startswith("NOT FOUND")
    assert verdict(lost).level is Level.BAD
    assert verdict(HOLDING).level is Level.CALM
    assert verdict(replace(HOLDING, state="HOLD/TLE", path="elements")).level is Level.WATCH
    assert verdict(replace(HOLDING, inside_s=0.0)).level is Level.WATCH
    assert verdict(replace(HOLDING, inside_s=None)).level is Level.CALM  # of an estimator without a sigma


@pytest.mark.parametrize("state", list(TrackState))
@pytest.mark.parametrize("off_deg", [None, 0.49, 0.51, 30.0])
@pytest.mark.parametrize("rise_in_s", [-100.0, 100.0])
def test_every_state_has_a_word_and_none_of_an_antenna_that_is_half_a_beam_off_is_a_good_one(
    state: TrackState, off_deg: float | None, rise_in_s: float
) -> None:
    is_on = None if off_deg is None else off_deg <= 0.5
    seen = replace(SEEN, state=str(state), off_path_deg=off_deg, is_on_path=is_on, rise_in_s=rise_in_s)
    said = verdict(seen)
    assert said.word == said.word.upper()
    assert len(said.word) <= len("MOVING TO RISE")
    assert said.why
    if is_on is False:
        assert said.word not in ("HOLDING", "AT RISE")
        assert said.level is not Level.GOOD
        assert "ON path" not in live_text(seen)


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"state": "SEARCH"}, "SEARCHING"),
        ({"state": "MANUAL"}, "LOCAL PANEL"),
        ({"state": "STOW", "acu_mode": "STOWED"}, "STOWED"),
        ({"state": "LINK-LOST", "is_link_up": False}, "NO LINK"),
        ({"state": "FAULT", "acu_faults": "emergency stop"}, "FAULT"),
        ({"state": "FAULT", "latch": "azimuth stands still", "is_stopping": True, "speed_deg_s": 3.0}, "STOPPING"),
        ({"state": "FAULT", "latch": "azimuth runs away", "speed_deg_s": 3.0}, "STILL MOVING"),
        ({"state": "FAULT", "latch": "azimuth runs away", "speed_deg_s": 0.01}, "STOPPED"),
        ({"state": "FAULT", "latch": "azimuth runs away", "speed_deg_s": None}, "STOP SENT"),
        ({"state": "PREPOSITION", "is_on_path": False, "rise_in_s": 60.0}, "MOVING TO RISE"),
        ({"state": "PREPOSITION", "is_on_path": False}, "MOVING TO PATH"),
        ({"state": "PREPOSITION", "rise_in_s": 60.0}, "AT RISE"),
        ({"state": "PREPOSITION"}, "NO SIGNAL YET"),
        ({"state": "ACQUIRE/TLE"}, "NO SIGNAL YET"),
        ({"state": "IDLE", "arming": "disarmed"}, "DISARMED"),
        ({"state": "IDLE", "set_in_s": -1.0}, "PASS OVER"),
        ({"state": "IDLE"}, "IDLE"),
    ],
)
def test_the_verdict_claims_what_is_known(changes: dict[str, Any], word: str) -> None:
    assert verdict(replace(SEEN, **changes)).word == word


def test_alarms_stand_behind_the_verdict_and_are_never_cut() -> None:
    seen = replace(SEEN, files_alarm=LONG, latch="azimuth stands still away from its command", state="FAULT")
    for columns in (40, WIDTH, 200):
        text = live_text(seen, columns=columns)
        assert all(len(line) <= columns for line in text.splitlines())
        together = " ".join(text.split())
        assert together.startswith("STOP SENT latched: azimuth stands still away from its command; not written: ")
        assert LONG in together


def test_late_is_positive_and_early_negative() -> None:
    assert "0.87 s late" in live_text(replace(SEEN, along_s=0.874))


@pytest.mark.parametrize("columns", [None, WIDTH])
def test_rehearsal_and_simulation_stand_on_it(columns: int | None) -> None:
    for seen in (SEEN, HOLDING, WAITING):
        marked = replace(seen, is_rehearsal=True, is_simulation=True)
        assert "SIMULATION REHEARSAL" in live_text(marked, columns=columns)
        assert status_line(marked).startswith("REHEARSAL, SIMULATION, ")
        assert "SIMULATION REHEARSAL" in status_lines(marked)
    assert "SIMULATION" not in live_text(SEEN)


def test_where_it_points_stands_on_a_narrow_line_of_a_rehearsal_too_whatever_the_path_is_made_from() -> None:
    for path in ("fit", "elements", "elements, moved to the signal", "last pass's fit"):
        for is_on, word in ((True, "ON path 0.02 deg"), (False, "OFF path 0.02 deg")):
            seen = replace(
                HOLDING, state="HOLD/TLE", path=path, is_on_path=is_on, is_rehearsal=True, is_simulation=True
            )
            assert word in live_text(seen, columns=WIDTH)


def test_without_a_link_no_angle_is_shown_as_if_it_were_measured() -> None:
    seen = replace(
        SEEN, is_link_up=False, state="LINK-LOST", link_problem="no answer", off_path_deg=None, reading_age_s=7.0
    )
    text = live_text(seen)
    assert text.startswith("NO LINK")
    assert "167" not in text
    assert "az      - el     -" in text
    assert "az 167" not in status_line(seen)
    (antenna,) = (line for line in status_lines(seen) if line.startswith("antenna"))
    assert "where it is now is not known" in antenna


def test_what_is_not_known_is_a_dash_or_left_out() -> None:
    text = live_text(replace(SEEN, off_path_deg=None, along_s=None, across_deg=None, az_deg=None))
    assert "path" not in text
    assert "az      - el     -" in text
    assert "no fit in force" in text
    assert "prediction not sure" in live_text(replace(HOLDING, inside_s=0.0))
    assert "prediction without a sigma" in live_text(replace(HOLDING, inside_s=None))
    assert "up for more than a day" in live_text(replace(SEEN, set_in_s=259200.0))


def test_p10_a_file_that_cannot_be_written_stands_on_it_and_on_the_services_line() -> None:
    seen = replace(SEEN, files_alarm="run.json: No space left on device")
    for text, plain in ((live_text(seen), live_text(SEEN)), (status_line(seen), status_line(SEEN))):
        assert "not written: run.json: No space left on device" in text
        assert "not written" not in plain


def test_a_bad_line_is_an_alarm_wherever_people_look() -> None:
    seen = replace(SEEN, line_alarm="9 bad replies in 10 s: look at the line")
    for text in (live_text(seen, columns=WIDTH), status_line(seen), "\n".join(status_lines(seen))):
        assert "9 bad replies in 10 s: look at the line" in " ".join(text.split())


def test_a_simulation_that_knows_the_sky_shows_the_beam_error() -> None:
    assert "beam error 0.123 deg" in live_text(SEEN, 0.1234)


def test_the_columns_stay_in_their_places_whatever_the_state() -> None:
    states = ("SEARCH", "AUTOTRACK/FITTED", "IDLE")
    assert len({live_text(replace(SEEN, state=state)).index("NOAA-20") for state in states}) == 1


def drawn(environment: dict[str, str], *shown: Snapshot) -> str:
    stream = io.StringIO()
    live = LiveLine(stream, environment)
    for seen in shown:
        live.show(seen)
        live.show(seen)
    return stream.getvalue()


def test_colours_repeat_what_words_say_and_are_left_out_where_nobody_wants_them() -> None:
    off = replace(HOLDING, off_path_deg=1.45, is_on_path=False)
    coloured = drawn({"TERM": "xterm"}, SEEN, off)
    assert "\033[32mTRACKING" in coloured
    assert "\033[1;31mOFF PATH\033[0m 42 s" in coloured
    moving = drawn({"TERM": "xterm"}, replace(SEEN, state="PREPOSITION", is_on_path=False, rise_in_s=60.0))
    assert "\033[36mMOVING TO RISE\033[0m" in moving
    for environment in ({"TERM": "xterm", "NO_COLOR": "1"}, {"TERM": "dumb"}):
        plain = drawn(environment, SEEN, off)
        assert "\033[3" not in plain
        assert "\033[1" not in plain
        assert "OFF PATH" in plain
    assert "\033[32m" in drawn({"TERM": "xterm", "NO_COLOR": ""}, SEEN)


def test_a_terminal_that_cannot_draw_gets_a_line_for_each_change_and_no_escapes() -> None:
    text = drawn({"TERM": "dumb"}, SEEN, SEEN, HOLDING, HOLDING, SEEN)
    assert "\033" not in text
    assert "\r" not in text
    assert [line.split()[0] for line in text.splitlines()] == ["TRACKING", "HOLDING", "TRACKING"]


def test_lines_of_alarms_are_taken_away_with_the_first() -> None:
    stream = io.StringIO()
    live = LiveLine(stream, {"TERM": "xterm"})
    for _ in range(2):
        live.show(replace(SEEN, files_alarm=LONG))
    rows = stream.getvalue().count("\n") + 1
    assert rows == 2
    live.clear()
    assert stream.getvalue().endswith("\r\033[K" + "\033[A\033[K" * (rows - 1))


def test_the_overview_says_all_that_a_person_needs_verdict_and_alarms_first() -> None:
    lines = status_lines(replace(SEEN, clock_alarm="the clock is not synchronised", acu="tcp://acu:3842"))
    assert lines[0] == "TRACKING for 0:42: the ACU tracks the signal"
    assert lines[1] == "ALARM       the clock is not synchronised"
    text = "\n".join(lines)
    for part in ("NOAA-20, over Cuiaba", "2026-08-18T12:44:11.4Z", "sets in 4:32 at 12:48:43Z", "tcp://acu:3842"):
        assert part in text
    assert "ON the path of the fit: 0.021 deg beside it, measured (half-power beam: 0.5 deg)" in text


def test_what_a_newer_daemon_tells_more_does_no_harm() -> None:
    values = asdict(SEEN) | {"a_key_of_the_future": 1}
    assert snapshot_of(values) == SEEN


UNITS = {"_deg": "deg", "_s": "s", "_ms": "ms", "_db": "dB", "_deg_s": "deg/s"}


def test_every_key_of_the_json_and_no_other_is_documented_with_its_unit() -> None:
    page = (Path(__file__).resolve().parents[1] / "docs" / "status.md").read_text()
    rows = re.findall(r"^\| `(\w+)` \| ([^|]*) \| [^|]+ \|$", page, re.MULTILINE)
    keys = [name for name, _ in rows]
    assert len(keys) == len(set(keys))
    assert set(keys) == set(asdict(SEEN))
    for name, unit in rows:
        ends = [one for one in UNITS if name.endswith(one)]
        if ends:
            assert unit.split(",")[0] == UNITS[max(ends, key=len)], name


def test_every_verdict_is_documented() -> None:
    root = Path(__file__).resolve().parents[1]
    said = set(re.findall(r'Verdict\(\s*"([A-Z ]+)"', (root / "acu_daemon" / "daemon" / "verdict.py").read_text()))
    said |= {"STOW", "STOWED", "STOWING"}
    assert set(re.findall(r"^\| ([A-Z ]+) \| ", (root / "docs" / "status.md").read_text(), re.MULTILINE)) == said


def test_it_is_drawn_in_place_at_every_second_tick_and_cleared_before_a_log_line() -> None:
    stream = io.StringIO()
    live = LiveLine(stream)
    live.clear()
    assert stream.getvalue() == ""
    for _ in range(6):
        live.show(SEEN)
    assert stream.getvalue().count("\r\033[K") == 3
    live.clear()
    live.clear()
    assert stream.getvalue().count("\r\033[K") == 4
    assert stream.getvalue().endswith("\r\033[K")


def test_status_has_a_row_for_a_sun_that_is_near_or_comes() -> None:
    assert not [row for row in status_lines(replace(SEEN, sun_deg=80.0)) if row.startswith("sun")]
    for changes, text in (
        ({}, "12.3 deg from the beam"),
        ({"sun_reach_s": 512.0}, "12.3 deg from the beam, its keep-out is here in 8:32"),
        (
            {"sun_reach_s": 0.0, "way_out_az_deg": 61.52, "way_out_el_deg": 30.0},
            "12.3 deg from the beam, within its keep-out, clear of it is az 61.5 el 30.0",
        ),
    ):
        [row] = [row for row in status_lines(replace(SEEN, sun_deg=12.34, **changes)) if row.startswith("sun")]
        assert row.split(maxsplit=1)[1].strip() == text


def test_of_every_state_it_is_said_what_steers() -> None:
    for state in TrackState:
        assert steering(replace(SEEN, state=str(state))).endswith(f"({state})")
