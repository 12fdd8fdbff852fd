"""Who may ask the page for what."""

import errno
import json
from pathlib import Path

import pytest

from acu_daemon.errors import UsageError
from acu_daemon.web.guard import Allowance, Seals, is_our_host, is_our_origin, read_token, seal_of

TOKEN = b"0123456789abcdef"


@pytest.mark.parametrize(
    "host", ["127.0.0.1:8642", "localhost:8642", "[::1]:8642", "10.1.2.3", "acu.lan", "ACU.LAN:80"]
)
def test_an_address_localhost_and_our_own_names_are_ours(host: str) -> None:
    assert is_our_host(host, frozenset({"acu.lan"}))


@pytest.mark.parametrize(
    "host", ["evil.example", "acu.lan.evil.example:8642", "", "a b", "[::1", "127.0.0.1.evil.example"]
)
def test_a_name_that_was_rebound_to_us_is_not(host: str) -> None:
    assert not is_our_host(host, frozenset({"acu.lan"}))


def test_an_origin_is_ours_where_it_is_the_place_that_the_host_names() -> None:
    assert is_our_origin("http://127.0.0.1:8642", "127.0.0.1:8642")
    assert is_our_origin("https://acu.lan", "acu.lan")
    for origin in (
        "null",
        "",
        "http://127.0.0.1:8643",
        "http://evil.example",
        "file://",
        "http://[::1",
        "ws://acu.lan",
    ):
        assert not is_our_origin(origin, "127.0.0.1:8642")


def token_file(folder: Path, text: str, mode: int = 0o600) -> Path:
    path = folder / "token"
    path.write_text(text)
    path.chmod(mode)
    return path


def test_a_token_is_read_from_a_file_that_nobody_else_reads(tmp_path: Path) -> None:
    assert read_token(token_file(tmp_path, "0123456789abcdef\n")) == TOKEN


@pytest.mark.parametrize(
    ("text", "mode", "said"),
    [
        ("0123456789abcdef", 0o640, "chmod 600"),
        ("0123456789abcdef", 0o604, "chmod 600"),
        ("short", 0o600, "at least 16"),
    ],
)
def test_a_token_that_others_read_or_that_is_short_is_refused(tmp_path: Path, text: str, mode: int, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        read_token(token_file(tmp_path, text, mode))


def test_a_token_file_that_is_not_there_or_none_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="umask 077"):
        read_token(tmp_path / "none")
    (tmp_path / "folder").mkdir(mode=0o700)
    with pytest.raises(UsageError, match="expected a file"):
        read_token(tmp_path / "folder")


def test_a_token_of_another_user_says_whose_it_must_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def denied(*_: object) -> int:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr("acu_daemon.edge.secret_file.os.open", denied)  # root may read all
    with pytest.raises(UsageError, match=r"Permission denied; it must belong to the daemon's user: chown$"):
        read_token(tmp_path / "token")


def sealed(order: object, nonce: str = "n", token: bytes = TOKEN) -> tuple[str, str]:
    text = json.dumps(order)
    return text, seal_of(token, nonce, text)


def test_an_order_is_taken_once_and_on_its_own_connection_alone() -> None:
    seals = Seals(TOKEN, "n")
    first = sealed({"n": 1, "do": "lock"})
    assert seals.open(*first) == ({"n": 1, "do": "lock"}, "")
    assert seals.open(*first) == (None, "this order was given before")
    assert seals.open(*sealed({"n": 1})) == (None, "this order was given before")
    assert seals.open(*sealed({"n": 3}))[0] == {"n": 3}
    assert seals.open(*sealed({"n": 2}))[0] is None
    assert Seals(TOKEN, "another").open(*first) == (None, "the token is wrong")


@pytest.mark.parametrize("order", [[], "text", {"n": "1"}, {"n": None}, {"n": True}, {}, {"n": 0}])
def test_an_order_without_a_number_is_refused(order: object) -> None:
    assert Seals(TOKEN, "n").open(*sealed(order))[0] is None


def test_a_wrong_seal_and_what_is_no_text_are_refused() -> None:
    seals = Seals(TOKEN, "n")
    assert seals.open(*sealed({"n": 1}, token=b"another token 16")) == (None, "the token is wrong")
    for order, seal in ((None, None), (None, "0"), ("{}", None), (b"{}", "0"), ("{}", b"0")):
        assert seals.open(order, seal) == (None, "an order and its seal are texts")
    assert seals.open("{}", "\udc80\u00e9")[0] is None
    assert seals.open('{"n":1,"x":"\ud800"}', "0") == (None, "the token is wrong")
    assert seals.open("no json", seal_of(TOKEN, "n", "no json")) == (None, "the order is no JSON")
    assert "only looks" in Seals(None, "n").open(*sealed({"n": 1}))[1]


def test_an_allowance_lets_some_in_at_once_and_then_so_many_a_second() -> None:
    allowance = Allowance.of(2.0, 3.0)
    assert [allowance.take(100.0) for _ in range(4)] == [True, True, True, False]
    assert allowance.wait_s() == pytest.approx(0.5)
    assert allowance.take(100.6)
    assert not allowance.take(100.6)
    assert allowance.take(99.0) is False  # a clock never goes back, and here it gives nothing
