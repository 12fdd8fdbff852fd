"""The fetcher of elements against a server that misbehaves: the old set stays, it is told once, nobody is stormed."""

import asyncio
import gzip
import json
import shutil
import ssl
import subprocess
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from evolved_sets import NEWER, PLAIN, later
from made_oems import ISS
from misbehaving_server import SO_MUCH, Server, good, misbehaviours, response, serving

from acu_daemon.edge.elements_fetcher import Asker, Told, fetch_due, one_at_a_time
from acu_daemon.edge.elements_request import Login, Patience, ask_server
from acu_daemon.edge.elements_store import WantedSatellite, doubtful_file, read_sets, record_of, sets_file
from acu_daemon.edge.fetch_policy import Came, FetchOutcome, FetchState, after, before_asking, is_due, resumed
from acu_daemon.edge.fetch_state_file import group_file, read_fetch_state, state_file, write_fetch_state
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.elements import ElementLimits
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.units import DAY_S

HOUR_S, MINUTE_S = 3600.0, 60.0
EVERY_S = 8 * HOUR_S
NOW_TAI_S = PLAIN.epoch_tai_s + 0.3 * DAY_S
STATION = [WantedSatellite("ISS", 25544, ElementLimits())]
TRUST = ssl.create_default_context()
PATIENCE, NO_PATIENCE = Patience(20.0, 20.0, 20.0), Patience(0.02, 20.0, 20.0)


def group(*sets: ElementSet) -> bytes:
    return json.dumps([record_of(one, "test") for one in sets]).encode()


OLDER = later(-1.0)
OTHER = replace(NEWER, norad_id=43013, name="NOAA 20")


class Time:
    """The fetcher's clock: it stands until somebody moves it."""

    def __init__(self) -> None:
        self.tai_s = NOW_TAI_S

    def __call__(self) -> float:
        return self.tai_s


def asker(**changes: object) -> Asker:
    settings: dict[str, object] = {"patience": PATIENCE, "trusted": TRUST, "most_bytes": SO_MUCH}
    return partial(ask_server, now_unix_s=0.0, **(settings | changes))  # type: ignore[arg-type]


async def fetch(store: Path, url: str, time: Time, ask: Asker | None = None) -> list[Told]:
    return await fetch_due(store, [url], STATION, EVERY_S, time, ask or asker())


async def fetch_for_days(store: Path, url: str, time: Time, days: float, ask: Asker | None = None) -> list[Told]:
    """As a daemon that looks every ten minutes."""
    told = []
    for _ in range(round(days * 144)):
        time.tai_s += 10 * MINUTE_S
        told += await fetch(store, url, time, ask)
    return told


def contents(store: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in store.iterdir() if not path.name.startswith(".")}


def events(told: Sequence[Told]) -> list[str]:
    return [one.event.removeprefix("elements.") for one in told]


async def begun(server: Server, store: Path, time: Time) -> None:
    """A first good answer."""
    store.mkdir(exist_ok=True)
    assert events(await fetch(store, server.url, time)) == ["fetched"]
    assert [one.epoch_tai_s for one in read_sets(sets_file(store, 25544), 25544)] == [pytest.approx(PLAIN.epoch_tai_s)]


WAYS = misbehaviours(group(NEWER), group(OLDER), group(OTHER))
MOST_ASKED = {"refused": 1, "failed": 10, "unusable": 4}  # in three days


@pytest.mark.parametrize("way", WAYS)
async def test_a_server_that_misbehaves_changes_nothing_and_is_told_once(tmp_path: Path, way: str) -> None:
    """The old set stays, and in three days of looking every ten minutes nobody storms the server."""
    answer, came, reason = WAYS[way]
    store, time = tmp_path / "store", Time()
    async with serving(good(group(PLAIN))) as server:
        await begun(server, store, time)
        url = server.url
        if way == "TLS error":  # a server that talks plain HTTP where TLS was asked for
            url = url.replace("http:", "https:")
            for name in (state_file, group_file):
                shutil.copy(name(store, server.url), name(store, url))
            write_fetch_state(store, replace(read_fetch_state(store, server.url), url=url))
        before, asked_before = contents(store), len(server.requests)
        server.answer, server.hangs, server.is_blunt = answer, way == "slow", way == "TLS error"
        ask = asker(patience=NO_PATIENCE) if way == "slow" else None
        told = await fetch_for_days(store, url, time, 3.0, ask)
        assert contents(store) == before
        [one] = told
        assert one.event == ("elements.fetch_stopped" if came == "refused" else "elements.fetch_failed")
        assert one.fields["reason"].startswith(reason)
        state = read_fetch_state(store, url)
        assert bool(state.stopped) == (came == "refused")
        if way != "TLS error":
            assert 1 <= len(server.requests) - asked_before <= MOST_ASKED[came]
        assert state.failed_count <= MOST_ASKED[came]
        server.answer, server.hangs, server.is_blunt = response("200 OK", group(NEWER)), False, False
        write_fetch_state(store, resumed(replace(state, url=server.url), time(), EVERY_S))
        time.tai_s += EVERY_S
        assert events(await fetch(store, server.url, time)) == ["fetched"]
        assert len(read_sets(sets_file(store, 25544), 25544)) == 2


async def test_unchanged_is_success_and_asked_for_by_the_time_of_the_last_answer(tmp_path: Path) -> None:
    store, time = tmp_path, Time()
    async with serving(good(group(PLAIN))) as server:
        await begun(server, store, time)
        told = await fetch_for_days(store, server.url, time, 2.0)
        assert told == []
        assert len(server.requests) == 7
        assert all(b"If-Modified-Since: " in one for one in server.requests[1:])
        state = read_fetch_state(store, server.url)
        assert (state.problem, state.failed_count) == ("", 0)
        assert state.good_tai_s > NOW_TAI_S + 1.5 * DAY_S
        group_file(store, server.url).unlink()
        time.tai_s += EVERY_S
        await fetch(store, server.url, time)
        assert b"If-Modified-Since" not in server.requests[-1]
        assert group_file(store, server.url).exists()


async def test_a_stop_holds_through_restarts_until_a_person_resumes_it(tmp_path: Path) -> None:
    store, time = tmp_path, Time()
    async with serving(response("403 Forbidden", b"asked too often")) as server:
        assert events(await fetch(store, server.url, time)) == ["fetch_stopped"]
        server.answer = good(group(PLAIN))
        assert await fetch_for_days(store, server.url, time, 20.0) == []
        assert len(server.requests) == 1
        write_fetch_state(store, resumed(read_fetch_state(store, server.url), time(), EVERY_S))
        assert events(await fetch(store, server.url, time)) == ["fetched"]


async def test_a_503_that_names_a_time_is_heeded(tmp_path: Path) -> None:
    async with serving(response("503 Service Unavailable", b"", "Retry-After: 7200")) as server:
        time = Time()
        await fetch(tmp_path, server.url, time)
        assert read_fetch_state(tmp_path, server.url).next_tai_s == pytest.approx(time() + 7200.0)
        server.answer = response("503 Service Unavailable", b"", "Retry-After: Thu, 01 Jan 1970 03:00:00 GMT")
        time.tai_s += 7200.0
        await fetch(tmp_path, server.url, time)
        assert read_fetch_state(tmp_path, server.url).next_tai_s == pytest.approx(time() + 3 * HOUR_S)


async def test_an_answer_that_is_packed_and_says_so_is_read(tmp_path: Path) -> None:
    async with serving(response("200 OK", gzip.compress(group(PLAIN)), "Content-Encoding: gzip")) as server:
        assert events(await fetch(tmp_path, server.url, Time())) == ["fetched"]


@pytest.mark.parametrize("form", ["tle", "csv", "catalogue of nine digits"])
async def test_groups_are_read_as_servers_give_them(tmp_path: Path, form: str) -> None:
    big = replace(PLAIN, norad_id=799500124)
    record = record_of(PLAIN, "t") | {"NORAD_CAT_ID": "25544"}
    body = {
        "tle": f"ISS\n{ISS}".encode(),
        "csv": (",".join(record) + "\n" + ",".join(str(one).replace(",", "") for one in record.values())).encode(),
        "catalogue of nine digits": group(big),
    }[form]
    wanted = [WantedSatellite("ISS", 799500124 if "nine" in form else 25544, ElementLimits())]
    async with serving(good(body)) as server:
        assert events(await fetch_due(tmp_path, [server.url], wanted, EVERY_S, Time(), asker())) == ["fetched"]
    [kept] = read_sets(sets_file(tmp_path, wanted[0].norad_id), wanted[0].norad_id)
    assert kept.epoch_tai_s == pytest.approx(PLAIN.epoch_tai_s, abs=1e-5)
    assert kept.mean_anomaly_rad == pytest.approx(PLAIN.mean_anomaly_rad, abs=1e-12)


async def test_a_set_far_along_the_track_is_kept_beside_the_old_one_and_told_once(tmp_path: Path) -> None:
    """By 2 degrees of the orbit, 240 km, as after a reboost."""
    moved = replace(NEWER, mean_anomaly_rad=NEWER.mean_anomaly_rad + 0.035)
    store, time = tmp_path, Time()
    async with serving(good(group(PLAIN))) as server:
        await begun(server, store, time)
        before = sets_file(store, 25544).read_bytes()
        server.answer = response("200 OK", group(moved))
        told = await fetch_for_days(store, server.url, time, 2.0)
        assert events(told) == ["fetched", "doubtful", "fetched", "fetched", "fetched", "fetched", "fetched"]
        assert "it puts the satellite 238 km" in told[1].fields["reason"]
        assert sets_file(store, 25544).read_bytes() == before
        [beside] = read_sets(doubtful_file(store, 25544), 25544)
        assert beside.epoch_tai_s == pytest.approx(moved.epoch_tai_s, abs=1e-5)


async def test_where_nothing_can_be_written_nobody_is_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, data: bytes, **_: object) -> None:
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr("acu_daemon.edge.fetch_state_file.replace_file", full)
    async with serving(good(group(PLAIN))) as server:
        with pytest.raises(OSError, match="No space left"):
            await fetch(tmp_path, server.url, Time())
        assert server.requests == []


async def test_a_process_that_dies_while_it_asks_has_asked(tmp_path: Path) -> None:
    time = Time()

    async def dies(state: FetchState) -> tuple[FetchOutcome, bytes]:
        raise asyncio.CancelledError

    with pytest.raises(asyncio.CancelledError):
        await fetch(tmp_path, "http://x/", time, dies)
    state = read_fetch_state(tmp_path, "http://x/")
    assert not is_due(state, time(), EVERY_S)
    assert is_due(state, time() + 900.0, EVERY_S)


async def test_a_login_is_sent_to_space_track_alone_and_a_refused_one_stops(tmp_path: Path) -> None:
    login = Login("me@example.org", "a&b secret")
    async with serving(good(group(PLAIN))) as server:
        query = server.url.replace("/group.json", "/basicspacedata/query/class/gp/NORAD_CAT_ID/25544/format/json")
        assert events(await fetch(tmp_path, query, Time(), asker(login=login))) == ["fetched"]
        assert server.requests[0].startswith(b"POST /ajaxauth/login ")
        assert b"identity=me%40example.org&password=a%26b+secret&query=http" in server.requests[0]
        assert events(await fetch(tmp_path, server.url, Time(), asker(login=login))) == ["fetched"]
        assert server.requests[1].startswith(b"GET /group.json ")
        server.answer = good(b'{"Login":"Failed"}')
        [told] = await fetch(tmp_path, query + "/2", Time(), asker(login=login))
        assert (told.event, told.fields["reason"][:20]) == ("elements.fetch_stopped", "the login is refused")


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl, which makes a certificate, is not there")
async def test_a_certificate_that_nobody_vouches_for_is_refused_and_one_of_ca_file_believed(tmp_path: Path) -> None:
    key, certificate = tmp_path / "key.pem", tmp_path / "cert.pem"
    words = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    words += ["-keyout", str(key), "-out", str(certificate), "-days", "2", "-subj", "/CN=127.0.0.1"]
    await asyncio.to_thread(
        subprocess.run, [*words, "-addext", "subjectAltName=IP:127.0.0.1"], check=True, capture_output=True
    )
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    tls.load_cert_chain(certificate, key)
    vouched = ssl.create_default_context(cafile=str(certificate))
    async with serving(good(group(PLAIN)), tls) as server:
        [told] = await fetch(tmp_path, server.url, Time(), asker())
        assert told.event == "elements.fetch_failed"
        assert "certificate" in told.fields["reason"]
        url = server.url + "?again"
        assert events(await fetch(tmp_path, url, Time(), asker(trusted=vouched))) == ["fetched"]


def test_pauses_grow_and_end_at_a_day_and_a_clock_that_was_wrong_does_not_hold_for_ever() -> None:
    state, now = FetchState("u"), 0.0
    pauses = []
    for _ in range(9):
        state = after(before_asking(state, now, EVERY_S), FetchOutcome(Came.FAILED, "no"), now, EVERY_S)
        pauses.append((state.next_tai_s - now) / 60.0)
        now = state.next_tai_s
    assert pauses[0] >= 15.0
    assert pauses[-1] == 24 * 60.0
    assert not is_due(state, now - 1.0, EVERY_S)
    assert is_due(state, now - 10 * DAY_S, EVERY_S)


def test_a_state_that_is_damaged_stops_rather_than_storms(tmp_path: Path) -> None:
    write_fetch_state(tmp_path, FetchState("http://x/", asked_tai_s=tai_from_utc("2026-11-30T00:00:00Z")))
    assert read_fetch_state(tmp_path, "http://x/").asked_tai_s == tai_from_utc("2026-11-30T00:00:00Z")
    for text in ("", "{", "[]", '{"version": 1, "url": "http://x/", "next_tai_s": "soon"}', '{"version": 2}'):
        state_file(tmp_path, "http://x/").write_text(text)
        state = read_fetch_state(tmp_path, "http://x/")
        assert "cannot be read" in state.stopped
        assert not is_due(state, 1e12, EVERY_S)


async def test_however_much_there_is_to_say_the_state_can_be_read_again(tmp_path: Path) -> None:
    async def talks(state: FetchState) -> tuple[FetchOutcome, bytes]:
        return FetchOutcome(Came.FAILED, "é" * 100_000), b""

    await fetch(tmp_path, "http://x/", Time(), talks)
    state = read_fetch_state(tmp_path, "http://x/")
    assert (state.stopped, len(state.problem)) == ("", 2000)


def test_only_one_fetches_at_a_time(tmp_path: Path) -> None:
    with one_at_a_time(tmp_path) as first, one_at_a_time(tmp_path) as second:
        assert (first, second) == (True, False)
    with one_at_a_time(tmp_path) as again:
        assert again
