"""One outstanding command at a time, and what may follow one without a reply (docs/protocol.md, Late replies).  No IO.

No reply says which of two equal commands it answers.  So a late one is kept from being taken for the next by CMD alone:
after a failed exchange comes a command whose CMD nothing left unanswered in the last LATE_S has, and a reply with
another CMD than the outstanding one is discarded.

An answer is `is_sure`, and the line in step, where no reply to an earlier command with its CMD can still have been on
its way: each that was given up has come since, discarded, or LATE_S have passed.  What answers an unsure exchange may
be an older reply, its own still to come.  On a line that keeps the order it is not: an answer to a later command has
shown that the older reply is lost.  On one where a reply was overtaken it may be, and that exchange stays open.

Times are readings of any clock that never goes back, seconds.
"""

from math import inf

from acu_daemon.acu.commands import Identify, Poll, ReadFaults
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.drivers.sa3842.codec import CMD_OF, DEFAULT_ADDRESS, ReplyDecoder, StatusReader, encode_command
from acu_daemon.drivers.sa3842.messages import Command, Garbled, ReadRegisters, Reply
from acu_daemon.drivers.sa3842.status_block import decode_status

LATE_S = 0.5  # so long after its exchange was given up a reply may still come
OVERTAKEN_S = 60.0  # so long a line that let a reply be overtaken is not trusted to keep the order
Question = Poll | Identify | ReadRegisters | ReadFaults
QUESTIONS: tuple[Question, ...] = (Poll(), Identify(), ReadRegisters(), ReadFaults())  # in turn after a failed exchange
_QUESTION_TYPES = tuple(type(question) for question in QUESTIONS)


class HostExchange:
    """The host's side of the dialogue: begin, then receive until a reply comes, or fail at the deadline.

    discarded_count counts replies to another command, garbled_count frames that were no good reply, late_count replies
    to an exchange that was given up; the newest of these came at late_at_s, late_s after the begin of its exchange.
    """

    def __init__(self, address: int = DEFAULT_ADDRESS, read_status: StatusReader = decode_status) -> None:
        self._address = address
        self._decoder = ReplyDecoder(address, read_status)
        self._outstanding_cmd: int | None = None
        self._begun_s = 0.0
        self._given_up_s: dict[int, float] = {}  # by CMD: when its newest exchange that failed was given up
        self._open: dict[int, list[tuple[float, float]]] = {}  # by CMD: begin and end of exchanges without their reply
        self._sure_s = self._overtaken_s = -inf  # the begin of the newest sure exchange; when a reply was overtaken
        self._must_poll = False
        self.is_sure = True
        self.discarded_count = 0
        self.garbled_count = 0
        self.late_count = 0
        self.late_s = 0.0
        self.late_at_s = -inf

    @property
    def is_outstanding(self) -> bool:
        """Whether a command waits for its reply."""
        return self._outstanding_cmd is not None

    @property
    def must_poll(self) -> bool:
        """Whether the next command must be a question, because the last exchange failed."""
        return self._must_poll

    def question(self, now_s: float) -> Question | None:
        """A poll; after a failed exchange the first question whose CMD is free, None where none is before free_s."""
        if not self._must_poll:
            return QUESTIONS[0]
        return next((question for question in QUESTIONS if self._is_free(question, now_s)), None)

    @property
    def free_s(self) -> float:
        """When the first question is free that is not."""
        return min(self._given_up_s.get(CMD_OF[kind], -inf) for kind in _QUESTION_TYPES) + LATE_S

    def _is_free(self, command: Command, now_s: float) -> bool:
        return now_s - self._given_up_s.get(CMD_OF[type(command)], -inf) >= LATE_S

    def begin(self, command: Command, now_s: float) -> bytes:
        """Return the bytes to send.  RuntimeError: a command is outstanding, or after a failed one no free question."""
        if self.is_outstanding:
            raise RuntimeError("a command is outstanding: receive its reply, or call fail() at its deadline")
        if self._must_poll and not (isinstance(command, _QUESTION_TYPES) and self._is_free(command, now_s)):
            raise RuntimeError(f"the next command is a Poll or another free question, not {command}")
        self._decoder.reset()
        self._outstanding_cmd, self._begun_s = CMD_OF[type(command)], now_s
        self.is_sure = not self._still_open(self._outstanding_cmd, now_s)
        return encode_command(command, self._address)

    def _still_open(self, cmd: int, now_s: float) -> list[tuple[float, float]]:
        """Exchanges with this CMD whose replies may still come, oldest first."""
        left = self._open.get(cmd)
        if left:
            left[:] = [one for one in left if now_s - one[1] < LATE_S]
        return left or []

    def receive(self, data: bytes, now_s: float) -> Reply | AcuStatus | None:
        """Take the next bytes; return the reply to the outstanding command once it is complete.

        Also what arrives while none is outstanding, so that it is known to have come.
        """
        answer: Reply | AcuStatus | None = None
        for event in self._decoder.feed(data):
            if isinstance(event.reply, Garbled):
                self.garbled_count += 1
            elif event.cmd is None or event.cmd != self._outstanding_cmd:
                self._discard(event.cmd or 0, now_s)
            else:
                answer = event.reply
                self._answered(event.cmd, now_s)
        return answer

    def _answered(self, cmd: int, now_s: float) -> None:
        self._outstanding_cmd = None
        self._must_poll = False
        if self.is_sure:
            self._sure_s = self._begun_s
        elif now_s - self._overtaken_s < OVERTAKEN_S and (left := self._still_open(cmd, now_s)):
            left.append((self._begun_s, now_s))
            left.pop(0)  # one reply of them all has come

    def _discard(self, cmd: int, now_s: float) -> None:
        self.discarded_count += 1
        if left := self._still_open(cmd, now_s):
            begun_s, _ = left.pop(0)
            self.late_count += 1
            self.late_s, self.late_at_s = now_s - begun_s, now_s
            if begun_s < self._sure_s:
                self._overtaken_s = now_s

    def fail(self, now_s: float) -> None:
        """Give the outstanding command up: its deadline has passed."""
        cmd = self._outstanding_cmd
        if cmd is not None:
            self._given_up_s[cmd] = now_s
            self._open.setdefault(cmd, []).append((self._begun_s, now_s))
        self._outstanding_cmd = None
        self._must_poll = True
