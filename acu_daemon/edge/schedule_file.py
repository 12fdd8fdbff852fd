"""schedule.sqlite3 in the antenna's state directory: passes, how they came out, and what people said of them.

SQLite in WAL mode: the daemon writes while `acu-daemon schedule` reads or leaves a person's word, and a process that is
killed loses nothing that was committed.  Where the loop must not wait for the disk, what is written goes out through a
queue, in order.  A file that cannot be written (a full disk) costs no pass: what could not be
saved is saved with the next change.
"""

import sqlite3
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import dataclass, fields, replace
from pathlib import Path

from acu_daemon.edge.writer import Job
from acu_daemon.errors import UsageError
from acu_daemon.schedule.book import Entry, PassState
from acu_daemon.schedule.rules import PassRequest, Wish

NAME = "schedule.sqlite3"
VERSION = 1
BUSY_S = 2.0
NO_PAUSE = -1e300  # until when: long ago
COLUMNS = tuple(one.name for one in fields(Entry))
_TABLES = f"""
create table if not exists passes ({", ".join(COLUMNS)}, primary key (number));
create index if not exists by_rise on passes (rise_tai_s);
create table if not exists history (number integer, at_tai_s real, state text, reason text);
create table if not exists requests (satellite text, at_tai_s real, wish text, said_tai_s real, by_whom text);
create table if not exists pauses (until_tai_s real, said_tai_s real, by_whom text);
pragma user_version = {VERSION};
"""


@dataclass(frozen=True, slots=True)
class Words:
    """What people said: requests, oldest first, and until when the station pauses."""

    requests: tuple[PassRequest, ...] = ()
    pause_until_tai_s: float = NO_PAUSE


class ScheduleFile:
    """The file, opened: read by one thread, written by `put`, at once or in another one.

    Raises, when made: UsageError: it cannot be opened, is damaged, or is of a newer version.
    """

    def __init__(
        self, directory: Path, *, is_read_only: bool = False, put: Callable[[Job], object] = lambda job: job()
    ) -> None:
        self.path = directory / NAME
        self._put = put
        self.problem = ""  # why the newest change is not saved
        self._owed: list[tuple[Entry, float]] = []
        mode = "ro" if is_read_only else "rwc"
        try:
            where = f"{self.path.resolve().as_uri()}?mode={mode}"
            self._db = sqlite3.connect(where, uri=True, timeout=BUSY_S)
            self._written = sqlite3.connect(where, uri=True, timeout=BUSY_S, check_same_thread=False)
            [version] = self._db.execute("pragma user_version").fetchone()
            if version > VERSION:
                raise UsageError(
                    f"{self.path}: of a newer version of this program ({version}); update, or move it away"
                )
            if not is_read_only:
                self._db.execute("pragma journal_mode = wal")
                self._db.executescript(_TABLES)
        except sqlite3.Error as error:
            raise UsageError(f"{self.path}: {error}; move it away to begin another schedule") from None

    def close(self) -> None:
        self._db.close()
        self._put(self._written.close)

    def __enter__(self) -> "ScheduleFile":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def book(self, from_tai_s: float) -> tuple[Entry, ...]:
        """The passes that set after a time, in order of their rise."""
        found = self._db.execute(
            f"select {', '.join(COLUMNS)} from passes where set_tai_s >= ? order by rise_tai_s",
            (from_tai_s,),
        ).fetchall()
        return tuple(replace(one, state=PassState(one.state)) for one in (Entry(*row) for row in found))

    def next_number(self) -> int:
        """A number that no pass has."""
        [most] = self._db.execute("select max(number) from passes").fetchone()
        return int(most or 0) + 1

    def save(self, entries: Iterable[Entry], now_tai_s: float) -> None:
        """Save entries, all or none.  Why they could not be stands in `problem`, and they are saved with the next."""
        new = [(one, now_tai_s) for one in entries]
        self._put(lambda: self._save_owed(new))

    def _save_owed(self, new: list[tuple[Entry, float]]) -> None:
        self._owed += new
        try:
            with self._written:
                for entry, at_tai_s in self._owed:
                    self._save(entry, at_tai_s)
        except sqlite3.Error as error:
            self.problem = f"{self.path}: {error}"
            return
        self._owed, self.problem = [], ""

    def _save(self, entry: Entry, now_tai_s: float) -> None:
        values = {name: getattr(entry, name) for name in COLUMNS} | {"state": str(entry.state)}
        marks = ", ".join(f":{name}" for name in COLUMNS)
        self._written.execute(f"insert or replace into passes ({', '.join(COLUMNS)}) values ({marks})", values)
        last = self._written.execute(
            "select state, reason from history where number = ? order by rowid desc limit 1", (entry.number,)
        ).fetchone()
        if last != (str(entry.state), entry.reason):
            row = (entry.number, now_tai_s, str(entry.state), entry.reason)
            self._written.execute("insert into history values (?, ?, ?, ?)", row)

    def say(self, request: PassRequest, now_tai_s: float, by_whom: str) -> None:
        """Leave a person's word.  UsageError: it cannot be saved; where another thread writes, `problem` says so."""
        row = (request.satellite, request.at_tai_s, str(request.wish), now_tai_s, by_whom)
        self._said("insert into requests values (?, ?, ?, ?, ?)", row)

    def pause(self, until_tai_s: float, now_tai_s: float, by_whom: str) -> None:
        """Pause the station until a time; NO_PAUSE ends a pause.  UsageError: as `say`."""
        self._said("insert into pauses values (?, ?, ?)", (until_tai_s, now_tai_s, by_whom))

    def _said(self, statement: str, row: tuple[object, ...]) -> None:
        self._put(lambda: self._write_word(statement, row))

    def _write_word(self, statement: str, row: tuple[object, ...]) -> None:
        try:
            with self._written:
                self._written.execute(statement, row)
        except sqlite3.Error as error:
            self.problem = f"{self.path}: {error}; a word was not taken"
            raise UsageError(f"{self.path}: {error}; nothing was changed") from None

    def words(self) -> Words:
        """What people said, as it stands now.  UsageError: it cannot be read."""
        try:
            rows = self._db.execute("select satellite, at_tai_s, wish from requests order by rowid").fetchall()
            pause = self._db.execute("select until_tai_s from pauses order by rowid desc limit 1").fetchone()
        except sqlite3.Error as error:
            raise UsageError(f"{self.path}: {error}") from None
        requests = tuple(PassRequest(satellite, at_tai_s, Wish(wish)) for satellite, at_tai_s, wish in rows)
        return Words(requests, pause[0]) if pause else Words(requests)

    def words_beside(self) -> Words:
        """The same, for another thread: by a connection of its own.  Raises: UsageError: it cannot be read."""
        with ScheduleFile(self.path.parent, is_read_only=True) as other:
            return other.words()

    def history(self, number: int) -> list[tuple[float, str, str]]:
        """Of a pass: when which state, and why."""
        return self._db.execute(
            "select at_tai_s, state, reason from history where number = ? order by rowid", (number,)
        ).fetchall()

    def prune(self, before_tai_s: float) -> int:
        """Delete what set before a time; returns how many passes."""
        with self._written, closing(self._written.cursor()) as cursor:
            cursor.execute(
                "delete from history where number in (select number from passes where set_tai_s < ?)", (before_tai_s,)
            )
            cursor.execute("delete from passes where set_tai_s < ?", (before_tai_s,))
            return cursor.rowcount
