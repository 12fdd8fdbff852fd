"""CCSDS messages of a pass: TDM, OMM and OEM as others read them, exact in what they print, and of use elsewhere."""

import gzip
import json
import re
import shutil
from collections import defaultdict
from dataclasses import replace
from functools import cache
from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ccsds_ndm.ndm_io import NdmIo
from fault_tapes import path_of
from flights import DEMO_ANTENNA, SCD_HIGH_TAI_S, WRONG_ORBIT, climb, demo_target, flight_of, scd_target
from sgp4 import omm
from sgp4.api import Satrec

import acu_daemon.cli as cli
from acu_daemon.assist.session.refit import RefitRequest, Refitter
from acu_daemon.cli.options import load_target
from acu_daemon.cli.pass_messages import messages_of, write_messages
from acu_daemon.cli.replay_wire import replay_pass
from acu_daemon.cli.tape_head import TapedPass
from acu_daemon.edge.tape_file import SUFFIX
from acu_daemon.model import Correction, Readings, Site, Station, sky_angle_deg
from acu_daemon.orbit.ephemeris import Ephemeris, EphemerisPropagator
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.message_writing import Sender, omm_text
from acu_daemon.orbit.moved_epoch import at_epoch
from acu_daemon.orbit.oem import parse_oem
from acu_daemon.orbit.omm import parse_omm
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import tai_from_ccsds
from acu_daemon.pointing.air import Air
from acu_daemon.pointing.mount import Mount
from acu_daemon.report.pass_watch import PassWatch, SeenReading
from acu_daemon.report.tracking_message import tdm_text
from acu_daemon.sim.sky import DelayedPropagator

DEMO = Path(cli.__file__).parent / "demo_config"
REVOLUTION_S = 5930.0
CATALOGUE_AGE_S = 5.0 * 86400.0
SENDER = Sender("US", 8e8)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("messages")


@cache
def seen(path: Path) -> tuple[TapedPass, PassWatch]:
    watch = PassWatch()
    return replay_pass(path, watch).taped, watch


@cache
def flown(folder: Path) -> Path:
    """A minute and a half of the demo's pass, by a satellite that is late and beside its elements."""
    path = folder / f"flown{SUFFIX}"
    climb(90.0, losses=[(40.0, 50.0)], tape=path)
    return path


def message(path: Path, ending: str) -> str:
    return next(one.text for one in messages_of(*seen(path)) if one.ending == ending)


# TDM


METADATA = {
    "TIME_SYSTEM", "START_TIME", "STOP_TIME", "PARTICIPANT_1", "PARTICIPANT_2", "MODE", "PATH", "TIMETAG_REF",
    "ANGLE_TYPE", "DATA_QUALITY",
}  # fmt: skip
DATA = {"ANGLE_1", "ANGLE_2", "PRESSURE", "TEMPERATURE", "RHUMIDITY"}


def check_rules(text: str) -> list[dict[str, Any]]:
    """What the standard and Orekit's reader demand; the segments."""
    assert text.isascii()
    assert all(len(line) <= 254 for line in text.splitlines())
    head, *rest = text.split("META_START\n")
    assert re.fullmatch(r"CCSDS_TDM_VERS = 2\.0\n(COMMENT .*\n)*CREATION_DATE = \S+\nORIGINATOR = \S.*\n", head), head
    segments = []
    for part in rest:
        meta_text, data_text = part.split("META_STOP\nDATA_START\n")
        assert data_text.endswith("DATA_STOP\n")
        assert re.fullmatch(r"(COMMENT .*\n)*([A-Z_0-9]+ = \S.*\n)+", meta_text)  # comments at the start alone
        meta = dict(re.findall(r"^(?!COMMENT)(\w+) = (.*)$", meta_text, re.MULTILINE))
        assert set(meta) == METADATA
        assert (meta["MODE"], meta["PATH"], meta["ANGLE_TYPE"]) == ("SEQUENTIAL", "2,1", "AZEL")
        values: defaultdict[str, list[tuple[str, float]]] = defaultdict(list)
        for line in data_text.splitlines()[:-1]:
            keyword, equals, when, value = line.split(" ")  # a token more is refused
            assert (keyword in DATA, equals) == (True, "=")
            values[keyword].append((when, float(value)))
        for found in values.values():
            times = [tai_from_ccsds(when) for when, _ in found]
            assert all(np.diff(times) > 0.0)
            assert meta["START_TIME"] <= found[0][0] <= found[-1][0] <= meta["STOP_TIME"]
        for angle in ("ANGLE_1", "ANGLE_2"):
            assert all(-180.0 <= value < 360.0 for _, value in values[angle])
        assert not any(key.startswith("CORRECTION") for key in meta)
        segments.append({"meta": meta, "values": values})
    return segments


def test_a_tdm_keeps_the_rules_and_has_a_segment_for_each_change_of_lock() -> None:
    segments = check_rules(message(path_of("receiver-fault"), "tdm"))
    assert [one["meta"]["DATA_QUALITY"] for one in segments] == ["VALIDATED", "DEGRADED"] * 3 + ["VALIDATED"]
    weather = segments[0]["values"]
    assert 900.0 < weather["PRESSURE"][0][1] < 1100.0
    assert 250.0 < weather["TEMPERATURE"][0][1] < 320.0
    assert 0.0 <= weather["RHUMIDITY"][0][1] <= 100.0


def test_a_tdm_is_read_by_others_and_gives_the_readings_back_within_its_digits() -> None:
    text, (_, watch) = message(path_of("receiver-fault"), "tdm"), seen(path_of("receiver-fault"))
    read = NdmIo().from_string(text)
    found: list[tuple[float, float, float]] = []
    for segment in read.body.segment:
        az = [one for one in segment.data.observation if one.angle_1 is not None]
        el = [one for one in segment.data.observation if one.angle_2 is not None]
        for a, e in zip(az, el, strict=True):
            assert a.epoch == e.epoch
            found.append((tai_from_ccsds(a.epoch), _value(a.angle_1), _value(e.angle_2)))
    acquired = [k for k, one in enumerate(watch.readings) if one.is_acquired]
    given = watch.readings[acquired[0] : acquired[-1] + 1]
    assert len(found) == len(given) > 100
    off = np.array(found) - np.array([(one.tai_s, one.az_deg, one.el_deg) for one in given])
    assert np.abs(off[:, 0]).max() < 0.6e-6
    assert np.abs(off[:, 1:]).max() <= 0.5e-5 + 1e-9


def _value(angle: Any) -> float:
    return float(getattr(angle, "value", angle))


def reading(t_s: float, az_deg: float, is_acquired: bool = True) -> SeenReading:
    return SeenReading(8e8 + t_s, az_deg, 10.0, is_acquired, is_acquired, None, "", None, None)


@pytest.mark.parametrize("az_deg", [0.0, 359.999999, -0.000001, 180.0])
def test_an_azimuth_is_reduced_below_a_full_turn(az_deg: float) -> None:
    text = tdm_text([reading(0.0, az_deg), reading(0.1, az_deg)], "S", "Sat", Mount(), None, SENDER)
    (segment,) = check_rules(text)
    assert abs((segment["values"]["ANGLE_1"][0][1] - az_deg + 180.0) % 360.0 - 180.0) < 1e-5


def test_surveyed_terms_are_taken_out_names_are_ascii_and_a_gap_or_no_signal_is_told() -> None:
    readings = [reading(0.0, 20.0), reading(0.1, 20.0), reading(60.0, 21.0), reading(60.0, 21.0)]
    air = Air(1013.25, 15.0, 50.0)
    text = tdm_text(readings, "Brasília", "Sät \n1", Mount(ia_deg=0.5), air, SENDER, has_signal=False)
    first, second = check_rules(text)
    assert (first["meta"]["PARTICIPANT_1"], first["meta"]["DATA_QUALITY"]) == ("Brasilia", "RAW")
    assert first["values"]["ANGLE_1"][0][1] == 19.5
    assert len(second["values"]["ANGLE_1"]) == 1
    assert tdm_text([reading(0.0, 1.0, is_acquired=False)], "S", "Sat", Mount(), None, SENDER) == ""


def test_a_segment_lasts_as_long_as_its_quality_and_the_line() -> None:
    """However long that is; a gap of less than five seconds ends none."""
    ends_s = [(0.0, 30.0, True), (34.9, 60.0, True), (65.1, 80.0, True), (80.1, 95.0, False), (95.1, 96.0, True)]
    spells = [(first + 0.1 * np.arange(round(10.0 * (last - first)) + 1), lock) for first, last, lock in ends_s]
    readings = [reading(float(t), 20.0, is_acquired=lock) for times, lock in spells for t in times]
    segments = check_rules(tdm_text(readings, "S", "Sat", Mount(), None, SENDER))
    assert [len(one["values"]["ANGLE_1"]) for one in segments] == [301 + 252, 150, 150, 10]
    assert [one["meta"]["DATA_QUALITY"] for one in segments] == ["VALIDATED", "VALIDATED", "DEGRADED", "VALIDATED"]


# OMM


@pytest.mark.long
def test_an_omm_is_read_by_others_and_by_sgp4_and_is_the_fitted_orbit_within_a_metre(folder: Path) -> None:
    taped, watch = seen(flown(folder))
    text, fit = message(flown(folder), "omm"), watch.fits[-1].fit
    read = NdmIo().from_string(text).body.segment
    assert read.metadata.mean_element_theory == "SGP4"
    fields = dict(re.findall(r"^(?!COMMENT)(\w+) = (.*)$", text, re.MULTILINE))
    satellite = Satrec()
    omm.initialize(satellite, fields)
    (ours,), problems = parse_omm(text, "made.omm")
    assert problems == []
    wanted = taped.job.refit.propagator.corrected(fit.correction)
    times = np.linspace(fit.at_tai_s - REVOLUTION_S / 2.0, fit.at_tai_s + REVOLUTION_S / 2.0, 50)
    r_m, _ = wanted.states_teme(times)
    days = satellite.jdsatepochF + (times - ours.epoch_tai_s) / 86400.0
    _, theirs_km, _ = satellite.sgp4_array(np.full(times.shape, satellite.jdsatepoch), days)
    assert np.linalg.norm(theirs_km * 1e3 - r_m, axis=1).max() < 1.0
    assert np.linalg.norm(Sgp4Propagator(ours).states_teme(times)[0] - r_m, axis=1).max() < 1.0
    assert (fields["ORIGINATOR"], "not the catalogue's" in text) == ("ACU-DAEMON", True)


def test_our_own_fit_to_the_same_readings_has_nothing_to_add_to_the_omm(folder: Path) -> None:
    taped, watch = seen(flown(folder))
    (elements,), _ = parse_omm(message(flown(folder), "omm"), "made.omm")
    refitter = Refitter(replace(taped.job.refit, propagator=Sgp4Propagator(elements), carried=None))
    given = Readings.joined(watch.fitted_readings)
    now = float(given.tai_s[-1])
    reply = refitter.refit(RefitRequest(given, now, 30.0, now, float(given.az_deg[-1])))
    before, spread = watch.fits[-1].fit, reply.prediction.spread
    assert before.along_s == pytest.approx(0.9, abs=0.2)
    along_s, across_deg = (0.0, 0.0) if reply.fit is None else (reply.fit.along_s, reply.fit.across_deg)
    assert abs(along_s) < 0.05
    assert abs(across_deg) < 0.01
    assert spread is None or spread[0] < 0.1


@pytest.mark.parametrize("days", [-2.0, 0.3, 3.0])
def test_elements_are_moved_to_another_epoch_without_moving_the_orbit(days: float) -> None:
    source = demo_target().elements.propagator
    assert isinstance(source, Sgp4Propagator)
    corrected = source.corrected(Correction(1e-4, 2e-4, 1e-9, 1e-5, -2e-5, 1e-5))
    elements, off_m = at_epoch(corrected, source.epoch_tai_s + days * 86400.0)
    assert off_m < 1.0
    assert elements.epoch_tai_s == source.epoch_tai_s + days * 86400.0


# OEM


@pytest.mark.long
def test_an_oem_of_other_sources_is_the_fit_within_a_metre_and_padded(folder: Path) -> None:
    path = folder / f"scd{SUFFIX}"
    flight_of(scd_target(SCD_HIGH_TAI_S), SCD_HIGH_TAI_S, 20.0, antenna=DEMO_ANTENNA, tape=path)
    taped, watch = seen(path)
    text = message(path, "oem")
    assert text.isascii()
    read = NdmIo().from_string(text).body.segment[0]
    assert (read.metadata.interpolation, read.metadata.interpolation_degree) == ("HERMITE", 7)
    segments, problems = parse_oem(text, "made.oem")
    assert problems == []
    site = taped.job.refit.site
    made = EphemerisPropagator(Ephemeris(segments, site.orientation))
    coming = taped.job.coming
    assert coming is not None
    assert segments[0].tai_s[0] <= coming.rise_tai_s - 500.0
    wanted = taped.job.refit.propagator.corrected(watch.fits[-1].fit.correction if watch.fits else Correction())
    times = np.linspace(coming.rise_tai_s, coming.set_tai_s + 3600.0, 500)
    off_m = np.linalg.norm(made.states_teme(times)[0] - wanted.states_teme(times)[0], axis=1)
    assert off_m.max() < 1.0


# The next station


def test_the_next_station_tracks_by_the_fitted_orbit_and_is_nearer_at_its_rise(folder: Path, tmp_path: Path) -> None:
    taped, watch = seen(flown(folder))
    sent = tmp_path / "sent"
    sent.mkdir()
    write_messages(taped, watch, sent, "from-cuiaba", None)
    config = tmp_path / "next"
    shutil.copytree(DEMO, config)
    text = (config / "station.toml").read_text().replace("latitude_deg = -15.53", "latitude_deg = 2.8")
    text = text.replace("longitude_deg = -56.07", "longitude_deg = -60.7")
    (config / "station.toml").write_text(f'{text}\n[elements]\nsource = ["{sent}"]\n')
    catalogue, now = taped.job.refit.propagator, watch.ticks_tai_s[-1]
    assert isinstance(catalogue, Sgp4Propagator)
    old, _ = at_epoch(catalogue, catalogue.epoch_tai_s - CATALOGUE_AGE_S)  # the same orbit, told days ago
    (config / "satellites" / "demo-1.tle").write_text(omm_text(old, SENDER))
    target = load_target(config, "demo-1", now)
    assert target.elements.file.endswith("from-cuiaba.omm")
    truth = DelayedPropagator(
        catalogue.corrected(Correction(delta_raan_rad=radians(WRONG_ORBIT.delta_raan_deg))), WRONG_ORBIT.along_track_s
    )
    site = target.station.site
    rise = find_passes(truth, site, now, now + 86400.0, 5.0)[0].rise_tai_s
    by_catalogue, by_fit = (off_deg(one, truth, rise, site.station) for one in (catalogue, target.elements.propagator))
    assert by_catalogue > 0.05
    assert by_fit < by_catalogue / 2.0, (by_catalogue, by_fit)


def off_deg(source: Propagator, truth: Propagator, tai_s: float, station: Station) -> float:
    """Angle at a station between where a source and the truth have a satellite."""
    (a, b) = (look_at(one, np.array([tai_s]), Site(station)) for one in (source, truth))
    return sky_angle_deg(float(a.az_deg[0]), float(a.el_deg[0]), float(b.az_deg[0]), float(b.el_deg[0]))


def test_the_orbit_alone_is_sent_and_never_that_of_a_rehearsal(tmp_path: Path) -> None:
    def sent(is_rehearsal: bool) -> list[str]:
        path = tmp_path / f"pass-{is_rehearsal}{SUFFIX}"
        with gzip.open(path_of("latch"), "rt") as file:
            first, _, rest = file.read().partition("\n")
        head = json.loads(first) | {"is_rehearsal": is_rehearsal}
        station = json.loads(head["station"]) | {"recording": {"send_to": "next"}}
        with gzip.open(path, "wt") as file:
            file.write(json.dumps(head | {"station": json.dumps(station)}) + "\n" + rest)
        (tmp_path / "next").mkdir(exist_ok=True)
        write_messages(*seen(path), tmp_path, "pass", tmp_path)
        return sorted(one.name for one in (tmp_path / "next").iterdir())

    assert sent(is_rehearsal=True) == []
    assert sent(is_rehearsal=False) == ["DEMO-1.omm"]


def test_the_readers_of_others_are_no_part_of_the_daemon() -> None:
    package = Path(cli.__file__).parents[1]
    assert [path.name for path in package.rglob("*.py") if "ccsds_ndm" in path.read_text(encoding="utf-8")] == []
