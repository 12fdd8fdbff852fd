"""One person or program commands by hand at a time, and nobody who has gone keeps others out."""

import pytest
import structlog
from structlog.testing import capture_logs

from acu_daemon.control.lease import LONGEST_TEXT, Claim, given_back, holder, is_held_by, taken, used, why_not
from acu_daemon.daemon.write_lease import WriteLease

ANN = Claim("1", "Ann", "page", "alignment")
BEN = Claim("2", "Ben", "rotctl", lasts_s=30.0)


class Hand:
    """A clock that is set by hand, and the lease on it."""

    def __init__(self) -> None:
        self.now_s = 1000.0
        structlog.reset_defaults()
        self.lease = WriteLease(lambda: self.now_s)


@pytest.fixture
def hand() -> Hand:
    return Hand()


def test_the_first_who_asks_has_it_and_the_second_is_told_who_why_and_for_how_long() -> None:
    lease = taken(None, ANN, 0.0)
    assert is_held_by(lease, "1", 119.0)
    assert not is_held_by(lease, "2", 119.0)
    assert why_not(lease, BEN, 20.0) == "the lease is held by Ann by page, alignment, for 100 s more"
    assert why_not(lease, ANN, 20.0) == ""


def test_it_ends_by_itself_and_each_use_by_its_holder_alone_makes_it_last() -> None:
    lease = taken(None, ANN, 0.0)
    assert holder(lease, 120.0) is None
    assert holder(used(lease, "1", 100.0), 219.0) is not None
    assert holder(used(lease, "2", 100.0), 121.0) is None
    assert used(lease, "1", 130.0) is None
    assert why_not(lease, BEN, 121.0) == ""


def test_its_holder_may_take_it_again_and_keeps_its_beginning() -> None:
    lease = taken(taken(None, ANN, 0.0), Claim("1", "Ann", "page", "wind"), 50.0)
    assert (lease.since_s, lease.end_s, lease.claim.reason) == (0.0, 170.0, "wind")


def test_a_take_over_is_for_those_who_say_so() -> None:
    lease = taken(None, ANN, 0.0)
    assert why_not(lease, BEN, 1.0, takes_over=True) == ""
    lease = taken(lease, BEN, 1.0)
    assert (lease.claim, lease.since_s, lease.end_s) == (BEN, 1.0, 31.0)


def test_only_its_holder_gives_it_back() -> None:
    lease = taken(None, ANN, 0.0)
    assert given_back(lease, "2", 1.0) == lease
    assert given_back(lease, "1", 1.0) is None


def test_names_from_outside_are_one_short_line() -> None:
    claim = Claim("1", "An\nn\x1b[31m" + 100 * "x", "page", "\u202eback\tward  ")
    assert claim.name.startswith("An n [31mx")
    assert len(claim.name) == LONGEST_TEXT
    assert claim.reason == "back ward"


def test_the_log_tells_of_taking_taking_over_and_the_end_and_not_of_use(hand: Hand) -> None:
    with capture_logs() as said:
        assert hand.lease.take(ANN) == ""
        assert hand.lease.use("1")
        assert not hand.lease.use("2")
        assert "held by Ann" in hand.lease.take(BEN)
        assert hand.lease.take(BEN, takes_over=True) == ""
        assert not hand.lease.use("1")
        assert hand.lease.left_s() == 30.0
        hand.now_s += 31.0
        assert not hand.lease.use("2")
        assert hand.lease.held is None
    names = [one["event"] for one in said]
    assert names == ["lease.taken", "lease.refused", "lease.taken_over", "lease.over"]
    assert said[2]["before"] == "Ann by page"
    assert said[2]["log_level"] == "warning"


def test_what_is_given_back_is_free_at_once(hand: Hand) -> None:
    with capture_logs() as said:
        hand.lease.take(ANN)
        hand.lease.give_back("2")
        assert hand.lease.held is not None
        hand.lease.give_back("1")
        assert hand.lease.left_s() == 0.0
        assert hand.lease.take(BEN) == ""
    assert [one["event"] for one in said] == ["lease.taken", "lease.given_back", "lease.taken"]
