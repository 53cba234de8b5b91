"""Speed of the machines that are served, next to real time.

    python -m benchmarks.serving [SECONDS]

Each machine is built as `tools.serve` builds it by default. For some simulated seconds (5 by
default) its line is quiet, then it gets one legal line after the other, by chance, a quarter of a
second apart, and obeys them. Both are run twice, clock by clock and with stretches of clocks made
at once. Prints clocks per second of processor time of each, their ratio, and how many times as
fast as real time the slower of both is with stretches, on one core.
"""

import random
import sys
import time

from tb.engines import CXXRTLEngine
from tb.uart import SerialLine
from tools.serve.machines import CLOCK, Served, servable

#: Seconds from the beginning of a line to that of the next.
GAP_S = 0.25


def lines(served: Served, seconds: float) -> list[bytes]:
    """Return what is sent, one text for each gap."""
    fuzz = served.machine.fuzz
    assert fuzz is not None
    protocol, rng = fuzz().protocol, random.Random(1)
    return [protocol.begin, *(protocol.legal(rng) for _ in range(round(seconds / GAP_S) - 1))]


def speeds(served: Served, seconds: float, *, stretches: bool) -> tuple[float, float]:
    """Return the clocks per second of a quiet machine, and of one that is sent lines."""
    baud = served.how.baud
    with CXXRTLEngine(served.design(CLOCK, baud), stretches=stretches) as engine:
        engine.set(**served.how.levels)
        line = SerialLine(engine, CLOCK // baud)
        line.run(CLOCK // 10)
        made = []
        texts = lines(served, seconds)
        for sent in ([b""] * len(texts), texts):
            begun, clock = time.process_time(), engine.clock
            for text in sent:
                line.send(text)
                line.run(round(GAP_S * CLOCK))
            made.append((engine.clock - clock) / (time.process_time() - begun))
    return made[0], made[1]


def main() -> int:
    """Run the benchmark."""
    if reason := CXXRTLEngine.missing():
        print(reason)
        return 1
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 5.0
    print(f"clock {CLOCK / 1e6:g} MHz, {seconds:g} simulated seconds of each")
    for name, served in servable().items():
        single = speeds(served, seconds, stretches=False)
        stretched = speeds(served, seconds, stretches=True)
        for what, slow, fast in zip(("quiet", "sent lines"), single, stretched, strict=True):
            print(f"{name:11} {what:10}  clock by clock {slow:.3g} clocks/s, "
                  f"in stretches {fast:.3g}, {fast / slow:.3g} times")
        print(f"{name:11} real time x {min(stretched) / CLOCK:.3g}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
