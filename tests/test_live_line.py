"""The live line of a terminal: one line, all an operator needs, nothing invented."""

import io
from dataclasses import replace

from acu_daemon.daemon.health import status_line
from acu_daemon.daemon.live import LiveLine, live_text
from acu_daemon.daemon.snapshot import Snapshot
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
)


def test_it_says_state_angles_miss_correction_and_buffer() -> None:
    text = live_text(SEEN)
    assert text.startswith("12:44:11.4Z  AUTOTRACK/FITTED")
    for part in (
        "az  167.43 el  58.01",
        "0.021 deg",
        "0.87 s early",
        "+0.031 deg across",
        "in beam 61 s",
        "buffer  89 s FITTED",
    ):
        assert part in text
    assert "\n" not in text


def test_late_is_positive_and_early_negative() -> None:
    assert "0.87 s late" in live_text(replace(SEEN, along_s=0.874))


def test_rehearsal_and_simulation_stand_on_it() -> None:
    text = live_text(replace(SEEN, is_rehearsal=True, is_simulation=True))
    assert text.startswith("12:44:11.4Z SIMULATION REHEARSAL")  # before all that a narrow terminal cuts off
    assert "SIMULATION" not in live_text(SEEN)


def test_without_a_link_no_angle_is_shown_as_if_it_were_measured() -> None:
    text = live_text(replace(SEEN, is_link_up=False, state="LINK-LOST"))
    assert "167" not in text
    assert "az       - el      -" in text


def test_what_is_not_known_is_a_dash() -> None:
    text = live_text(replace(SEEN, miss_deg=None, along_s=None, across_deg=None, az_deg=None))
    assert "off prediction     - deg" in text
    assert "no fit in force" in text


def test_p10_a_file_that_cannot_be_written_stands_on_it_and_on_the_services_line() -> None:
    seen = replace(SEEN, files_alarm="run.json: No space left on device")
    for text, plain in ((live_text(seen), live_text(SEEN)), (status_line(seen), status_line(SEEN))):
        assert "not written: run.json: No space left on device" in text
        assert "not written" not in plain


def test_a_simulation_that_knows_the_sky_shows_the_beam_error() -> None:
    assert "beam error 0.123 deg" in live_text(SEEN, 0.1234)


def test_the_columns_stay_in_their_places_whatever_the_state() -> None:
    states = ("IDLE", "AUTOTRACK/FITTED", "LINK-LOST", "PREPOSITION")
    assert len({live_text(replace(SEEN, state=state)).index("az ") for state in states}) == 1


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
