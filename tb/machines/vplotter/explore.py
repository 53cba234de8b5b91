"""What no stimulus of `vplotter` gets to in the clocks in which coverage is counted."""

from ...engines import Engine
from ...uart import encode
from . import SHORT
from .stimulus import CONTACTS

__all__ = ["explore"]

LINES = (
    b"$X", b"G21G91G1X.5Y-.5F9000", b"$N0=G91", b"$I=A", b"$N", b"$G", b"$", b"G17G2X1Y1R1",
    b"G17G3X0Y0I1", b"G10L2P2X.1", b"G55", b"G54", b"G92X0", b"G92.1", b"G28.1", b"G28", b"G20",
    b"G21", b"G93X.1F9000", b"G94F9000", b"M3", b"M5", b"G4P.001", b"$J=G91X.1F9000", b"$C",
    b"G1X1", b"$C", b"$100=1", b"$110=1", b"G0Z-9", b"Z9", b":P0", b":P1", b":H0", b":P7", b":S9",
    b":I1", b":F1", b":", b":I00050005", b"$X", b"X-9999", b"$RST=*", b"$SLP", b":P1")


def explore(engine: Engine) -> None:
    """Home it, draw, cancel that, send a line of each kind, and let a homing cycle fail."""
    def send(data: bytes, clocks: int) -> None:
        for level in encode(data, SHORT.bit):
            engine.set(rx=level)
            engine.run(1)
        engine.run(clocks)
        for _ in range(40):
            if engine.get("moving"):
                engine.run(500)

    def home() -> None:
        send(b":H\n", 4000)
        for switch in (1, 2):
            engine.set(limits=switch)
            engine.run(2000)
            engine.set(limits=0)
            engine.run(6000)
        engine.run(30_000)

    engine.set(limits=0, **dict.fromkeys(CONTACTS, 0))
    engine.set(rst=1)
    engine.run(1)
    engine.set(rst=0)
    engine.run(8000)
    home()
    for text in (b":I00040005\n", b":F00120013\n", b":I00030010\n"):
        send(text, 4000)
    send(b":F00140014\n", 0)
    send(b"\x85:S0\n", 4000)
    for line in LINES:
        send(line + b"\n", 3000)
    send(b"\x18", 4000)
    send(b":H\n", 4000)
    engine.set(limits=1)
    engine.run(SHORT.pace * 8 * 90)  # it does not open
    send(b"\x18$X\n", 4000)
