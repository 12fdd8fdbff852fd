"""Metrics: what they count, that Prometheus' own tools find nothing to say, and a real Prometheus that scrapes them."""

import asyncio
import contextlib
import json
import re
import shutil
import signal
import socket
import subprocess
import time
import urllib.parse
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import aiohttp
import pytest
from command_line import acu_daemon
from flights import DEMO_ANTENNA, DEMO_TAI_S, climb, demo_target, sky_of
from script_modules import load
from test_live_line import SEEN

from acu_daemon.assist.reading_gate import SIDE_LOBE
from acu_daemon.cli.outlets_beside import Outlets, via_of
from acu_daemon.cli.virtual_pass import fly
from acu_daemon.control.orders import Event
from acu_daemon.control.tracking.state_table import Cause, TrackState
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.tally import Buckets, RunFigures, Tally, phase_of
from acu_daemon.edge.clock import LoopClock
from acu_daemon.outlets.metric_families import Surroundings
from acu_daemon.outlets.metrics_server import MetricsServer, render
from acu_daemon.sim.scenario import Loss, Scenario

MONITORING = Path(__file__).resolve().parents[1] / "monitoring"
PATIENCE_S = 90.0
NOW = 1_800_000_000.0
needs_promtool = pytest.mark.skipif(shutil.which("promtool") is None, reason="needs promtool (apt install prometheus)")
needs_prometheus = pytest.mark.skipif(shutil.which("prometheus") is None, reason="needs prometheus (Debian's)")
pass_rig = load("pass_rig")


def values(page: bytes) -> dict[str, float]:
    """Value by series of a page."""
    lines = [line.rsplit(" ", 1) for line in page.decode().splitlines() if not line.startswith("#")]
    return {series: float(value) for series, value in lines}


def seen_of(**more: Any) -> Snapshot:
    return replace(SEEN, **more)


def full_tally() -> Tally:
    """A tally in which everything has happened."""
    tally = Tally()
    figures = RunFigures(3, 5, 1, 0, {"late": 2}, 1.0, 100.0, 1.0, 0.01, 0.5, True)
    seen = seen_of(
        tai_s=10.0,
        satellite="SCD-1",
        rise_in_s=-1.0,
        set_in_s=99.0,
        is_on_path=True,
        acu_mode="REMOTE",
        inside_s=40.0,
        sigma_deg=0.1,
        sun_deg=50.0,
        off_path_deg=0.1,
        along_s=0.5,
        across_deg=0.1,
        fit_age_s=1.0,
        agc_db=10.0,
        rejected_counts={SIDE_LOBE: 4},
    )
    tally.see(seen, figures)
    tally.see(replace(seen, tai_s=11.0, az_deg=(seen.az_deg or 0.0) + 1.0), figures)
    tally.checks = {"clock": True, "ACU": False}
    for late_s in (1e-5, 3e-4, 1.0):
        tally.lateness.add(late_s)
    for at_s in (0.0, 0.1, 0.2):
        tally.wrote(at_s)
    tally.exchanged(0.01)
    tally.count("actions", "arm cli")
    tally.count("fetches", "celestrak.org")
    tally.count("fetches_failed", "celestrak.org failed")
    tally.told(Event("state.changed", changed("AUTOTRACK/FITTED", "HOLD/FITTED", Cause.LOST)), 5.0)
    tally.told(Event("state.changed", changed("HOLD/FITTED", "AUTOTRACK/FITTED", Cause.ACQUIRED)), 9.0)
    return tally


def changed(before: str, state: str, cause: Cause) -> dict[str, str]:
    return {"before": before, "state": state, "cause": str(cause)}


AROUND = Surroundings("rotctl", (8.0, 12.0), (11.1, 16.9), 5_000_000_000)


# Counted


def test_a_distribution_counts_what_is_at_most_each_bound() -> None:
    buckets = Buckets((1.0, 2.0))
    for value in (0.5, 1.0, 1.5, 9.0):
        buckets.add(value)
    assert (buckets.cumulated(), buckets.total) == ([2, 3, 4], 12.0)


def test_everything_that_happened_is_on_the_page() -> None:
    found = values(render(full_tally(), AROUND, NOW))
    assert found['acu_signal_losses_total{cause="lost"}'] == 1.0
    assert found['acu_relock_seconds_bucket{le="5.0"}'] == 1.0
    assert found["acu_relock_seconds_sum"] == 4.0
    assert found['acu_readings_rejected_total{reason="side_lobe"}'] == 4.0
    assert found["acu_link_reconnects_total"] == 2.0
    assert found['acu_write_gap_seconds_bucket{le="0.1"}'] >= 1.0
    assert found["acu_write_gap_seconds_count"] == 2.0
    assert found['acu_tick_lateness_seconds_bucket{le="0.0005"}'] == 2.0
    assert found["acu_pass_visible_seconds_total"] == found["acu_pass_on_target_seconds_total"] == 1.0
    assert found['acu_axis_travel_degrees_total{axis="azimuth"}'] == pytest.approx(1.0)
    assert found['acu_check_passed{check="ACU"}'] == 0.0
    assert found['acu_lease_held{via="rotctl"}'] == 1.0
    assert found['acu_operator_actions_total{action="arm",via="cli"}'] == 1.0
    assert found['acu_elements_fetches_failed_total{reason="failed",source="celestrak.org"}'] == 1.0
    assert found["acu_fit_timestamp_seconds"] == NOW - 1.0
    assert found["acu_pass_next_start_timestamp_seconds"] == NOW + 100.0 - 11.0
    assert found['acu_wind_limit_meters_per_second{window="gust"}'] == 16.9


def test_what_is_known_of_labels_is_there_from_the_start_at_zero_and_nothing_is_created() -> None:
    page = render(Tally(), Surroundings(), NOW)
    found = values(page)
    assert found['acu_commands_refused_total{reason="permit"}'] == 0.0
    assert found['acu_passes_total{outcome="missed"}'] == 0.0
    assert found['acu_operator_actions_total{action="stow",via="page"}'] == 0.0
    assert b"_created" not in page


def test_what_is_not_known_is_left_out_and_never_zero() -> None:
    tally = Tally()
    tally.see(seen_of(az_deg=None, agc_db=None, inside_s=None, off_path_deg=None, reading_age_s=None), RunFigures())
    found = values(render(tally, Surroundings(), NOW))
    for name in ("acu_signal_level_decibels", "acu_prediction_trust_seconds", "acu_reading_timestamp_seconds"):
        assert name not in found
    assert 'acu_axis_angle_degrees{axis="azimuth"}' not in found
    assert "acu_disk_free_bytes" not in found


def test_counts_of_the_next_run_are_added_to_those_before() -> None:
    tally = Tally()
    tally.begin_run()
    tally.see(seen_of(tick_count=100), RunFigures(connect_count=1))
    tally.begin_run()
    tally.see(seen_of(tick_count=30), RunFigures(connect_count=1))
    found = values(render(tally, Surroundings(), NOW))
    assert (found["acu_ticks_total"], found["acu_link_reconnects_total"]) == (130.0, 1.0)


def test_a_daemon_counts_each_of_its_runs_from_its_own_beginning() -> None:
    tally = Tally()
    runs = [climb(duration_s, tally=tally) for duration_s in (2.0, 1.0)]
    ticks = [run.snapshots[-1].tick_count for run in runs]
    assert tally.counts["ticks", ""] == pytest.approx(sum(ticks), abs=len(runs))


@pytest.mark.parametrize(
    ("rise_in_s", "set_in_s", "phase"),
    [
        (None, None, "idle"),
        (500.0, 900.0, "idle"),
        (60.0, 900.0, "prepass"),
        (-1.0, 9.0, "pass"),
        (-99.0, -1.0, "idle"),
    ],
)
def test_the_phase_is_that_of_the_pass_in_hand(rise_in_s: float | None, set_in_s: float | None, phase: str) -> None:
    assert phase_of(seen_of(rise_in_s=rise_in_s, set_in_s=set_in_s)) == phase


def test_a_loss_that_ends_the_pass_is_no_relock_of_the_next_one() -> None:
    tally = Tally()
    tally.told(Event("state.changed", changed("AUTOTRACK/TLE", "HOLD/TLE", Cause.LOST)), 5.0)
    tally.told(Event("state.changed", changed("HOLD/TLE", str(TrackState.IDLE), Cause.PASS_OVER)), 50.0)
    tally.told(Event("state.changed", changed("ACQUIRE/TLE", "AUTOTRACK/TLE", Cause.ACQUIRED)), 5000.0)
    assert tally.relock.cumulated()[-1] == 0


@pytest.mark.long
def test_a_flight_is_counted_as_it_went() -> None:
    tally, target = Tally(), demo_target()
    begin = DEMO_TAI_S - 120.0
    scenario = Scenario(
        acu=replace(DEMO_ANTENNA, elevation_deg=25.0, azimuth_deg=168.0),
        losses=(Loss(cause="receiver", from_utc=begin + 30.0, to_utc=begin + 36.0),),
    )
    flight = fly(target, sky_of(target), scenario, begin_tai_s=begin, end_tai_s=begin + 50.0, tally=tally)
    assert flight.outcome is not None
    found = values(render(tally, Surroundings(), NOW))
    assert found["acu_ticks_total"] == flight.outcome.tick_count
    assert found["acu_writes_total"] == flight.outcome.write_count
    assert found['acu_signal_losses_total{cause="lost"}'] == 1.0
    assert found['acu_relock_seconds_bucket{le="10.0"}'] == 1.0
    assert found['acu_write_gap_seconds_bucket{le="0.11"}'] > 300.0
    assert found["acu_fits_total"] == flight.outcome.refit_count
    assert found["acu_pass_visible_seconds_total"] == pytest.approx(50.0, abs=1.5)


def test_whose_word_it_was_is_told_by_its_way() -> None:
    assert [via_of(who) for who in ("", "root (0)", "Ada by page from 127.0.0.1", "rotctl from 10.0.0.7")] == [
        *("cli", "cli", "page", "rotctl"),
    ]


async def test_only_what_was_obeyed_is_counted(tmp_path: Path) -> None:
    outlets = Outlets(demo_target().station, tmp_path, LoopClock(0.0))
    answer = outlets.counted(lambda line, _who: "error no" if line == "stow" else "ok")
    assert [answer(line, "") for line in ("arm", "stow", "status")] == ["ok", "error no", "ok"]
    assert dict(outlets.tally.counts) == {("actions", "arm cli"): 1}


# Prometheus' own tools


@needs_promtool
def test_promtool_finds_nothing_to_say_of_the_page() -> None:
    for page in (render(full_tally(), AROUND, NOW), render(Tally(), Surroundings(), NOW)):
        done = subprocess.run(["promtool", "check", "metrics"], input=page, capture_output=True, check=False)
        assert (done.returncode, done.stdout + done.stderr) == (0, b"")


@pytest.mark.long
@needs_promtool
def test_the_alert_rules_are_valid_and_come_when_they_should_and_not_before() -> None:
    for words in (["check", "config", "prometheus.yml"], ["test", "rules", "alerts_test.yml"]):
        done = subprocess.run(["promtool", *words], cwd=MONITORING, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr


def test_every_alert_is_tried() -> None:
    rules, tried = ((MONITORING / name).read_text() for name in ("alerts.yml", "alerts_test.yml"))
    named = re.findall(r"- alert: (\w+)", rules)
    assert len(named) == 18
    assert set(re.findall(r"alertname: (\w+)", tried)) == set(named)


def test_an_alert_is_tried_for_its_silence_too() -> None:
    tried = (MONITORING / "alerts_test.yml").read_text()
    silent = re.findall(r"alertname: (\w+)(?:,|\n *) *exp_alerts: \[\]", tried)
    assert set(silent) == set(re.findall(r"alertname: (\w+)", tried))


def test_every_metric_of_rules_and_dashboard_is_one_of_the_page_and_every_one_is_in_the_documentation() -> None:
    page = render(full_tally(), AROUND, NOW)
    there = {re.split(r"[{ ]", series)[0] for series in values(page)}
    asked = (MONITORING / "alerts.yml").read_text() + (MONITORING / "grafana-dashboard.json").read_text()
    assert set(re.findall(r"\bacu_\w+", asked)) - there == set()
    told = set(re.findall(r"`(acu_\w+)", (MONITORING.parent / "docs" / "metrics.md").read_text()))
    assert set(re.findall(r"^# TYPE (\w+)", page.decode(), re.MULTILINE)) == told


def test_every_label_that_a_rule_asks_for_is_one_that_can_be() -> None:
    series = list(values(render(full_tally(), AROUND, NOW)))
    asked = re.findall(r'(acu_\w+)\{(\w+)(=~|!~|=)"([^"]+)"\}', (MONITORING / "alerts.yml").read_text())
    assert len(asked) > 15
    for name, label, _, text in asked:
        found = [match for one in series if (match := re.fullmatch(rf'{name}\{{.*\b{label}="([^"]*)".*\}}', one))]
        for wanted in text.split("|"):
            assert any(re.fullmatch(wanted, match.group(1)) for match in found), (name, label, wanted)


# Served


async def test_a_page_waits_for_the_end_of_a_tick_and_is_rendered_no_more_than_twice_a_second() -> None:
    server = MetricsServer(full_tally(), lambda: AROUND)
    await server.open("127.0.0.1", 0)
    try:
        async with aiohttp.ClientSession() as session, asyncio.timeout(PATIENCE_S):

            async def page() -> bytes:
                async with session.get(f"http://{server.address}/metrics") as reply:
                    assert reply.status == 200
                    assert reply.headers["Content-Type"].startswith("text/plain; version=0.0.4")
                    return await reply.read()

            asked = asyncio.create_task(page())
            while not asked.done():
                server.ticked()
                await asyncio.sleep(0.01)
            assert b"acu_build_info" in await asked
            assert len({await page() for _ in range(20)}) == 1
            async with session.get(f"http://{server.address}/other") as reply:
                assert reply.status == 404
    finally:
        await server.close()


async def test_without_ticks_it_is_served_all_the_same() -> None:
    server = MetricsServer(Tally(), Surroundings)
    await server.open("127.0.0.1", 0)
    try:
        async with (
            asyncio.timeout(PATIENCE_S),
            aiohttp.ClientSession() as session,
            session.get(f"http://{server.address}/metrics") as reply,
        ):
            assert b"acu_ticks_total" in await reply.read()
    finally:
        await server.close()


async def test_an_address_that_is_taken_is_told_and_nothing_else_happens() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        server = MetricsServer(Tally(), Surroundings)
        await server.open("127.0.0.1", taken.getsockname()[1])
        assert server.address == ""
        await server.close()


@pytest.mark.parametrize("listen", ["9842", "localhost:9842", "127.0.0.1:99999", "127.0.0.1"])
def test_a_wrong_address_is_refused_with_what_is_expected(listen: str, tmp_path: Path) -> None:
    made = acu_daemon("passes", "--config", configured(tmp_path, listen))
    assert made.code == 2
    assert "expected ADDRESS:PORT in numbers, such as 127.0.0.1:9842" in made.err


def configured(directory: Path, listen: str) -> Path:
    shutil.copytree(Path(__file__).resolve().parents[1] / "config", directory / "config")
    station = directory / "config" / "station.toml"
    station.write_text(station.read_text() + f'\n[metrics]\nlisten = "{listen}"\n')
    return directory / "config"


# A real Prometheus on a real daemon


class StaticPage:
    """A second target, of a station at which everything has happened."""

    async def serve(self, page: bytes, until: asyncio.Event, bound: "asyncio.Future[str]") -> None:
        from aiohttp import web

        app = web.Application()

        async def metrics(_request: web.Request) -> web.Response:
            return web.Response(body=page, content_type="text/plain")

        app.router.add_get("/metrics", metrics)
        runner = web.AppRunner(app)
        await runner.setup()
        await web.TCPSite(runner, "127.0.0.1", 0).start()
        bound.set_result(f"127.0.0.1:{runner.addresses[0][1]}")
        await until.wait()
        await runner.cleanup()


@contextlib.contextmanager
def prometheus(directory: Path, targets: list[str]) -> Iterator[str]:
    """Debian's Prometheus with the project's rules; yields its URL."""
    config = (MONITORING / "prometheus.yml").read_text().replace("5s", "1s").replace("alerts.yml", "rules.yml")
    (directory / "rules.yml").write_text((MONITORING / "alerts.yml").read_text())
    (directory / "prometheus.yml").write_text(config.replace('["127.0.0.1:9842"]', json.dumps(targets)))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    words = [f"--config.file={directory}/prometheus.yml", f"--storage.tsdb.path={directory}/data"]
    with (directory / "prometheus.log").open("w") as log:
        process = subprocess.Popen(["prometheus", *words, f"--web.listen-address={address}"], stderr=log, stdout=log)
    try:
        yield f"http://{address}"
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(PATIENCE_S)


def asked(url: str, **query: str) -> Any:
    with urllib.request.urlopen(f"{url}?{urllib.parse.urlencode(query)}", timeout=PATIENCE_S) as reply:
        return json.load(reply)["data"]


def wait_for(what: Callable[[], Any]) -> Any:
    end_s = time.monotonic() + PATIENCE_S
    while True:
        with contextlib.suppress(OSError, IndexError, KeyError):
            if found := what():
                return found
        assert time.monotonic() < end_s, "it never came"
        time.sleep(0.1)


def queries() -> list[str]:
    """Every query of the dashboard, as Grafana sends it."""
    board = json.loads((MONITORING / "grafana-dashboard.json").read_text())
    texts = [target["expr"] for panel in board["panels"] for target in panel["targets"]]
    return [text.replace("$__rate_interval", "1m").replace("$instance", ".*") for text in texts]


@needs_prometheus
@pytest.mark.realtime
async def test_a_real_prometheus_scrapes_a_real_daemon_and_answers_every_query_of_the_dashboard(tmp_path: Path) -> None:
    scene = pass_rig.make_scene(tmp_path / "scene", None, 120.0)
    page, until, bound = render(full_tally(), AROUND, time.time()), asyncio.Event(), asyncio.Future[str]()
    static = asyncio.create_task(StaticPage().serve(page, until, bound))
    other = await bound

    def story() -> tuple[dict[str, int], list[Any], list[Any]]:
        with pass_rig.rigs(scene, ["tcp"], tmp_path) as [rig]:
            rig.start_acu()
            station = rig.config / "station.toml"
            station.write_text(station.read_text() + '\n[metrics]\nlisten = "127.0.0.1:0"\n')
            rig.start_daemon()
            url = wait_for(lambda: rig.events("metrics.open"))[0]["url"]
            target = url.removeprefix("http://").removesuffix("/metrics")
            with prometheus(tmp_path, [target, other]) as base:
                api = f"{base}/api/v1/query"
                fits = f'acu_fits_total{{instance="{target}"}} > 2 and acu_link_up == 1'
                wait_for(lambda: asked(api, query=fits)["result"])
                counted = f'count_over_time(acu_fits_total{{instance="{other}"}}[1m]) > 3'
                wait_for(lambda: asked(api, query=counted)["result"])
                answered = {query: len(asked(api, query=query)["result"]) for query in queries()}
                health = [one["health"] for one in asked(f"{base}/api/v1/targets")["activeTargets"]]
                rules = [one["health"] for group in asked(f"{base}/api/v1/rules")["groups"] for one in group["rules"]]
            return answered, health, rules

    try:
        answered, health, rules = await asyncio.to_thread(story)
    finally:
        until.set()
        await static
    assert health == ["up", "up"]
    assert set(rules) == {"ok"}
    assert len(answered) > 40
    assert [query for query, count in answered.items() if count == 0] == []
