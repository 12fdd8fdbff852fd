"""What `status` says of the passes after the one that is on."""

import json
from dataclasses import replace
from pathlib import Path

from command_line import acu_daemon
from flights import SCD_HIGH_TAI_S, climb, scd_target, the_pass

from acu_daemon.cli.run_setup import SHOWN_COUNT, next_passes
from acu_daemon.daemon.overview import status_rows
from acu_daemon.orbit.timescales import tai_from_utc, utc_text

CONFIG = Path(__file__).resolve().parents[1] / "config"


def test_the_next_three_passes_are_those_of_the_passes_command() -> None:
    target = scd_target(SCD_HIGH_TAI_S)
    coming = the_pass(target, SCD_HIGH_TAI_S)
    said = next_passes(target, coming)
    start = utc_text(coming.set_tai_s + 60.0)
    listed = json.loads(acu_daemon("passes", "--config", CONFIG, "--satellite", "scd-1", "--from", start, "--json").out)
    assert said == tuple(
        f"SCD-1 {utc_text_of(one['rise_utc'])} {one['culmination_el_deg']:.0f} deg" for one in listed[:SHOWN_COUNT]
    )


def utc_text_of(utc: str) -> str:
    return utc_text(tai_from_utc(utc), 0)[11:16]


def test_status_has_a_row_for_them_and_none_where_there_are_none() -> None:
    seen = climb(1.0).snapshots[-1]
    assert "next" not in dict(status_rows(seen))
    rows = dict(status_rows(replace(seen, next_passes=("A 10:00 40 deg", "B 12:00 80 deg"))))
    assert rows["next"] == "A 10:00 40 deg; B 12:00 80 deg"
