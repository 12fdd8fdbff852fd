"""Live weather from a file and by UDP: taken while it is fresh and possible, told and passed over otherwise."""

import asyncio
import json
import os
import socket
from pathlib import Path
from typing import Any

import pytest
from command_line import acu_daemon
from config_files import BROUWER, write
from config_files import STATION as STATION_FILE
from flights import demo_target
from structlog.testing import capture_logs

from acu_daemon.cli.weather_watch import WeatherWatch
from acu_daemon.config.antenna_tables import AtmosphereSection
from acu_daemon.edge.weather import WeatherReader, weather_of
from acu_daemon.model import Station
from acu_daemon.orbit.timescales import tai_from_utc, utc_text

STATION = Station("Cuiaba", -15.53, -56.07, 277.0)
NOW_TAI_S = tai_from_utc("2026-08-18T12:00:00Z")
SAID = {"pressure_hpa": 981.5, "temperature_c": 31, "humidity_percent": 80.0, "utc": "2026-08-18T11:50:00Z"}
GIVEN = AtmosphereSection(refraction=True, temperature_c=20.0)
BY_FILE = GIVEN.model_copy(update={"weather_file": "weather.json"})


def text_of(**changes: Any) -> bytes:
    return json.dumps({name: value for name, value in {**SAID, **changes}.items() if value is not None}).encode()


def reader_of(directory: Path, text: bytes | None, given: AtmosphereSection = BY_FILE) -> WeatherReader:
    if text is not None:
        (directory / "weather.json").write_bytes(text)
    return WeatherReader(given, STATION, directory)


def test_weather_takes_the_place_of_what_was_typed() -> None:
    now = weather_of(text_of(), GIVEN, STATION, NOW_TAI_S)
    assert now.atmosphere == GIVEN.model_copy(
        update={"pressure_hpa": 981.5, "temperature_c": 31.0, "humidity_percent": 80.0}
    )
    assert NOW_TAI_S - now.tai_s == pytest.approx(600.0)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (text_of(utc="2026-08-18T10:59:00Z"), "3660 s old (weather_max_age_s = 3600)"),
        (text_of(utc="2026-08-18T12:05:00Z"), "300 s ahead of this clock"),
        (text_of(utc=None), "utc is missing"),
        (text_of(utc=3), "not in the form"),
        (text_of(utc="noon"), "noon"),
        (text_of(pressure_hpa=None), "pressure_hpa is missing"),
        (text_of(pressure_hpa="981"), "expected a number"),
        (text_of(pressure_hpa=True), "expected a number"),
        (text_of(pressure_hpa=float("nan")), "expected a finite number"),
        (text_of(pressure_hpa=800.0), "at 277 m about 98"),
        (text_of(temperature_c=300.0), "expected at most 60"),
        (text_of(humidity_percent=-1.0), "expected at least 0"),
        (text_of(temperature_c=50.0, humidity_percent=100.0), "refractivity of"),
        (b"[1]", "expected a JSON object"),
        (b"{", "not JSON, or only a part"),
        (b"\xff\x00", "not JSON, or only a part"),
        (b"", "not JSON, or only a part"),
        (b"[" * 9000, "not JSON, or only a part"),
    ],
)
def test_what_is_no_weather_of_now_and_here_is_told_and_passed_over(tmp_path: Path, text: bytes, reason: str) -> None:
    reader = reader_of(tmp_path, text)
    assert reader.now(NOW_TAI_S) == BY_FILE
    assert reason in reader.problem
    with capture_logs() as logs:
        reader.tell()
        reader.now(NOW_TAI_S + 1.0)
        reader.tell()
    assert [one["event"] for one in logs] == ["weather.ignored"]  # once, though its age has changed
    assert logs[0]["in_force"] == "[atmosphere]"


def test_no_file_or_a_pipe_is_told_and_keeps_nobody_waiting(tmp_path: Path) -> None:
    reader = reader_of(tmp_path, None)
    assert reader.now(NOW_TAI_S) == BY_FILE
    assert "No such file" in reader.problem
    os.mkfifo(tmp_path / "weather.json")
    assert reader.now(NOW_TAI_S) == BY_FILE
    assert "expected a file" in reader.problem


def test_weather_that_stops_coming_holds_until_it_is_old(tmp_path: Path) -> None:
    reader = reader_of(tmp_path, text_of())
    assert reader.now(NOW_TAI_S).pressure_hpa == 981.5
    (tmp_path / "weather.json").write_bytes(b"{")
    assert reader.now(NOW_TAI_S + 2999.0).pressure_hpa == 981.5
    assert reader.now(NOW_TAI_S + 3001.0) == BY_FILE


def test_in_a_vacuum_nothing_is_read(tmp_path: Path) -> None:
    vacuum = BY_FILE.model_copy(update={"refraction": False})
    reader = reader_of(tmp_path, b"{", vacuum)
    assert reader.now(NOW_TAI_S) == vacuum
    assert reader.problem == ""


def test_the_newest_of_file_and_datagrams_is_taken_and_rubbish_harms_neither(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        port = one.getsockname()[1]
    given = BY_FILE.model_copy(update={"weather_udp": f"127.0.0.1:{port}"})

    async def main() -> list[float | None]:
        reader = reader_of(tmp_path, text_of(), given)
        seen = [reader.now(NOW_TAI_S).pressure_hpa]
        await reader.open()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for text in (text_of(pressure_hpa=990.0, utc="2026-08-18T11:59:00Z"), b"\x00rubbish"):
                sender.sendto(text, ("127.0.0.1", port))
                for _ in range(20):  # the loop hears it in one of its next turns
                    await asyncio.sleep(0)
                seen.append(reader.now(NOW_TAI_S).pressure_hpa)
        reader.close()
        return seen

    assert asyncio.run(main()) == [981.5, 990.0, 990.0]


def test_an_address_that_cannot_be_had_is_told_and_the_file_still_read(tmp_path: Path) -> None:
    given = BY_FILE.model_copy(update={"weather_udp": "203.0.113.1:4840"})

    async def main() -> float | None:
        reader = reader_of(tmp_path, text_of(), given)
        await reader.open()
        return reader.now(NOW_TAI_S).pressure_hpa

    with capture_logs() as logs:
        assert asyncio.run(main()) == 981.5
    assert [one["event"] for one in logs] == ["weather.no_socket"]


def test_the_pass_is_planned_anew_where_the_air_has_changed_and_not_for_less(tmp_path: Path) -> None:
    target = demo_target(atmosphere={"weather_file": "weather.json"})
    file = tmp_path / "weather.json"
    file.write_bytes(text_of())

    async def looked(watch: WeatherWatch, **changes: Any) -> bool:
        file.write_bytes(text_of(utc=utc_text(NOW_TAI_S), **changes))
        watch.look(NOW_TAI_S)
        await asyncio.gather(*(task for task in asyncio.all_tasks() if task.get_name() == "weather"))
        return watch.look(NOW_TAI_S)

    async def main() -> None:
        watch = WeatherWatch(tmp_path, target, NOW_TAI_S)
        first = watch.on(target).station.site.antenna
        assert first != target.station.site.antenna
        assert not await looked(watch, temperature_c=31.1)
        assert watch.on(target).station.site.antenna == first
        assert await looked(watch, temperature_c=10.0)
        assert watch.on(target).station.site.antenna != first
        file.write_bytes(text_of(utc=utc_text(NOW_TAI_S), temperature_c=25.0))
        assert watch.on(target, NOW_TAI_S).station.atmosphere.temperature_c == 25.0
        other = demo_target(atmosphere={"refraction": True, "temperature_c": 1.0})
        assert watch.on(other, NOW_TAI_S) == other

    asyncio.run(main())


def test_check_tells_the_weather_in_force(tmp_path: Path) -> None:
    toml = f'{STATION_FILE}\n[atmosphere]\nrefraction = true\nweather_file = "weather.json"\n'
    config = write(tmp_path, toml, scd=BROUWER)

    def air() -> str:
        lines = acu_daemon("check", "--config", config).out.splitlines()
        return next(line for line in lines if line[7:].startswith("air "))

    assert air().startswith("WARN")
    assert "weather.json: No such file" in air()


@pytest.mark.parametrize("address", ["4840", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:x", ":4840", "127.0.0.1:65536"])
def test_an_address_without_a_port_is_refused(address: str) -> None:
    with pytest.raises(ValueError, match="expected ADDRESS:PORT"):
        AtmosphereSection(weather_udp=address)
