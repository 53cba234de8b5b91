"""The machines of Fresa from Python: what is at the other end of their serial lines.

`Single` is one motor, `Positioner` three axes of a micropositioner, `Mill` a milling machine, which
carries out lists of `Order`, `GCode` one that speaks the protocol of GRBL 1.1, and `VPlotter` a pen
that hangs from two strings. All are opened with the name of a serial port and closed like a file.
What goes wrong is raised as a `MachineError`.
"""

from .errors import (
    JobStopped,
    LimitReached,
    LineLost,
    MachineError,
    Refused,
    Stalled,
    TimedOut,
    WasReset,
)
from .gcode import GCode
from .gcode_lines import Alarmed, BlockRefused, Status
from .mill import Mill
from .order_lines import Answer, Kind, Order
from .orders import JobHalfDone, JobRefused, NotReady, OrderRefused
from .port import Port
from .positioner import Positioner
from .positioner_errors import Astray, PositionError
from .positioner_place import Place
from .single import Single
from .vplotter import VPlotter

__all__ = ["Alarmed", "Answer", "Astray", "BlockRefused", "GCode", "JobHalfDone", "JobRefused",
           "JobStopped", "Kind", "LimitReached", "LineLost", "MachineError", "Mill", "NotReady",
           "Order", "OrderRefused", "Place", "Port", "PositionError", "Positioner", "Refused",
           "Single", "Stalled", "Status", "TimedOut", "VPlotter", "WasReset"]
