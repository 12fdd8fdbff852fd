"""One outstanding command at a time, without IO (ICD sections 1 and 2)."""

from acu_daemon.protocol.messages import Command, Garbled, Poll, Reply
from acu_daemon.protocol.sa3842 import CMD_OF, DEFAULT_ADDRESS, ReplyDecoder, encode_command


class HostExchange:
    """The host's side of the dialogue: begin, then receive until a reply comes, or fail at the deadline.

    discarded_count counts replies to another command, garbled_count frames that were no good reply.
    """

    def __init__(self, address: int = DEFAULT_ADDRESS) -> None:
        self._address = address
        self._decoder = ReplyDecoder(address)
        self._outstanding_cmd: int | None = None
        self._must_poll = False
        self.discarded_count = 0
        self.garbled_count = 0

    @property
    def is_outstanding(self) -> bool:
        """Whether a command waits for its reply."""
        return self._outstanding_cmd is not None

    @property
    def must_poll(self) -> bool:
        """Whether the next command must be a Poll, because the last exchange failed."""
        return self._must_poll

    def begin(self, command: Command) -> bytes:
        """Return the bytes to send.  RuntimeError: a command is outstanding, or a Poll is due first."""
        if self.is_outstanding:
            raise RuntimeError("a command is outstanding: receive its reply, or call fail() at its deadline")
        if self._must_poll and not isinstance(command, Poll):
            raise RuntimeError(f"after a failed exchange the next command is a Poll, not {type(command).__name__}")
        self._decoder.reset()
        self._outstanding_cmd = CMD_OF[type(command)]
        return encode_command(command, self._address)

    def receive(self, data: bytes) -> Reply | None:
        """Take the next bytes; return the reply to the outstanding command once it is complete."""
        answer: Reply | None = None
        for event in self._decoder.feed(data):
            if isinstance(event.reply, Garbled):
                self.garbled_count += 1
            elif event.cmd != self._outstanding_cmd:
                self.discarded_count += 1
            else:
                answer = event.reply
                self._outstanding_cmd = None
                self._must_poll = False
        return answer

    def fail(self) -> None:
        """Give the outstanding command up: its deadline has passed."""
        self._outstanding_cmd = None
        self._must_poll = True
