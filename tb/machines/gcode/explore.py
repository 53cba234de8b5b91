"""What no stimulus of `gcode` gets to in the clocks in which coverage is counted."""

from ...engines import Engine
from ...uart import encode
from . import SHORT

__all__ = ["explore"]

LINES = (
    b"$X", b"G21G91G1X.1Y.1F9000", b"$N0=G91", b"$I=A", b"$N", b"$G", b"$",
    b"G17G2X.1Y.1R.1",
    b"G18G3X.1Z.1I.1", b"G19G2Y.1Z.1R.1", b"G17G3X0Y0I.1", b"G38.3Z-.1", b"G10L2P2X.1",
    b"G10L20P1Y0", b"G55", b"G54", b"G92X0", b"G92.1", b"G43.1Z.1", b"G49", b"G28.1", b"G28",
    b"G30.1", b"G30Z0", b"G20", b"G21", b"G93X.1F9000", b"G94F9000", b"G53G0X0", b"M3S500", b"M4",
    b"M5", b"M7", b"M8", b"M9", b"G4P.001", b"$J=G91X.1F9000", b"$C", b"G1X1", b"$C", b"$RST=*",
    b"$32=1", b"$220=0.02", b"X.1", b"X-.1", b"$20=1", b"$22=1", b"$20=1", b"X-9999", b"$RST=#",
    b"$SLP")
"""Each is done before the next, as far as a reset does not end it. Long lists take too long."""


def explore(engine: Engine) -> None:
    """Reset it in a motion, send a line of each kind, home it with its switches, and reset it."""
    def send(data: bytes, clocks: int) -> None:
        for level in encode(data, SHORT.bit):
            engine.set(rx=level)
            engine.run(1)
        engine.run(clocks)
        for _ in range(20):
            if engine.get("moving"):
                engine.run(500)

    engine.set(**dict.fromkeys(
        ("limits", "stop", "door", "probe", "motor_fault", "hold", "start", "abort"), 0))
    send(b"\x18$X\nG91G1X9Y9Z9F9000\n", 4000)
    engine.set(rst=1)
    engine.run(1)
    engine.set(rst=0)
    engine.run(8000)
    for line in LINES:
        send(line + b"\n", 4000)
        if line.startswith((b"$SLP", b"$RST", b"X-9999")):
            send(b"\x18$X\n", 8000)
    send(b"$H\n", 6000)
    for axes in (0b100, 0b011):
        engine.set(limits=axes)  # found, then left again
        engine.run(1000)
        engine.set(limits=0)
        engine.run(3000)
    send(b"\x18", 3000)
