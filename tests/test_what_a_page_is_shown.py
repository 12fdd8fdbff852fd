"""What the page keeps and is shown, at each limit: strips, states, events, news by version, orders, leases, guard."""

import hmac
import json
import math
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from structlog.testing import capture_logs
from test_live_line import SEEN

from acu_daemon.control.lease import Claim
from acu_daemon.daemon.drawing import Aim, Backdrop, PathAhead
from acu_daemon.daemon.operator_verbs import VERBS
from acu_daemon.daemon.write_lease import WriteLease
from acu_daemon.units import Array
from acu_daemon.web.feed import MOST_SHARED, Feed, Topic, alarms_shown, to_json
from acu_daemon.web.guard import LEAST_TOKEN, Allowance, Seals, host_name, is_our_host, is_our_origin, seal_of
from acu_daemon.web.order_desk import OrderDesk, Person, line_of, verbs_shown
from acu_daemon.web.pass_story import STATE_COUNT, STRIP_COUNT, PassStory, strip_row
from acu_daemon.web.recent_events import KEPT, LONGEST, RecentEvents

STEP = 1e-6
TOKEN = b"0123456789abcdef"

# Strips and states


def test_a_row_of_the_strip_is_time_error_level_signal_lags_and_residual_in_beamwidths() -> None:
    seen = replace(SEEN, tai_s=5.0, off_path_deg=0.25, half_beam_deg=0.5, miss_deg=0.125, agc_db=6.0)
    seen = replace(seen, lag_az_s=0.01, lag_el_s=0.02)
    assert strip_row(seen) == [5.0, 0.25, 6.0, 1.0, 0.01, 0.02, 0.125]
    assert strip_row(replace(seen, is_acquired=False))[3] == 0.0
    assert strip_row(replace(seen, is_link_up=False))[2] is None
    assert strip_row(replace(seen, off_path_deg=None, miss_deg=None, agc_db=None)) == [
        *(5.0, None, None, 1.0, 0.01, 0.02, None)
    ]
    for unknown in (None, 0.0):
        assert [strip_row(replace(seen, half_beam_deg=unknown))[k] for k in (1, 6)] == [None, None]
    assert strip_row(replace(seen, off_path_deg=0.0))[1] == 0.0
    assert strip_row(replace(seen, tai_s=1.234567))[0] == 1.2346


@pytest.mark.parametrize(("after_s", "count"), [(0.9, 1), (0.95 - STEP, 1), (0.95 + STEP, 2), (1.0, 2), (7.0, 2)])
def test_a_row_a_second_though_ticks_come_a_little_early(after_s: float, count: int) -> None:
    story = PassStory()
    for tai_s in (100.0, 100.0 + after_s):
        story.see(replace(SEEN, tai_s=tai_s))
    assert len(story.strip) == count


def test_of_the_strip_the_oldest_rows_go_and_another_pass_leaves_it() -> None:
    story = PassStory()
    for second in range(STRIP_COUNT + 5):
        story.see(replace(SEEN, tai_s=float(second), rise_utc="a" if second < 300 else "b"))
    assert [story.strip[k][0] for k in (0, -1)] == [5.0, float(STRIP_COUNT + 4)]
    assert STRIP_COUNT == 300


def test_of_states_the_oldest_go() -> None:
    story = PassStory()
    for k in range(STATE_COUNT + 3):
        story.see(replace(SEEN, tai_s=float(k), state=("IDLE", "SEARCH")[k % 2]))
    assert [story.stretches[k].from_tai_s for k in (0, -1)] == [3.0, float(STATE_COUNT + 2)]
    assert STATE_COUNT == 200


@pytest.mark.parametrize(
    ("changes", "count"),
    [
        ({}, 1),
        ({"state": "HOLD/FITTED"}, 2),
        ({"is_acquired": False}, 2),
        ({"satellite": "B"}, 1),
        ({"rise_utc": "2026-08-18T14:20:00Z"}, 1),
        ({"rise_utc": ""}, 1),
    ],
)
def test_a_stretch_begins_with_each_change_and_another_pass_begins_anew(changes: dict[str, Any], count: int) -> None:
    story = PassStory()
    story.see(replace(SEEN, tai_s=1.004))
    story.see(replace(SEEN, tai_s=2.006, **changes))
    assert len(story.stretches) == count
    is_new = bool(changes)
    assert story.stretches[-1].from_tai_s == (2.01 if is_new else 1.0)
    assert story.version == (2 if is_new else 1)


def test_a_satellite_without_a_pass_has_its_states_too() -> None:
    story = PassStory()
    for k, satellite in enumerate("ABC"):
        story.see(replace(SEEN, tai_s=float(k), rise_utc="", satellite=satellite))
    assert [one.from_tai_s for one in story.stretches] == [0.0]


# Events


def test_an_event_is_its_time_level_name_and_all_else_in_its_order() -> None:
    events = RecentEvents()
    events.add(
        {"b": 1, "utc": "t", "event": "e" * 400, "a": "x", "SIMULATION": True, "REHEARSAL": True, "level": "error"}
    )
    events.add({"n": 123456, "share": 1234.56, "flag": True})
    assert events.lines() == [
        {"utc": "", "level": "info", "event": "", "text": "n=123456  share=1235  flag=True"},
        {"utc": "t", "level": "error", "event": "e" * LONGEST, "text": "b=1  a=x"},
    ]
    assert (KEPT, LONGEST) == (120, 300)


def test_of_events_the_oldest_go_and_what_is_changed_later_is_not_in_them() -> None:
    events, entry = RecentEvents(), {"n": -1}
    for number in range(KEPT + 1):
        entry["n"] = number
        events.add(entry)
    assert [events.lines()[k]["text"] for k in (0, -1)] == [f"n={KEPT}", "n=1"]
    events.add({"level": "debug"})
    assert events.count == KEPT + 1


# News


class Watched:
    """A daemon that notes how often it is asked."""

    def __init__(self) -> None:
        self.is_station, self.asked = False, [0, 0, 0]
        self.drawn: Backdrop | None = None
        self.late_ms: list[float] = []

    def answer(self, line: str, who: str = "") -> str:
        return f"ok {line} {who}"

    def aim(self) -> Aim | None:
        return Aim(az_turn_deg=370.0)

    def path_ahead(self) -> PathAhead | None:
        self.asked[0] += 1
        return PathAhead(ahead=((float(self.asked[0]), 2.0),))

    def backdrop(self) -> Backdrop | None:
        return self.drawn

    def lateness_ms(self, most: int) -> Array:
        self.asked[1] += 1
        return np.array(self.late_ms[-most:])

    def passes(self) -> list[dict[str, Any]]:
        self.asked[2] += 1
        return [{"pass": self.asked[2]}]


class Side:
    """A feed at a time that the test sets."""

    def __init__(self, *, may_order: bool = True) -> None:
        self.now_s, self.watched, self.events = 100.0, Watched(), RecentEvents()
        self.lease = WriteLease(lambda: self.now_s)
        self.feed = Feed(self.watched, self.events, self.lease, lambda: self.now_s, may_order=may_order)
        self.feed.is_watched = True
        self.news_count = 0
        self.feed.on_news = self._count

    def _count(self) -> None:
        self.news_count += 1

    def all(self) -> dict[str, Any]:
        return dict(json.loads("{" + self.feed.news({})[0] + "}"))


def test_whoever_knows_nothing_is_told_all_and_whoever_knows_all_nothing() -> None:
    side = Side()
    side.events.add({"event": "e"})
    side.feed.see(SEEN)
    text, known = side.feed.news({})
    assert set(json.loads("{" + text + "}")) == set(Topic) == set(known)
    assert side.feed.news(known) == ("", known)
    assert side.feed.news({**known, Topic.STATES: -1})[0].startswith('"states":[')


def test_only_what_has_changed_is_new_and_the_newest_is_what_is_sent() -> None:
    side = Side()
    side.feed.see(SEEN)
    _, known = side.feed.news({})
    for tenth in (1, 2):
        side.feed.see(replace(SEEN, az_deg=10.0 * tenth))
    text, now_known = side.feed.news(known)
    told = json.loads("{" + text + "}")
    assert set(told) == {"now"}
    assert told["now"]["az_deg"] == 20.0
    assert side.feed.news(now_known)[0] == ""
    assert side.feed.news({**now_known, Topic.NOW: known[Topic.NOW]})[0] == text


def test_what_is_shared_is_right_for_each_who_asks_though_many_ask() -> None:
    side = Side()
    for number in range(50):
        side.feed.see(replace(SEEN, az_deg=float(number)))
        assert side.all()["now"]["az_deg"] == number
        assert side.all()["now"]["az_deg"] == number
        assert len(side.feed._shared) <= MOST_SHARED


def test_while_nobody_looks_nothing_is_made_but_alarms_and_states_are_kept() -> None:
    side = Side()
    side.feed.is_watched = False
    side.feed.see(replace(SEEN, line_alarm="bad line", utc="1"))
    side.feed.see(replace(SEEN, state="SEARCH", utc="2"))
    assert (side.all(), side.news_count, side.watched.asked) == ({}, 0, [0, 0, 0])
    side.feed.is_watched = True
    side.feed.see(replace(SEEN, state="SEARCH", utc="3"))
    assert [one["state"] for one in side.all()["states"]] == ["AUTOTRACK/FITTED", "SEARCH"]
    assert [(one["text"], one["began_utc"], one["ended_utc"]) for one in side.all()["alarms"]] == [
        ("bad line", "1", "2")
    ]
    assert side.news_count == 1


@pytest.mark.parametrize(
    ("after_s", "asked"),
    [(0.5, [1, 1, 1]), (1.0 - STEP, [1, 1, 1]), (1.0, [2, 1, 1]), (5.0 - STEP, [2, 1, 1]), (5.0, [2, 2, 2])],
)
def test_what_costs_is_made_as_seldom_as_may_be(after_s: float, asked: list[int]) -> None:
    side = Side()
    side.feed.refresh()
    side.now_s += after_s
    side.feed.refresh()
    assert side.watched.asked == asked
    assert side.all()["ahead"]["ahead"] == [[float(asked[0]), 2.0]]
    assert side.all()["schedule"] == [{"pass": asked[2]}]


@pytest.mark.parametrize(("after_s", "is_told"), [(0.5 - STEP, False), (0.5, True)])
def test_events_are_told_twice_a_second_at_most(after_s: float, is_told: bool) -> None:
    side = Side()
    side.events.add({"event": "first"})
    side.feed.refresh()
    side.events.add({"event": "second"})
    side.now_s += after_s
    side.feed.refresh()
    assert [one["event"] for one in side.all()["events"]] == (["second", "first"] if is_told else ["first"])
    side.now_s += 0.5
    side.feed.refresh()
    assert [one["event"] for one in side.all()["events"]] == ["second", "first"]


def test_another_backdrop_is_told_and_the_same_is_not_made_again() -> None:
    side = Side()
    side.feed.refresh()
    assert side.all()["backdrop"] is None
    side.watched.drawn = Backdrop((-270.0, 270.0), (0.0, 90.0), 5.0, 1.0, has_signal=True)
    side.feed.refresh()
    assert side.all()["backdrop"] == json.loads(json.dumps(asdict(side.watched.drawn)))
    side.watched.drawn = None
    side.feed.refresh()
    assert side.all()["backdrop"] is None


def test_lateness_is_counted_between_its_edges_the_early_as_punctual() -> None:
    side = Side()
    side.watched.late_ms = [5.0] * 7 + [-3.0, 0.0, 0.0999, 0.1, 0.19, 99.9, 100.0, 5000.0] + [1.0] * 5990
    side.feed.refresh()
    told = side.all()["lateness"]
    assert told["edges_ms"] == [0.0, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]
    assert told["counts"] == [3, 2, 0, 0, 5990, 0, 2, 0, 0, 1, 2]  # of the newest 6000


def test_people_are_told_who_has_the_lease_and_who_looks() -> None:
    side = Side(may_order=False)
    side.feed.names = lambda: ["Ann", "Ben"]
    side.feed.refresh()
    assert side.all()["people"] == {"lease": None, "names": ["Ann", "Ben"], "may_order": False}
    side.lease.take(Claim("key", "Ann", "page", "repair"))
    side.feed.see(SEEN)
    assert side.all()["people"]["lease"] == {"name": "Ann", "via": "page", "reason": "repair"}
    assert side.all()["now"]["lease_left_s"] == side.lease.left_s() > 0.0
    assert Side().feed.verbs() == verbs_shown(is_station=False)


def test_the_snapshot_is_told_with_its_verdict_its_steering_and_its_aim() -> None:
    side = Side()
    side.feed.see(replace(SEEN, verdict="old"))
    told = side.all()["now"]
    assert {key: told[key] for key in ("verdict", "level", "why", "headline")} == {
        "verdict": "TRACKING",
        "level": "GOOD",
        "why": "the ACU tracks the signal",
        "headline": "TRACKING for 0:42: the ACU tracks the signal",
    }
    assert told["steering"].endswith("(AUTOTRACK/FITTED)")
    assert told["aim"]["az_turn_deg"] == 370.0
    assert told["satellite"] == "NOAA-20"
    assert json.loads(side.feed.strip())[0][3] == 1.0


def test_an_alarm_that_is_acknowledged_is_told_at_once_below_the_others() -> None:
    side = Side()
    side.feed.see(replace(SEEN, line_alarm="bad line", clock_alarm="bad clock"))
    number = {one["text"]: one["number"] for one in side.all()["alarms"]}
    side.feed.acknowledge(number["bad line"], "Ann")
    assert [(one["text"], one["acknowledged_by"]) for one in side.all()["alarms"]] == [
        ("bad clock", ""),
        ("bad line", "Ann"),
    ]


@pytest.mark.parametrize(
    ("az_deg", "tick_count", "is_shown"), [(None, 29, False), (None, 30, True), (1.0, 0, True), (0.0, 0, True)]
)
def test_at_the_start_no_alarm_is_shown_before_something_is_known(
    az_deg: float | None, tick_count: int, is_shown: bool
) -> None:
    assert bool(alarms_shown(replace(SEEN, az_deg=az_deg, tick_count=tick_count, line_alarm="bad"))) == is_shown


def test_figures_have_five_digits_after_the_point_and_what_is_no_figure_stays() -> None:
    assert to_json({"a": (1.000004, -math.inf), "b": {"c": [12345.678901, 3, "x", None]}}) == (
        '{"a":[1.0,null],"b":{"c":[12345.6789,3,"x",null]}}'
    )


# Orders


class Desk:
    """A desk at a time that the test sets, with the people before it."""

    def __init__(self, answer: str = "ok done") -> None:
        self.now_s, self.asked, self.seen = 1000.0, list[tuple[str, str]](), list[tuple[int, str]]()
        self.reply = answer
        self.lease = WriteLease(lambda: self.now_s)
        self.desk = OrderDesk(self._answer, self.lease, lambda: self.now_s, lambda n, by: self.seen.append((n, by)))

    def _answer(self, line: str, who: str) -> str:
        self.asked.append((line, who))
        return self.reply

    def person(self, peer: str = "peer") -> Callable[..., dict[str, Any]]:
        person = Person(peer, Seals(TOKEN, "n"))
        count = 0

        def order(token: bytes = TOKEN, **said: Any) -> dict[str, Any]:
            nonlocal count
            count += 1
            text = json.dumps({"n": count, "id": 7 * count, **said})
            return self.desk.take(person, text, seal_of(token, "n", text))

        return order


UNLOCK = {"do": "unlock", "name": "Ann"}
ARM = {"do": "verb", "verb": "arm"}


def test_an_order_is_done_by_whoever_has_unlocked_and_has_its_own_number_in_the_reply() -> None:
    desk = Desk()
    ann = desk.person()
    assert ann(**ARM) == {"ok": False, "text": "the page is locked: unlock it first", "is_locked": True, "id": 7}
    assert ann(**UNLOCK) == {"ok": True, "text": "unlocked", "unlocked_s": 30.0, "id": 14}
    assert ann(**ARM) == {"ok": True, "text": "done", "unlocked_s": 30.0, "id": 21}
    assert desk.asked == [("arm", "Ann by page from peer")]
    desk.reply = "error not now"
    assert ann(**ARM) == {"ok": False, "text": "not now", "id": 28}


@pytest.mark.parametrize(("after_s", "is_done"), [(30.0 - STEP, True), (30.0, False)])
def test_a_page_is_unlocked_for_thirty_seconds_and_each_order_that_is_done_begins_them_anew(
    after_s: float, is_done: bool
) -> None:
    desk = Desk()
    ann = desk.person()
    ann(**UNLOCK)
    desk.now_s += 29.0
    assert ann(**ARM)["ok"]
    desk.now_s += after_s
    assert ann(**ARM)["ok"] == is_done


def test_an_order_that_is_refused_does_not_unlock_for_longer() -> None:
    desk = Desk("error not now")
    ann = desk.person()
    ann(**UNLOCK)
    desk.now_s += 29.0
    ann(**ARM)
    desk.now_s += 1.0
    assert ann(**ARM)["is_locked"] is True


def test_the_lease_is_one_persons_until_it_is_given_back_or_taken_over() -> None:
    desk = Desk()
    ann, ben = desk.person("a"), desk.person("b")
    assert ann(**UNLOCK)["ok"]
    assert ben(do="unlock", name="Ben")["is_held"] is True
    assert ben(do="unlock", name="Ben", takes_over=1)["ok"] is False
    assert ben(do="unlock", name="Ben", takes_over=True)["ok"]
    assert ann(**ARM)["is_locked"] is True
    assert ben(do="lock")["text"] == "locked"
    assert desk.lease.held is None
    assert ben(**ARM)["is_locked"] is True
    assert ann(**UNLOCK)["ok"]


@pytest.mark.parametrize("said", [{"do": "unlock"}, {"do": "unlock", "name": ""}, {"do": "unlock", "name": "  "}])
def test_nobody_unlocks_without_a_name(said: dict[str, Any]) -> None:
    assert Desk().person()(**said)["text"].startswith("say who you are")


@pytest.mark.parametrize("said", [{}, {"do": "x"}, {"do": "acknowledge"}, {"do": "acknowledge", "number": "1"}])
def test_an_order_of_no_known_kind_does_nothing(said: dict[str, Any]) -> None:
    desk = Desk()
    assert desk.person()(**said)["text"] == "this order is unknown"
    assert (desk.asked, desk.seen) == ([], [])


def test_an_alarm_is_acknowledged_by_name_and_a_wrong_line_is_told() -> None:
    desk = Desk()
    ann = desk.person()
    ann(**UNLOCK)
    with capture_logs() as logs:
        assert ann(do="acknowledge", number=5)["text"] == "seen"
    assert desk.seen == [(5, "Ann by page from peer")]
    assert [(one["event"], one["number"], one["who"]) for one in logs] == [
        ("alarm.acknowledged", 5, "Ann by page from peer")
    ]
    assert ann(do="verb", verb="arm;")["text"] == "this verb is not written so"


def test_twenty_orders_at_once_and_then_five_a_second() -> None:
    desk = Desk()
    ann = desk.person()
    assert [ann(do="lock")["ok"] for _ in range(21)] == [True] * 20 + [False]
    desk.now_s += 1.0
    assert [ann(do="lock")["ok"] for _ in range(6)] == [True] * 5 + [False]


def test_each_stop_is_obeyed_and_after_twenty_at_once_the_line_is_cut() -> None:
    desk = Desk()
    person = Person("peer", Seals(None, "n"))
    for number in range(22):
        assert desk.desk.stop(person) == "ok done"
        assert person.is_barred == (number >= 20)
    assert desk.asked == [("stop", "somebody by page from peer")] * 22
    desk.now_s += 60.0
    desk.desk.stop(person)
    assert person.is_barred


def test_five_stops_a_second_are_what_a_hand_can_press() -> None:
    desk = Desk()
    person = Person("peer", Seals(None, "n"))
    for _ in range(20):
        desk.desk.stop(person)
    desk.now_s += 1.0
    for number in range(6):
        desk.desk.stop(person)
        assert person.is_barred == (number == 5)


def test_ten_wrong_seals_of_all_together_and_then_one_in_ten_seconds() -> None:
    desk = Desk()
    people = [Person(f"p{k}", Seals(TOKEN, "n")) for k in range(13)]
    with capture_logs() as logs:
        for person in people[:11]:
            assert desk.desk.take(person, "{}", "0") == {"ok": False, "text": "the token is wrong"}
    assert [person.is_barred for person in people[:11]] == [False] * 10 + [True]
    assert [one["event"] for one in logs] == ["page.refused"] * 10
    desk.now_s += 10.0
    for person in people[11:]:
        desk.desk.take(person, "{}", "0")
    assert [person.is_barred for person in people[11:]] == [False, True]


def test_buttons_are_all_verbs_but_stop_and_those_of_a_station_where_there_is_one() -> None:
    own = [verb.name for verb in VERBS.values() if not verb.is_of_station and verb.name != "stop"]
    assert [one["name"] for one in verbs_shown(is_station=False)] == own
    assert [one["name"] for one in verbs_shown(is_station=True)] == [name for name in VERBS if name != "stop"]
    assert len(own) < len(VERBS) - 1


@pytest.mark.parametrize(
    ("said", "line"),
    [
        ({"verb": "a" * 31}, "a" * 31),
        ({"verb": "a" * 32}, None),
        ({"verb": "Arm"}, None),
        ({"verb": "1arm"}, None),
        ({"verb": "x", "values": {f"k{n}": n for n in range(8)}}, "x k0=0 k1=1 k2=2 k3=3 k4=4 k5=5 k6=6 k7=7"),
        ({"verb": "x", "values": {"k": "v" * 60}}, "x k=" + "v" * 60),
        ({"verb": "x", "values": {"k": "v" * 61}}, None),
        ({"verb": "x", "values": {"k": ""}}, None),
        ({"verb": "x", "values": {"k": "v\n"}}, None),
        ({"verb": "x", "values": {"K": "v"}}, None),
        ({"verb": "x", "values": {"k": False}}, "x k=no"),
        ({"verb": "x", "values": {"k": "a:b+c./_-9"}}, "x k=a:b+c./_-9"),
        ({"verb": "x", "values": {"k": "é"}}, None),
    ],
)
def test_a_line_is_of_short_plain_words(said: dict[str, Any], line: str | None) -> None:
    assert line_of(said) == line


# The guard


@pytest.mark.parametrize(
    ("host", "name"),
    [("ACU.lan:80", "acu.lan"), ("acu.lan.", "acu.lan"), ("[::1]:8", "::1"), ("1.2.3.4", "1.2.3.4"), ("[::1", "")],
)
def test_the_name_of_a_host_is_without_port_and_dot(host: str, name: str) -> None:
    assert host_name(host) == name


def test_localhost_is_ours_without_names_and_a_name_of_ours_is_whole() -> None:
    assert is_our_host("localhost", frozenset())
    for host in ("localhost.evil.example", "lan", "acu", "1.2.3", ""):
        assert not is_our_host(host, frozenset({"acu.lan"}))


@pytest.mark.parametrize(
    ("origin", "host", "is_ours"),
    [
        ("http://acu.lan", "acu.lan", True),
        ("HTTP://ACU.lan:80", "acu.LAN:80", True),
        ("https://acu.lan:8642", "acu.lan", False),
        ("http://", "", False),
        ("http://acu.lan@evil.example", "acu.lan", False),
    ],
)
def test_an_origin_is_the_very_place(origin: str, host: str, is_ours: bool) -> None:
    assert is_our_origin(origin, host) == is_ours


def test_a_seal_is_an_hmac_of_nonce_and_order() -> None:
    assert seal_of(b"key", "nonce", "order") == hmac.new(b"key", b"nonce\norder", "sha256").hexdigest()
    assert LEAST_TOKEN == 16


def test_an_order_that_is_refused_uses_up_no_number() -> None:
    seals = Seals(TOKEN, "n")
    bad = json.dumps({"n": 9})
    assert seals.open(bad, "0")[0] is None
    good = json.dumps({"n": 1})
    assert seals.open(good, seal_of(TOKEN, "n", good))[0] == {"n": 1}
    assert seals.newest == 1


def test_an_allowance_never_grows_beyond_its_most() -> None:
    allowance = Allowance.of(2.0, 3.0)
    assert allowance.take(10.0)
    assert [allowance.take(1000.0) for _ in range(4)] == [True, True, True, False]
    assert [allowance.take(1000.5 - STEP), allowance.take(1000.5)] == [False, True]
    assert allowance.take(1000.5) is False
    assert allowance.wait_s() == pytest.approx(0.5)
    fresh = Allowance(0.1, 5.0, 0.0, 50.0)
    assert fresh.take(59.9) is False
    assert fresh.take(60.0)
