"""The seam between the decision and the wire: what a driver of one kind of ACU has to do (docs/adding-an-acu.md).

A driver is a dialogue without IO and without a clock: it turns a command into bytes and bytes into a reply, one
command at a time, and knows what may follow one that had no answer in time.  The port (daemon.port) owns link, clock
and deadlines, the decision (control) what is commanded; neither knows a byte.

Times are readings of one clock that never goes back, seconds.
"""

from dataclasses import dataclass
from typing import Protocol

from acu_daemon.acu.capabilities import Capabilities
from acu_daemon.acu.commands import Command
from acu_daemon.acu.replies import Reply


@dataclass(frozen=True, slots=True)
class Timing:
    """How long bytes and device take: from the start of a command's write, s."""

    sample_delay_s: float  # of PointAndPoll, to the sample of the angles that its status shows
    poll_sample_delay_s: float  # the same of Poll
    effect_delay_s: float  # to the moment at which commanded angles are followed


class AcuDriver(Protocol):
    """The dialogue with one ACU.  Owned by the port."""

    @property
    def capabilities(self) -> Capabilities:
        """What this ACU can do."""

    def timing(self, byte_time_s: float) -> Timing:
        """byte_time_s: of a character on the wire; 0 where it is not known (TCP)."""

    def wire_bytes(self, command: Command) -> int:
        """Bytes of a command and of its good reply; 0 where the line has no rate."""

    @property
    def extra_bytes(self) -> int:
        """Bytes of the longest exchange that goes beside the normal cycle."""

    def begin(self, command: Command, now_s: float) -> bytes:
        """The bytes to send.  None to send: the next `receive` has the reply at once.

        Raises: RuntimeError: a command is outstanding, or this one may not follow one that failed.
        """

    def receive(self, data: bytes, now_s: float) -> Reply | None:
        """Take the next bytes, cut anywhere; the reply to the outstanding command once it is complete.

        Also what comes while none is outstanding, so that it is known to have come.
        """

    def fail(self, now_s: float) -> None:
        """Give the outstanding command up: its deadline has passed, or the link is dead."""

    def forget(self) -> None:
        """The link was closed: nothing that was begun on it will be answered."""

    @property
    def is_outstanding(self) -> bool:
        """Whether a command waits for its reply."""

    @property
    def must_poll(self) -> bool:
        """Whether the next command must be a question, because the last exchange failed."""

    def question(self, now_s: float) -> Command | None:
        """A poll, or what may stand in its place after a failed exchange; None: nothing may yet, until free_s."""

    @property
    def free_s(self) -> float:
        """When the first question is free that is not."""

    @property
    def is_sure(self) -> bool:
        """Whether the last reply is to its command, and to none before it that had no answer in time."""

    @property
    def discarded_count(self) -> int:
        """Replies to another command than the outstanding one."""

    @property
    def garbled_count(self) -> int:
        """Bytes that were no good reply."""

    @property
    def late_count(self) -> int:
        """Replies to an exchange that was given up."""

    @property
    def late_s(self) -> float:
        """How long after the begin of its exchange the newest of them came."""

    @property
    def late_at_s(self) -> float:
        """When it came."""
