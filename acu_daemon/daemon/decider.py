"""What decides between link and antenna: the memory of the decision, and what was heard since its last tick.

The foreground has it beside its link and a replay beside a recording: one code decides in both.  No IO, no clock.
"""

from dataclasses import replace

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.hear import Heard, hear
from acu_daemon.control.orders import Orders
from acu_daemon.control.receiver_signal import SignalSample
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import Arrival, Asking, Observation, TickInput
from acu_daemon.daemon.area import CommonArea
from acu_daemon.edge.tape import Note, no_note


class Decider:
    """Owned by whoever owns the control state of the area."""

    def __init__(self, area: CommonArea, config: ControlConfig, note: Note = no_note) -> None:
        self._area, self._config, self._note = area, config, note
        self.seen = Observation()

    def decide(
        self,
        now_tai_s: float,
        silence_s: float,
        requests: tuple[Asking, ...],
        signal: SignalSample | None,
        *,
        must_poll: bool,
        has_room: bool,
    ) -> Orders:
        """One tick.  silence_s: since the last valid reply; must_poll, has_room: as in Observation."""
        area = self._area
        self._note(("T", now_tai_s, silence_s, has_room, requests, signal))
        seen = replace(self.seen, silence_s=silence_s, must_poll=must_poll, has_room=has_room, requests=requests)
        area.state, orders = tick(area.state, TickInput(seen, area.sky, now_tai_s, signal), self._config)
        self.seen = Observation()
        return orders

    def hear(self, arrival: Arrival) -> Heard:
        """Take a reply in for the next tick, and its reading for the fit."""
        area = self._area
        self._note(("H",))
        area.state, heard = hear(area.state, self.seen, arrival, self._config)
        self.seen = heard.seen
        if heard.reading is not None and heard.is_to_fit:
            area.to_fit.append(heard.reading)
        return heard
