"""daemon.overview: each row of `status` by value, at each limit and with each thing unknown, and their order."""

from dataclasses import replace
from typing import Any

import pytest
from test_live_line import SEEN

from acu_daemon.daemon.overview import headline, status_lines, status_rows, steering
from acu_daemon.daemon.snapshot import Snapshot

STEP = 1e-6


def seen(**changes: Any) -> Snapshot:
    return replace(SEEN, **changes)


def row(name: str, **changes: Any) -> str | None:
    return dict(status_rows(seen(**changes))).get(name)


def test_the_most_wanted_rows_come_first() -> None:
    everything = seen(
        zenith="crossing it costs 4 s",
        phantom="clear",
        wind="wind 3 m/s",
        paused_until_utc="2026-08-19T00:00:00Z",
        tilt="leans 3 deg",
        elements="TLE of today",
        nudge_along_s=1.0,
        sun_deg=5.0,
        next_passes=("A", "B"),
    )
    assert [name for name, _ in status_rows(everything)] == [
        *("time", "satellite", "pass", "zenith", "foreseen", "wind", "paused", "tilt", "elements", "steers", "antenna"),
        *("command", "path", "nudge", "signal", "prediction", "buffer", "sun", "control", "next", "late ticks"),
    ]
    rows = dict(status_rows(everything))
    assert rows["zenith"] == "crossing it costs 4 s"
    assert rows["foreseen"] == "clear"
    assert rows["wind"] == "3 m/s"
    assert rows["paused"] == "no pass is begun until 2026-08-19T00:00:00Z"
    assert rows["tilt"] == "leans 3 deg"
    assert rows["next"] == "A; B"
    assert rows["time"] == "2026-08-18T12:44:11.4Z"


def test_lines_are_verdict_mark_alarms_and_rows_in_columns() -> None:
    one = seen(is_simulation=True, clock_alarm="bad clock", line_alarm="bad line")
    lines = status_lines(one)
    assert lines[:2] == [headline(one), "SIMULATION"]
    assert {line for line in lines if line.startswith("ALARM")} == {"ALARM       bad clock", "ALARM       bad line"}
    assert [line.startswith("ALARM") for line in lines[2:5]] == [True, True, False]
    assert lines[4:] == [f"{name:11} {text}" for name, text in status_rows(one)]
    assert status_lines(SEEN)[1] == "time        2026-08-18T12:44:11.4Z"


@pytest.mark.parametrize(("state_s", "since"), [(None, ""), (0.0, " for 0:00"), (61.0, " for 1:01")])
def test_the_verdict_says_since_when_where_it_is_known(state_s: float | None, since: str) -> None:
    assert headline(seen(state_s=state_s)) == f"TRACKING{since}: the ACU tracks the signal"


@pytest.mark.parametrize(
    ("name", "changes", "text"),
    [
        ("satellite", {}, "NOAA-20, over Cuiaba"),
        ("satellite", {"station": ""}, "NOAA-20"),
        ("satellite", {"station": "", "satellite": ""}, None),
        ("satellite", {"satellite": ""}, "Cuiaba"),
        ("wind", {}, None),
        ("wind", {"wind": "strong wind 20 m/s"}, "strong wind 20 m/s"),
        ("paused", {}, None),
        ("elements", {}, None),
        ("elements", {"elements": "TLE"}, "TLE"),
        ("elements", {"elements_problem": "no network"}, "no network"),
        ("elements", {"elements": "TLE", "elements_problem": "no network"}, "TLE; no network"),
        ("ACU", {}, None),
        ("ACU", {"acu": "tcp://a"}, "tcp://a"),
        ("ACU", {"acu_mode": "PROGRAM"}, "PROGRAM"),
        ("ACU", {"acu": "tcp://a", "acu_mode": "PROGRAM"}, "tcp://a, PROGRAM"),
        ("ACU", {"acu": "tcp://a", "acu_mode": "PROGRAM", "is_link_up": False}, "tcp://a, no link"),
        ("late ticks", {}, "0 of 100 skipped"),
        ("late ticks", {"skipped_tick_count": 7}, "7 of 107 skipped"),
        ("next", {}, None),
        # the pass
        ("pass", {}, "sets in 4:32 at 12:48:43Z"),
        ("pass", {"set_in_s": -1.0}, "has set"),
        ("pass", {"set_in_s": 90000.0}, "up for more than a day"),
        (
            "pass",
            {"rise_in_s": 61.0, "set_in_s": 661.0},
            "rises in 1:01 at 12:40:00Z up to 63 deg for 10 min",
        ),
        ("pass", {"rise_in_s": 61.0, "culmination_deg": None}, "rises in 1:01"),
        ("pass", {"rise_in_s": None}, None),
        # the antenna
        ("antenna", {}, "az 167.43 el 58.01 deg, measured 0.1 s ago"),
        ("antenna", {"speed_deg_s": 0.256}, "az 167.43 el 58.01 deg, measured 0.1 s ago, moving 0.26 deg/s"),
        ("antenna", {"speed_deg_s": 0.0}, "az 167.43 el 58.01 deg, measured 0.1 s ago, moving 0.00 deg/s"),
        ("antenna", {"reading_age_s": 1.0}, "az 167.43 el 58.01 deg, measured 1.0 s ago"),
        (
            "antenna",
            {"reading_age_s": 1.0 + STEP, "speed_deg_s": 0.5},
            "was at az 167.43 el 58.01 deg, measured 1.0 s ago; where it is now is not known",
        ),
        (
            "antenna",
            {"is_link_up": False, "speed_deg_s": 0.5},
            "was at az 167.43 el 58.01 deg, measured 0.1 s ago; where it is now is not known",
        ),
        *(("antenna", {key: None}, "not known: no reading yet") for key in ("az_deg", "el_deg", "reading_age_s")),
        ("command", {}, "az 167.40 el 58.00 deg, last written, azimuth over all turns"),
        (
            "command",
            {"command_az_deg": -200.0, "command_el_deg": 5.5},
            "az -200.00 el 5.50 deg, last written, azimuth over all turns",
        ),
        ("command", {"command_az_deg": None}, None),
        ("command", {"command_el_deg": None}, None),
        # path
        ("path", {}, "ON the path of the fit: 0.021 deg beside it, measured (half-power beam: 0.5 deg)"),
        (
            "path",
            {"is_on_path": False, "path": "elements"},
            "OFF the path of the elements: 0.021 deg beside it, measured (half-power beam: 0.5 deg)",
        ),
        ("path", {"is_on_path": False, "state": "PREPOSITION", "off_path_deg": 40.06}, "40.1 deg to go, measured"),
        (
            "path",
            {"state": "PREPOSITION"},
            "ON the path of the fit: 0.021 deg beside it, measured (half-power beam: 0.5 deg)",
        ),
        ("path", {"off_path_deg": None}, None),
        ("path", {"half_beam_deg": None}, None),
        ("nudge", {}, None),
        ("nudge", {"nudge_along_s": -1.5}, "1.50 s early, +0.000 deg across, by a person"),
        # signal
        ("signal", {}, "acquired, by the ACU, AGC 6.0 dB"),
        ("signal", {"agc_db": None}, "acquired, by the ACU"),
        ("signal", {"is_acquired": False}, "not acquired, AGC 6.0 dB"),
        ("signal", {"is_acquired": False, "signal_lost_s": 12.4}, "not acquired for 12 s, AGC 6.0 dB"),
        ("signal", {"signal_lost_s": 12.4}, "acquired, by the ACU, AGC 6.0 dB"),
        ("signal", {"state": "PROGRAM"}, "acquired, by a receiver, AGC 6.0 dB"),
        ("signal", {"is_link_up": False}, "not known: no link"),
        ("signal", {"is_link_up": False, "is_told_of_signal": False}, "not known: no link"),
        (
            "signal",
            {"signal_db": 9.5, "signal_age_s": 0.3},
            "acquired, by the ACU, AGC 6.0 dB, receiver 9.5 dB 0.3 s ago",
        ),
        ("signal", {"signal_age_s": 0.3, "agc_db": None, "state": "PROGRAM"}, "acquired, by a receiver 0.3 s ago"),
        ("signal", {"signal_age_s": 0.3, "state": "PROGRAM"}, "acquired, by a receiver 0.3 s ago, AGC 6.0 dB"),
        ("signal", {"signal_age_s": 0.3}, "acquired, by the ACU, AGC 6.0 dB, receiver heard 0.3 s ago"),
        ("signal", {"signal_db": 9.5}, "acquired, by the ACU, AGC 6.0 dB"),
        # prediction
        ("prediction", {}, "good for 61 s, 1 sigma 0.012 deg; 0.87 s early +0.031 deg across, fit 0 s old"),
        (
            "prediction",
            {"sigma_deg": None, "inside_s": None},
            "without a sigma; 0.87 s early +0.031 deg across, fit 0 s old",
        ),
        ("prediction", {"fit_age_s": None, "along_s": None}, "good for 61 s, 1 sigma 0.012 deg; no fit in force"),
        (
            "prediction",
            {"fit_age_s": 12.6},
            "good for 61 s, 1 sigma 0.012 deg; 0.87 s early +0.031 deg across, fit 13 s old",
        ),
        ("prediction", {"buffer_kind": ""}, None),
        ("buffer", {}, "89 s FITTED ahead"),
        ("buffer", {"buffer_kind": ""}, None),
        # sun
        ("sun", {}, None),
        ("sun", {"sun_deg": 20.0 - STEP}, "20.0 deg from the beam"),
        ("sun", {"sun_deg": 20.0}, None),
        ("sun", {"sun_deg": 80.0, "sun_reach_s": 61.0}, "80.0 deg from the beam, its keep-out is here in 1:01"),
        (
            "sun",
            {"sun_deg": 1.0, "sun_reach_s": 0.0, "way_out_az_deg": 1.0},
            "1.0 deg from the beam, within its keep-out",
        ),
        (
            "sun",
            {"sun_deg": 1.0, "sun_reach_s": 0.0, "way_out_el_deg": 1.0},
            "1.0 deg from the beam, within its keep-out",
        ),
        (
            "sun",
            {"sun_deg": 80.0, "sun_reach_s": 61.0, "way_out_az_deg": 2.0, "way_out_el_deg": 1.0},
            "80.0 deg from the beam, its keep-out is here in 1:01, clear of it is az 2.0 el 1.0",
        ),
        # control
        ("control", {}, "armed, AUTOTRACK/FITTED, 93 writes"),
        (
            "control",
            {"arming": "shadow", "clamped_count": 1},
            "shadow, AUTOTRACK/FITTED, 93 writes (1 slowed, 0 held at a limit, 0 refused)",
        ),
        (
            "control",
            {"limited_count": 2},
            "armed, AUTOTRACK/FITTED, 93 writes (0 slowed, 2 held at a limit, 0 refused)",
        ),
        (
            "control",
            {"refusal_count": 3},
            "armed, AUTOTRACK/FITTED, 93 writes (0 slowed, 0 held at a limit, 3 refused)",
        ),
    ],
)
def test_a_row_says_what_is_known_or_is_left_out(name: str, changes: dict[str, Any], text: str | None) -> None:
    assert row(name, **changes) == text


@pytest.mark.parametrize(
    ("state", "text"),
    [
        ("IDLE", "nobody"),
        ("PREPOSITION", "the daemon, to where the pass begins; then autotrack"),
        ("ACQUIRE/TLE", "the daemon, by the elements; autotrack takes over with the signal"),
        ("AUTOTRACK/TLE", "the ACU's autotrack; the elements would take over"),
        ("AUTOTRACK/FITTED", "the ACU's autotrack; this pass's fit would take over"),
        ("PROGRAM", "the daemon, along the predicted path, with or without a signal"),
        ("HOLD/FITTED", "the daemon, by this pass's fit; autotrack takes over with the signal"),
        ("HOLD/TLE", "the daemon, by the elements; autotrack takes over with the signal"),
        ("SEARCH", "the daemon, around the path; autotrack takes over with the signal"),
        ("ZENITH", "the daemon, past the zenith; then autotrack"),
        ("FALSE-LOCK", "the daemon, back from a false lock onto the path; then autotrack"),
        ("AVOID", "the daemon, clear of a keep-out; then autotrack"),
        ("SLAVED", "another program, by the write lease; then the daemon"),
        ("MANUAL", "the local panel"),
        ("STOW", "the ACU, to or in its stow position"),
        ("FAULT", "nobody"),
        ("LINK-LOST", "not known: no link"),
    ],
)
def test_what_steers_and_what_would_take_over(state: str, text: str) -> None:
    assert steering(seen(state=state)) == f"{text} ({state})"
    assert row("steers", state=state) == f"{text} ({state})"
