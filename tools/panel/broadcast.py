"""What pages are told."""

from ..serve import Switches
from ..web import Pages
from .busy import Busy
from .machine import Machine
from .moves import Ended, Moves
from .ports import Ports
from .settings import FASTEST, SLOWEST, TRAVEL, Settings
from .stage import AXES, MEANINGS, STEPS_PER_UM, Limit, Message, Place, Refusal

__all__ = ["Broadcast"]


class Broadcast:
    """What is to be known of the machine, for pages.

    Parameters
    ----------
    pages : Pages
        Who is told.
    switches : Switches, optional
        Limit switches that pages can press.

    Attributes
    ----------
    note : str
        What has happened last.
    silent : bool
        The machine should report, and does not.
    """

    def __init__(self, pages: Pages, switches: Switches | None) -> None:
        self._pages, self._switches = pages, switches
        self.note, self._bad = "", False
        self.silent = False
        self._reports = 0
        pages.tell("hello", {
            "axes": AXES, "slowest": SLOWEST, "fastest": FASTEST, "travel": TRAVEL,
            "steps_per_um": STEPS_PER_UM, "switches": switches.ends if switches else []})

    def say(self, note: str, *, bad: bool = False) -> None:
        """Note what has happened; it is told with the next `tell`."""
        self.note, self._bad = note, bad

    def forget(self) -> None:
        """Note that nothing has happened yet."""
        self.say("")
        self.silent = False

    def hear(self, message: Message, ended: Ended | None) -> None:
        """Note a message of the machine, and the point that is not gone to any more with it."""
        self.silent = False
        if isinstance(message, Limit):
            self.say(f"A limit switch stopped {message.axis.upper()}. Move away from it.", bad=True)
        elif isinstance(message, Refusal):
            meaning = MEANINGS.get(message.reason, "it does not say more")
            self.say(f"The machine refused: {meaning} ({message.reason}).", bad=True)
        else:
            self._reports += 1
            if ended is not None and ended.there:
                self.say(f"At point {ended.point}.")
            elif ended is not None:
                self.say(f"It did not get to point {ended.point}: the line may be disturbed. "
                         "Go there again.", bad=True)

    def tell(self, machine: Machine, moves: Moves, ports: Ports, busy: Busy,
             settings: Settings) -> None:
        """Tell all pages how it is. What has not changed is not sent."""
        self._pages.tell("state", {
            "connected": machine.connected, "doing": busy.doing, "ports": ports.offered,
            "port": ports.chosen(settings.port), "note": self.note, "bad": self._bad,
            "silent": self.silent, "limits": sorted(machine.limits), "goal": moves.goal,
            "directions": moves.directions,
            "pressed": self._switches.pressed if self._switches else []})
        self._pages.tell("place", {"um": Place.of(settings.steps), "steps": settings.steps,
                                   "reports": self._reports})
        self._pages.tell("settings", {"speeds": settings.speeds, "points": settings.points})
