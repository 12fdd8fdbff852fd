"""Passes cut out of orbit files by scripts/passes_from_orbit.py, as the simulator flies them, and what is refused."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from made_oems import ISS, START, iss, kvn, states
from made_tables import TURNED, cpf, made_states
from script_modules import load

from acu_daemon.model import Site, Station
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.sim.sky import read_truth

PLACE = Station("Here", 34.73, -86.58, 190.0)
HERE = "Here,34.73,-86.58,190"


def cut(monkeypatch: pytest.MonkeyPatch, *words: str | Path) -> int:
    script = load("passes_from_orbit")
    monkeypatch.setattr(sys, "argv", ["passes_from_orbit.py", *map(str, words)])
    return int(script.main())


def test_a_pass_out_of_a_prediction_is_that_of_the_orbit_behind_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "iss.cpf").write_text(cpf(made_states(5 * 3600.0, 60.0)))
    (tmp_path / "iss.tle").write_text(ISS)
    options = ("--station", HERE, "--elements", tmp_path / "iss.tle", "--out", tmp_path / "out")
    assert cut(monkeypatch, tmp_path / "iss.cpf", *options) == 0
    site = Site(PLACE, TURNED)
    expected = find_passes(iss(), site, START, START + 5 * 3600.0, 5.0)
    truths = sorted((tmp_path / "out").glob("*.truth.csv"))
    assert len(truths) == len([one for one in expected if one.culmination_el_deg >= 10.0]) >= 1
    table = read_truth(truths[0])
    [first, *_] = [one for one in expected if one.culmination_el_deg >= 10.0]
    at_tai_s = first.culmination_tai_s + 0.4
    seen, told = look_at(iss(), np.array([at_tai_s]), site), table.direction(at_tai_s)
    assert told is not None
    assert told[:2] == pytest.approx((float(seen.az_deg[0]), float(seen.el_deg[0])), abs=1e-4)
    about = json.loads(truths[0].with_name(truths[0].name.replace(".truth.csv", ".json")).read_text())
    assert (about["satellite"], about["station"], about["truth_source"]) == ("iss", "Here", "iss.cpf")
    assert about["max_el_deg"] == pytest.approx(first.culmination_el_deg, abs=0.05)
    assert truths[0].with_name(truths[0].name.replace(".truth.csv", ".tle")).read_text() == ISS
    assert about["element_age_days"] == pytest.approx(1.3, abs=0.3)


def test_a_pass_that_the_ends_of_the_file_cut_is_left_out_and_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    [first, *_] = find_passes(iss(), Site(PLACE), START, START + 86400.0, 5.0)
    begin = first.culmination_tai_s
    (tmp_path / "iss.oem").write_text(kvn(states(600.0, 60.0, begin)))
    assert cut(monkeypatch, tmp_path / "iss.oem", "--station", HERE, "--out", tmp_path / "out") == 1
    said = capsys.readouterr().err
    assert "left out: 1 that an end of the orbit cuts" in said
    assert "is inertial (TEME): without --earth-orientation" in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["iss.tle", "--out", "out"], "iss.tle: elements (tle); expected CPF, SP3 or OEM"),
        (["none.cpf", "--out", "out"], "none.cpf: No such file or directory"),
        (["iss.tle", "--out", "out", "--station", "Here,91,0,0"], "expected a name, -90 to 90"),
        (["iss.tle", "--out", "out", "--station", "Here,1,0"], "expected NAME,LATITUDE,LONGITUDE,HEIGHT"),
    ],
)
def test_what_is_wrong_is_told(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "iss.tle").write_text(ISS)
    with pytest.raises(SystemExit) as end:
        cut(monkeypatch, *words)
    assert end.value.code == 2
    assert said in capsys.readouterr().err
