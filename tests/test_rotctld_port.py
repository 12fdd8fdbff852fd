"""The rotctld port: its lines, who may lead the antenna by it, and what becomes of what they say."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest
from flights import DEMO_ANTENNA, DEMO_TAI_S, demo_target, sky_of
from test_live_line import SEEN
from test_station import START, night
from test_tick import CONFIG

from acu_daemon.cli.led_antenna import DaemonSeen, LedAntenna
from acu_daemon.cli.outlets_beside import Outlets
from acu_daemon.cli.virtual_pass import Action, Flight, ScriptAccess, fly
from acu_daemon.cli.virtual_station import StationAccess
from acu_daemon.config.envelope_tables import KeepOutSection
from acu_daemon.control.lease import Claim
from acu_daemon.control.state import ControlState, Slaved
from acu_daemon.control.tick_input import Observation, Request, Sky, SlaveWish, TickInput
from acu_daemon.control.tracking.slaving import take_slaving
from acu_daemon.daemon.tally import RunFigures, Tally
from acu_daemon.daemon.write_lease import WriteLease
from acu_daemon.edge.clock import LoopClock
from acu_daemon.edge.tape_text import TapeReader, TapeWriter
from acu_daemon.outlets.rotctld_lines import RotctlVerb, understood_line
from acu_daemon.outlets.rotctld_port import PlaceShown, RotctldPort, key_of
from acu_daemon.sim.scenario import Scenario

PEER = "127.0.0.1"


@dataclass
class Held:
    """An antenna that notes what is asked of it."""

    at: PlaceShown | None = PlaceShown(123.456, 45.678, 0.1, "TRACKING")
    refuses: str = ""
    led: list[tuple[float | None, float | None, float, str]] = field(default_factory=list)
    stops: list[str] = field(default_factory=list)

    def place(self) -> PlaceShown | None:
        return self.at

    def limits(self) -> tuple[tuple[float, float], tuple[float, float]]:
        return (-270.0, 270.0), (0.0, 90.0)

    def park_deg(self) -> tuple[float, float] | None:
        return (0.0, 80.0)

    def lead(self, az_deg: float | None, el_deg: float | None, lasts_s: float, by: str) -> str:
        self.led.append((az_deg, el_deg, lasts_s, by))
        return self.refuses

    def stop(self, who: str) -> None:
        self.stops.append(who)


@dataclass
class Bench:
    """A port without a socket, on a clock that a test sets."""

    antenna: Held = field(default_factory=Held)
    now_s: float = 0.0

    def __post_init__(self) -> None:
        self.lease = WriteLease(lambda: self.now_s)
        self.port = RotctldPort(self.antenna, self.lease, lambda: self.now_s)

    def grant(self, address: str = PEER, lasts_s: float = 30.0) -> None:
        assert self.lease.take(Claim(key_of(address), address, "rotctl", "Gpredict", lasts_s)) == ""

    def said(self, line: bytes, peer: str = PEER) -> bytes | None:
        return self.port.answer(line, peer)


# Lines


@pytest.mark.parametrize(
    ("line", "values"),
    [
        *((b"P 180 45", (180.0, 45.0)), (b"P 180.00 45.00\r", (180.0, 45.0)), (b"  P  1e2   4.5e1 ", (100.0, 45.0))),
        *((b"P 1e-05 0.5", (1e-05, 0.5)), (b"P180 45", (180.0, 45.0)), (b"\\set_pos -10 5.", (-10.0, 5.0))),
        *((b"+P .5 90", (0.5, 90.0)), (b";\\set_pos 1 2", (1.0, 2.0))),
    ],
)
def test_an_angle_is_read_however_it_is_written(line: bytes, values: tuple[float, float]) -> None:
    command = understood_line(line)
    assert (command.verb, command.values) == (RotctlVerb.SET_POSITION, values)


@pytest.mark.parametrize(
    "line",
    [
        *(b"P", b"P 1", b"P 1 2 3", b"P nan 1", b"P inf 1", b"P 1 1e999", b"P 1,5 2", b"P 180,0 45,0", b"P a b"),
        *(b"P 0x10 1", b"P 1_0 1", b"P \xff 1", b"hello", b"\\nothing", b"+", b"P 1 2; rm"),
        *(b"Sec-Fetch-Mode: cors", b"Keep-Alive: 300", b"Ptolemy 1", b"S1", b"quit"),  # what browsers and people say
    ],
)
def test_what_is_no_command_is_wrong(line: bytes) -> None:
    assert understood_line(line).verb is RotctlVerb.WRONG


@pytest.mark.parametrize("line", [b"", b"\r", b"  ", b"\x00"])
def test_an_empty_line_is_answered_by_nothing(line: bytes) -> None:
    assert Bench().said(line) == b""


def test_every_byte_is_answered_by_a_known_number_or_not_at_all() -> None:
    bench = Bench()
    for first in range(256):
        for rest in (b"", b" 1 2", b"1 2", b" nan", b"\\x"):
            answer = bench.said(bytes([first]) + rest)
            if answer and b"RPRT" in answer:
                assert -17 <= int(answer.split(b"RPRT ")[1]) <= 0
    assert bench.antenna.led == []


# Answers


def test_a_position_has_two_decimals_each_on_a_line_in_one_answer() -> None:
    bench = Bench()
    assert bench.said(b"p") == b"123.46\n45.68\n"
    assert bench.said(b"\\get_pos") == b"123.46\n45.68\n"
    assert bench.said(b"+p") == b"get_pos:\nAzimuth: 123.46\nElevation: 45.68\nRPRT 0\n"
    assert bench.said(b";\\get_pos") == b"get_pos:;Azimuth: 123.46;Elevation: 45.68;RPRT 0\n"


@pytest.mark.parametrize("place", [None, PlaceShown(1.0, 2.0, 2.1)])
def test_a_reading_that_is_old_or_missing_is_an_error_and_no_angle(place: PlaceShown | None) -> None:
    assert Bench(Held(at=place)).said(b"p") == b"RPRT -6\n"


def test_all_else_that_a_rotctld_has_is_answered_within_its_errors() -> None:
    bench = Bench()
    assert (bench.said(b"_"), bench.said(b"s")) == (b"acu-daemon\n", b"TRACKING\n")
    assert bench.said(b"q") is None
    for line in (
        b"R 1",
        b"M 8 100",
        b"C token 1",
        b"w x",
        b"V SPEED 1",
        b"v SPEED",
        b"U X 1",
        b"u X",
        b"X X 1",
        b"x X",
    ):
        assert bench.said(line) == b"RPRT -4\n"
    state = bench.said(b"\\dump_state") or b""
    assert state.splitlines()[:2] == [b"1", b"2"]
    assert b"max_el=90.000000" in state
    assert state.endswith(b"done\n")
    assert b"Min Azimuth: -270.00" in (bench.said(b"1") or b"")
    assert all(len(bench.said(line) or b"") < 128 for line in (b"p", b"+p", b"_", b"s", b"P 1 2", b"\\dump_state"))


# The lease


def test_connecting_gives_no_lease_and_nothing_moves_without_it() -> None:
    bench = Bench()
    assert [bench.said(line) for line in (b"P 10 20", b"P 999 20", b"K")] == [b"RPRT -9\n"] * 3
    assert bench.antenna.led == []


def test_who_has_the_lease_leads_also_by_another_connection_until_it_is_silent() -> None:
    bench = Bench()
    bench.grant(lasts_s=30.0)
    assert bench.said(b"P 10 20") == b"RPRT 0\n"
    assert bench.said(b"P 10 20", "10.0.0.9") == b"RPRT -9\n"
    bench.now_s = 25.0
    assert bench.said(b"P 11 21") == b"RPRT 0\n"
    assert bench.antenna.led == [(10.0, 20.0, 30.0, "Gpredict"), (11.0, 21.0, 30.0, "Gpredict")]
    bench.now_s = 56.0
    assert bench.said(b"P 12 22") == b"RPRT -9\n"
    bench.port.look()
    assert bench.antenna.led[-1] == (None, None, 0.0, "")


def test_reading_does_not_make_the_lease_last() -> None:
    bench = Bench()
    bench.grant(lasts_s=10.0)
    for second in range(0, 11, 2):
        bench.now_s = float(second)
        bench.said(b"p")
    assert bench.said(b"P 1 2") == b"RPRT -9\n"


def test_whoever_takes_the_lease_over_ends_it_at_once() -> None:
    bench = Bench()
    bench.grant()
    bench.said(b"P 10 20")
    bench.lease.take(Claim("page", "Ada", "page"), takes_over=True)
    bench.port.look()
    assert bench.antenna.led[-1] == (None, None, 0.0, "")
    assert bench.said(b"P 11 21") == b"RPRT -9\n"


@pytest.mark.parametrize("line", [b"P 10 90.5", b"P 10 -1", b"P 541 10", b"P -181 10"])
def test_an_angle_that_no_turn_reaches_is_refused(line: bytes) -> None:
    bench = Bench()
    bench.grant()
    assert bench.said(line) == b"RPRT -1\n"
    assert bench.antenna.led == []


def test_what_the_daemon_refuses_is_told() -> None:
    bench = Bench(Held(refuses="disarmed"))
    bench.grant()
    assert bench.said(b"P 10 20") == b"RPRT -9\n"


def test_a_stop_is_always_obeyed_and_by_who_leads_it_only_lets_the_antenna_stand() -> None:
    bench = Bench()
    assert bench.said(b"S", "10.0.0.9") == b"RPRT 0\n"
    assert bench.antenna.stops == ["rotctl from 10.0.0.9"]
    assert bench.said(b"S", "10.0.0.9") == b"RPRT 0\n"
    assert len(bench.antenna.stops) == 1  # a moment ago
    bench.grant()
    bench.said(b"P 10 20")
    assert bench.said(b"S") == b"RPRT 0\n"
    assert bench.antenna.led[-1] == (None, None, 30.0, "Gpredict")
    bench.now_s = 2.0
    bench.said(b"SA SE", "10.0.0.9")
    assert len(bench.antenna.stops) == 2


def test_who_has_the_lease_and_leads_nothing_yet_has_the_antenna_stand_too() -> None:
    bench = Bench()
    bench.grant()
    assert bench.said(b"S") == b"RPRT 0\n"
    assert (bench.antenna.led, bench.antenna.stops) == ([(None, None, 30.0, "Gpredict")], [])


def test_where_only_the_lease_stops_others_are_answered_and_nothing_happens() -> None:
    bench = Bench()
    bench.port = RotctldPort(bench.antenna, bench.lease, lambda: bench.now_s, may_anyone_stop=False)
    assert bench.said(b"S") == b"RPRT 0\n"
    assert (bench.antenna.led, bench.antenna.stops) == ([], [])
    bench.grant()
    assert bench.said(b"S") == b"RPRT 0\n"
    assert bench.antenna.led[-1][:2] == (None, None)


def test_easycomm_points_asks_and_stops() -> None:
    bench = Bench()
    assert bench.said(b"AZ180.0 EL45.0 UP145000000 UUSB") == b""
    bench.grant()
    assert bench.said(b"AZ180.0 EL45.0 UP145000000 UUSB") == b""
    assert bench.antenna.led == [(180.0, 45.0, 30.0, "Gpredict")]
    assert bench.said(b"AZ EL") == b"AZ123.5 EL45.7\n"
    for wrong in (b"AZnan EL1", b"AZ180,5 EL45,0", b"AZ180.0", b"AZ1x EL2"):
        assert bench.said(wrong) == b""
    assert len(bench.antenna.led) == 1
    assert bench.said(b"SA SE") == b""
    assert bench.antenna.led[-1][:2] == (None, None)


# Through the decision


def led_flight(*script: tuple[float, Action], seconds: float = 60.0, **sections: Any) -> Flight:
    target = demo_target(**sections)
    begin = DEMO_TAI_S - 120.0
    scenario = Scenario(acu=replace(DEMO_ANTENNA, elevation_deg=25.0, azimuth_deg=168.0))
    later = [(begin + at_s, action) for at_s, action in script]
    return fly(target, sky_of(target), scenario, begin_tai_s=begin, end_tai_s=begin + seconds, script=later)


def say(wish: SlaveWish | Request) -> Action:
    def action(access: ScriptAccess) -> None:
        access.service.ask(wish)

    return action


TO = SlaveWish(200.0, 50.0, 15.0, "Gpredict")


def test_a_program_leads_the_antenna_out_of_a_pass_and_the_daemon_goes_on_when_it_is_silent() -> None:
    flight = led_flight((8.0, say(TO)), seconds=40.0)
    states = flight.states()
    at = states.index("SLAVED")
    assert states[at - 1].startswith("AUTOTRACK")
    assert states[at + 1] in ("IDLE", "HOLD/FITTED")
    assert states[-1] == "AUTOTRACK/FITTED"
    led = [seen for seen in flight.snapshots if seen.state == "SLAVED"]
    assert (led[-1].verdict, led[-1].slaved_by) == ("SLAVED", "Gpredict")
    assert led[-1].az_deg == pytest.approx(200.0, abs=0.2)
    assert led[-1].el_deg == pytest.approx(50.0, abs=0.2)
    assert 14.0 < len(led) / 10.0 < 16.5
    assert flight.outcome is not None
    assert flight.outcome.refusal_count == 0
    begun = next(seen.tai_s for seen in led)
    assert not any(one.is_locked for one in flight.readings if begun + 0.5 < one.tai_s < begun + 14.0)
    [over] = [event for event in flight.events if event["event"] == "slaved.ends"]
    assert over["reason"] == "nothing was said for the time of the lease"


def test_no_command_of_a_led_antenna_is_faster_than_its_drives_or_outside_its_limits() -> None:
    wild = [(8.0 + k / 2.0, say(SlaveWish(float(az), float(el), 20.0))) for k, (az, el) in enumerate(WILD)]
    flight = led_flight(*wild, seconds=20.0)
    assert "SLAVED" in flight.states()
    rows = flight.rows
    rates = [
        max(
            abs(now.encoder_az_deg - before.encoder_az_deg) / 20.0,
            abs(now.encoder_el_deg - before.encoder_el_deg) / 5.0,
        )
        for before, now in zip(rows, rows[1:], strict=False)
        if abs(now.encoder_az_deg - before.encoder_az_deg) < 180.0
    ]
    assert max(rates) < 0.11  # a tenth of a second
    assert not [event for event in flight.events if event["event"] == "fence.refused"]
    assert not [event for event in flight.events if event["event"] == "axis.latched"]
    assert all(-270.0 <= write.az_deg <= 270.0 for write in flight.writes if hasattr(write, "az_deg"))


WILD = [(0, 5), (359, 85), (180, 0), (-180, 90), (540, 45), (90, 10), (270, 80), (10, 10), (350, 12), (181, 60)]


def test_a_persons_word_ends_it_at_once_and_nothing_moves_when_armed_again_but_by_the_daemon() -> None:
    script = ((10.0, say(replace(TO, lasts_s=300.0))), (14.0, say(Request.STOP)), (16.0, say(Request.ARM)))
    flight = led_flight(*script, seconds=32.0)
    ended = [event for event in flight.events if event["event"] == "slaved.ends"]
    assert [event["reason"] for event in ended] == ["disarmed"]
    assert flight.states().count("SLAVED") == 1
    assert flight.states()[-1].startswith("AUTOTRACK")


def test_a_stop_by_who_leads_lets_the_antenna_stand_where_it_is() -> None:
    script = ((8.0, say(SlaveWish(350.0, 80.0, 60.0))), (10.0, say(SlaveWish(None, None, 60.0))))
    flight = led_flight(*script, seconds=22.0)
    late = [seen for seen in flight.snapshots if seen.state == "SLAVED"][-60:]
    assert {seen.state for seen in late} == {"SLAVED"}
    assert max(seen.az_deg or 0.0 for seen in late) - min(seen.az_deg or 0.0 for seen in late) < 0.2
    assert 10.0 < (late[-1].el_deg or 0.0) < 75.0


def test_into_a_keep_out_it_is_not_led() -> None:
    zone = {"name": "mast", "az_from_deg": 190.0, "az_to_deg": 210.0, "el_from_deg": 0.0, "el_to_deg": 60.0}
    section = KeepOutSection.model_validate(zone)
    flight = led_flight((8.0, say(replace(TO, lasts_s=40.0))), seconds=24.0, envelope={"keep_out": (section,)})
    led = [seen for seen in flight.snapshots if seen.state == "SLAVED"]
    assert led
    inside = [seen for seen in led if 190.0 < (seen.az_deg or 0.0) < 210.0 and (seen.el_deg or 0.0) < 60.0]
    assert inside == []


@pytest.mark.parametrize(
    "wish", [SlaveWish(float("nan"), 1.0, 9.0), SlaveWish(1.0, None, 9.0), SlaveWish(1e9, 1.0, 9.0)]
)
def test_what_is_no_direction_is_left_out(wish: SlaveWish) -> None:
    given = TickInput(Observation(requests=(wish,)), Sky(), 100.0)
    assert take_slaving(ControlState(), given, CONFIG, []).slaved == Slaved()


def test_what_a_program_says_is_on_the_tape_of_a_pass_and_read_back() -> None:
    record = ("T", 100.0, 0.0, True, (SlaveWish(1.5, 2.5, 30.0, "Gpredict"), SlaveWish(None, None, 0.0)), None)
    [read] = TapeReader().records([TapeWriter().line(record)])
    assert read[4] == record[4]


# The daemon beside it


def outlets_of(tmp_path: Path, **seen: Any) -> tuple[Outlets, list[str]]:
    outlets, said = Outlets(demo_target().station, tmp_path, LoopClock(SEEN.tai_s)), list[str]()
    outlets.tally.see(replace(SEEN, **seen), RunFigures())

    def answer(line: str, _who: str) -> str:
        said.append(line)
        return "ok"

    outlets.counted(answer)
    return outlets, said


def led_antenna(**seen: Any) -> LedAntenna:
    tally = Tally()
    tally.see(replace(SEEN, **seen), RunFigures())
    return LedAntenna(
        demo_target().station, DaemonSeen(tally, LoopClock(SEEN.tai_s), lambda: None, lambda _l, _w: "ok")
    )


@pytest.mark.parametrize(
    ("seen", "why"),
    [
        ({"arming": "disarmed"}, "disarmed"),
        ({"arming": "shadow"}, "shadow"),
        ({"arming": "armed", "latch": "azimuth stands still"}, "latched: azimuth stands still"),
        ({"arming": "armed", "state": "MANUAL"}, "the state is MANUAL"),
        ({"arming": "armed", "state": "STOW"}, "the state is STOW"),
    ],
)
async def test_an_antenna_that_may_not_be_moved_is_not_led_and_the_reason_is_told(
    seen: dict[str, Any], why: str
) -> None:
    antenna = led_antenna(**seen)
    assert antenna.lead(1.0, 2.0, 30.0, "Gpredict") == why
    assert antenna.wish is None


async def test_what_was_wanted_is_forgotten_where_the_antenna_may_not_be_moved_any_more() -> None:
    antenna = led_antenna(arming="armed", state="IDLE")
    assert antenna.lead(1.0, 2.0, 30.0, "Gpredict") == ""
    assert antenna.wish == SlaveWish(1.0, 2.0, 30.0, "Gpredict")
    antenna._daemon.tally.see(replace(SEEN, arming="disarmed"), RunFigures())
    antenna.look()
    assert antenna.wish is None


async def test_a_lease_is_given_by_a_persons_word_alone(tmp_path: Path) -> None:
    station = demo_target().station
    station = station.model_copy(update={"rotctld": station.rotctld.model_copy(update={"listen": "127.0.0.1:0"})})
    outlets = Outlets(station, tmp_path, LoopClock(0.0))
    answer = outlets.counted(lambda line, _who: f"ok {line}")
    assert answer("grant to=10.0.0.7", "root") == "ok grant to=10.0.0.7"  # no port: the daemon says so
    await outlets.open()
    assert answer("grant to=Ada", "root").startswith("error 'Ada' does not appear to be")
    assert answer("grant to=10.0.0.7 lasts_s=1", "root").startswith("error lasts_s=1: expected 5 to 3600 s")
    assert answer("grant to=10.0.0.7 lasts_s=60 name=Gpredict", "root") == (
        "ok 10.0.0.7 may lead the antenna, until it is silent for 60 s"
    )
    assert outlets.lease.held is not None
    assert (outlets.lease.held.claim.key, outlets.lease.held.claim.via) == (key_of("10.0.0.7"), "rotctl")
    assert answer("grant to=10.0.0.8", "root").startswith("error the lease is held by 10.0.0.7 by rotctl, Gpredict")
    assert answer("grant to=10.0.0.8 over=yes", "root").startswith("ok 10.0.0.8")
    assert answer("revoke", "root") == "ok the lease was that of 10.0.0.8 by rotctl"
    assert outlets.lease.held is None
    assert outlets.tally.counts["actions", "grant cli"] == 3
    await outlets.close()


def test_a_station_that_rests_begins_a_run_for_a_program_and_rests_again(tmp_path: Path) -> None:
    def lead(access: StationAccess) -> None:
        outlets = access.runs.outlets
        seen = DaemonSeen(outlets.tally, access.runs._setup.clock, lambda: access.runs.service, access.runs.answer)
        outlets._antenna = LedAntenna(access.runs.day.station, seen)
        assert outlets._antenna.lead(100.0, 40.0, 60.0, "Gpredict") == ""

    def revoke(access: StationAccess) -> None:
        antenna = access.runs.outlets._antenna
        assert antenna is not None
        antenna.lead(None, None, 0.0, "")

    found = night(tmp_path, minutes=1.5, script=[(START + 5.0, lead), (START + 50.0, revoke)])
    changes = [str(event["state"]) for event in found.days.named("state.changed")]
    assert "SLAVED" in changes
    assert [event["by"] for event in found.days.named("station.led")] == ["Gpredict"]
    led = [row for row in found.days.rows if START + 40.0 < row.tai_s < START + 49.0]
    assert {round(row.encoder_az_deg) for row in led} == {100}
    assert {round(row.encoder_el_deg) for row in led} == {40}
    assert changes[-1] != "SLAVED"
    assert found.days.rows[-1].encoder_az_deg != pytest.approx(100.0, abs=1.0)  # it waits where the next one rises
