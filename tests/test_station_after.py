"""Where the antenna waits between two passes: `[schedule] after`."""

from pathlib import Path

import pytest
from config_files import BROUWER, replaced, write
from test_station import FIRST, HIGH, SHORT, START

from acu_daemon.acu.commands import AcuMode
from acu_daemon.cli.virtual_station import Action, Days, StationAccess, run_days

LATER = replaced(BROUWER, "SCD-1", "SCD-9").replace("mean_anomaly_deg = 350.56", "mean_anomaly_deg = 320.0")
SETS_S, RISES_S = 330.0, 773.0  # of the first pass and of the second one, after START, about


def days(
    directory: Path, after: str, until_s: float, script: list[tuple[float, Action]] | None = None, later: str = LATER
) -> Days:
    station = f'{HIGH}[schedule]\nafter = "{after}"\nnext_within_s = 60\n'
    config, state = write(directory / "config", station, scd=BROUWER + FIRST, later=later + SHORT), directory / "state"
    state.mkdir()
    return run_days(config, state, START + 260.0, START + until_s, script=script or [])


def modes(found: Days, from_s: float, to_s: float) -> set[AcuMode]:
    return {row.mode for row in found.rows if START + from_s < row.tai_s < START + to_s}


def test_next_waits_where_the_next_pass_rises(tmp_path: Path) -> None:
    places: list[tuple[float, float]] = []

    def look(access: StationAccess) -> None:
        entry = access.runs.day.keeper.coming()
        assert entry is not None
        place = access.runs.day._next_rise.at(entry, START)
        places.append(place if place is not None else (0.0, 0.0))

    found = days(tmp_path, "next", SETS_S + 60.0, [(START + SETS_S + 50.0, look)])
    [(az_deg, el_deg)], last = places, found.rows[-1]
    assert el_deg == pytest.approx(60.0, abs=0.1)  # the station's lowest elevation
    assert (last.encoder_az_deg, last.encoder_el_deg) == (
        pytest.approx(az_deg, abs=0.1),
        pytest.approx(el_deg, abs=0.1),
    )
    assert last.mode is AcuMode.STANDBY


def test_stow_is_the_schedules_and_the_next_pass_ends_it(tmp_path: Path) -> None:
    found = days(tmp_path, "stow", RISES_S - 80.0)
    assert modes(found, SETS_S + 30.0, RISES_S - 150.0) == {AcuMode.STOWED}
    assert found.rows[-1].mode is AcuMode.REMOTE
    assert [one["by"] for one in found.named("stow.begins")] == ["schedule"]


@pytest.mark.long
def test_a_pass_that_is_due_on_the_way_to_the_stow_begins_once_it_is_reached_and_takes_it_for_nobodys(
    tmp_path: Path,
) -> None:
    soon = LATER.replace("mean_anomaly_deg = 320.0", "mean_anomaly_deg = 338.0")
    found = days(tmp_path, "stow", SETS_S + 150.0, later=soon)
    assert AcuMode.STOWING in modes(found, SETS_S, SETS_S + 60.0)
    assert [one["by"] for one in found.named("stow.begins")] == ["schedule"]
    assert found.rows[-1].mode in (AcuMode.REMOTE, AcuMode.AUTOTRACK)
