"""The messages that are published to all pages."""

from ..serve import Switches
from ..web import Pages
from .busy import Busy
from .machine import Machine
from .moves import Ended, Mode, Moves
from .ports import Ports
from .settings import FASTEST, SLOWEST, TRAVEL, Settings
from .stage import AXES, MEANINGS, STEPS_PER_UM, Limit, Message, Place, Refusal

__all__ = ["Broadcast"]


class Broadcast:
    """Publishes the state of the machine to the pages.

    Parameters
    ----------
    pages : Pages
        The pages.
    switches : Switches, optional
        Limit switches that pages can press.

    Attributes
    ----------
    note : str
        The last event, as text.
    """

    def __init__(self, pages: Pages, switches: Switches | None) -> None:
        self._pages, self._switches = pages, switches
        self.notify("")
        self._reports = 0
        pages.publish("hello", {
            "axes": AXES, "slowest": SLOWEST, "fastest": FASTEST, "travel": TRAVEL,
            "steps_per_um": STEPS_PER_UM, "switches": switches.ends if switches else []})

    def notify(self, note: str, *, bad: bool = False, during: Mode | None = None) -> None:
        """Set the note on the last event, which the next `publish` sends.

        Parameters
        ----------
        note : str
            The note; empty for none.
        bad : bool
            Whether something is wrong.
        during : Mode, optional
            The mode of which it speaks: it ends with that.
        """
        self.note, self._bad, self._during, self._began = note, bad, during, False

    def receive(self, message: Message, ended: Ended | None) -> None:
        """Update the note for a message of the machine, and for a movement that has ended."""
        if isinstance(message, Limit):
            self.notify(f"A limit switch stopped {message.axis.upper()}. Move away from it.",
                        bad=True)
        elif isinstance(message, Refusal):
            meaning = MEANINGS.get(message.reason, "for an unknown reason")
            self.notify(f"The machine refused: {meaning} ({message.reason}).", bad=True)
        else:
            self._reports += 1
            if ended is not None and ended.reached:
                self.notify(f"At point {ended.point}.", during=Mode.IDLE)
            elif ended is not None:
                self.notify(f"It did not reach point {ended.point}: the line may be disturbed. "
                            "Start it again.", bad=True)

    def publish(self, machine: Machine, moves: Moves, ports: Ports, busy: Busy,
                settings: Settings, *, moving: bool) -> None:
        """Publish the state to all pages. Unchanged messages are not sent again."""
        mode = moves.mode
        if mode is self._during:
            self._began = True
        elif self._began:
            self.notify("")
        self._pages.publish("state", {
            "connected": machine.connected, "doing": busy.doing, "ports": ports.offered,
            "port": ports.chosen(settings.port), "mode": mode,
            "note": self.note if self._during in (None, mode) else "",
            "bad": self._bad, "silent": machine.silent, "limits": sorted(machine.limits),
            "goal": moves.goal, "directions": moves.directions,
            "controller": moves.controller and moves.controller.name,
            "pressed": self._switches.pressed if self._switches else []})
        self._pages.publish("place", {"um": Place.of(settings.steps), "steps": settings.steps,
                                      "known": settings.known, "moving": moving,
                                      "reports": self._reports})
        self._pages.publish("settings", {"speeds": settings.speeds, "points": settings.points})
