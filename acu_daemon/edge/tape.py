"""The tape of a pass: every input of the decision and every byte of the line, in the order in which they came.

The daemon notes each as a tuple, its first item a letter; a note costs the loop one call.  Lines of text are made of
them elsewhere (edge/tape_text.py), and a replay reads the same tuples back.

| letter | then | what |
|---|---|---|
| T | TAI, silence s, has room, requests, signal | a tick decides; signal: what a receiver beside the ACU says |
| D | 1, 2 or n | the port is told to do its first order, its second one, or the poll after a refusal |
| Q | monotonic | after a failed exchange: what may be asked now |
| X | monotonic, TAI, unread bytes, bytes sent | an exchange begins |
| R | monotonic, bytes | bytes came |
| N | monotonic | the exchange is given up |
| G | | the link was closed, what was begun on it is forgotten |
| H | | the reply is taken in for the next tick |
| P | TAI | the pass is planned |
| S | TAI | the buffer for that plan |
| U | TAI | the run goes on with the fit that this pass had before |
| B | TAI, low water s or None | the daemon fills the buffer itself |
| A | TAI | the fit is asked, with the readings that wait |
| F | reply | its answer |
| Z | TAI, has died, reason | it has none |
| L | text | the link: open, or why it is lost |
| C | text | the clock's alarm, empty when it is over |
| I | name, JSON object | a fact for the report: a hook's result, what the schedule said |
| E | JSON object | the run is over, with its counts; what follows is the safe stop |

Times are exact: what is read is the number that was noted, bit for bit.
"""

from collections.abc import Callable
from typing import Any

Record = tuple[Any, ...]
Note = Callable[[Record], None]


def no_note(_record: Record) -> None:
    """Keeps nothing."""
