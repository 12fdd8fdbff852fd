"""edge.wind_reader: wind from a file and from datagrams, and what is none."""

import asyncio
import json
import socket

import pytest

from acu_daemon.edge.wind_reader import WindReader, wind_of
from acu_daemon.orbit.timescales import tai_from_utc

UTC = "2026-08-18T12:00:00Z"
NOW = tai_from_utc(UTC)


def text(**values: object) -> bytes:
    return json.dumps({"mean_m_s": 8.2, "gust_m_s": 12.9, "utc": UTC} | values).encode()


def test_a_wind_is_read_as_it_is_written():
    sample = wind_of(text(), NOW)
    assert (sample.mean_m_s, sample.gust_m_s, sample.tai_s) == (8.2, 12.9, NOW)
    assert wind_of(text(mean_m_s=0, gust_m_s=3), NOW).gust_m_s == 3.0


@pytest.mark.parametrize(
    ("said", "reason"),
    [
        (b"", "JSON|Expecting"),
        (b"[1, 2]", "JSON object"),
        (b'{"mean_m_s": 3}', "gust_m_s"),
        (text(gust_m_s="12"), "expected a number"),
        (text(gust_m_s=True), "expected a number"),
        (b'{"mean_m_s": NaN, "gust_m_s": 3, "utc": "2026-08-18T12:00:00Z"}', "no such wind"),
        (text(mean_m_s=400.0), "no such wind"),
        (text(gust_m_s=10**400), "too large"),
        (b"[" * 100_000, "recursion"),
        (text(utc="soon"), "soon"),
        (text(utc="2026-08-18T13:00:00Z"), "ahead of this clock"),
    ],
)
def test_what_is_no_wind_says_why(said, reason):
    with pytest.raises(ValueError, match=reason):
        wind_of(said, NOW)


async def test_the_strongest_of_file_and_datagrams_counts_and_a_missing_file_is_no_end(tmp_path):
    file = tmp_path / "wind.json"
    file.write_bytes(text(gust_m_s=4.0))
    reader = WindReader(None, file)
    reader._source.take(text(gust_m_s=9.0), "10.0.0.1")
    reader._source.take(text(gust_m_s=14.0), "10.0.0.2")
    assert reader.now(NOW).gust_m_s == 14.0
    assert reader.now(NOW).gust_m_s == 4.0
    file.unlink()
    assert reader.now(NOW) is None


async def test_a_datagram_to_the_address_arrives():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    reader = WindReader(f"127.0.0.1:{port}", None)
    await reader.open()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sensor:
        sensor.sendto(text(), ("127.0.0.1", port))
    while (found := reader.now(NOW)) is None:
        await asyncio.sleep(0)
    assert found.mean_m_s == 8.2
    reader.close()
