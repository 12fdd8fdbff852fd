"""Ten recordings of short flights, each with a fault: made by scripts/record.py, replayed by test_tapes.py."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from fault_flights import SteppedClock
from flights import Script, climb

from acu_daemon.edge.clock import LoopClock
from acu_daemon.edge.tape_file import SUFFIX

FOLDER = Path(__file__).parent / "tapes"
LOSS = ((6.0, 12.0),)  # the signal goes and comes back
SHORT_S = 15.0


@dataclass(frozen=True)
class Trouble:
    """What goes wrong, and the states that must show in the replay."""

    faults: tuple[str, ...] = ()
    shows: tuple[str, ...] = ("HOLD/FITTED",)
    losses: tuple[tuple[float, float], ...] = LOSS
    duration_s: float = SHORT_S
    script: Script = ()
    make_clock: Callable[[float], LoopClock] = LoopClock


def _clear(at_s: float) -> Script:
    return [(at_s, lambda access: access.service.answer("clear"))]


TROUBLES: dict[str, Trouble] = {
    "corrupted-bytes": Trouble((
        "garbage-before start_s=7 duration_s=4 seed=1", "bad-checksum start_s=8 duration_s=2 probability=0.4 seed=2",
    )),
    "silence-of-the-line": Trouble(("cut start_s=7 duration_s=3",), ("LINK-LOST",)),
    "latch": Trouble(
        ("runaway start_s=6.5 duration_s=5 axis=azimuth",), ("FAULT",), ((6.0, 16.0),), 21.0, _clear(12.0)
    ),
    "power-cycle": Trouble(("power-cycle start_s=8 duration_s=1.5",), ("LINK-LOST",)),
    "local-panel": Trouble(("local-panel start_s=8 duration_s=3",), ("MANUAL",)),
    "limit-switch": Trouble(("limit-switch start_s=8 duration_s=3",)),
    "wrong-turn": Trouble(("encoder-turn start_s=8 duration_s=3",)),
    "clock-step": Trouble(losses=((11.0, 17.0),), duration_s=19.0, make_clock=SteppedClock),
    "receiver-fault": Trouble(losses=((5.0, 6.5), (7.0, 7.4), (8.0, 12.0))),
    "false-lock": Trouble(("false-lock start_s=7 duration_s=4",), ("HOLD/FITTED",)),
}  # fmt: skip


def path_of(name: str) -> Path:
    """Where a recording is."""
    return FOLDER / f"{name}{SUFFIX}"


def record(name: str) -> Path:
    """Fly, and keep it."""
    trouble, path = TROUBLES[name], path_of(name)
    path.parent.mkdir(exist_ok=True)
    path.unlink(missing_ok=True)
    climb(
        trouble.duration_s,
        losses=trouble.losses,
        faults=trouble.faults,
        script=trouble.script,
        make_clock=trouble.make_clock,
        tape=path,
    )
    return path
