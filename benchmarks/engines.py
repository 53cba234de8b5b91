"""How fast the engines mill, side by side in one run.

    python -m benchmarks.engines [PIXELS]

Mills a picture of 400 x 400 with PIXELS set pixels (4000 unless told otherwise) on CXXRTL, from
nothing to the finished cut, compilation included; then a corner of it on each engine that runs
here, and prints clocks a second and their ratio.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tb.engines import ENGINES
from tb.milling import mill_picture


def picture(pixels: int) -> np.ndarray:
    """Draw nested squares until enough pixels are set."""
    drawn = np.zeros((400, 400), bool)
    for inset in range(0, 200, 4):
        ring = np.zeros_like(drawn)
        ring[inset:400 - inset, inset:400 - inset] = True
        ring[inset + 1:399 - inset, inset + 1:399 - inset] = False
        places = np.flatnonzero(ring & ~drawn)[:pixels - int(drawn.sum())]
        drawn.reshape(-1)[places] = True
    return drawn


def main() -> int:
    """Run the benchmark."""
    large = picture(int(sys.argv[1]) if len(sys.argv) > 1 else 4000)
    small = large[:12, :12]
    if reason := ENGINES["cxxrtl"].missing():
        print(reason)
    else:
        with tempfile.TemporaryDirectory() as cache:
            os.environ["XDG_CACHE_HOME"] = cache  # nothing compiled before counts
            os.environ.setdefault("YOWASP_CACHE_DIR", str(Path.home() / ".cache" / "YoWASP"))
            begun = time.perf_counter()
            cut = mill_picture(large, ENGINES["cxxrtl"])
            seconds = time.perf_counter() - begun
        assert cut.right
        print(f"{large.sum()} pixels of 400 x 400 in {seconds:.1f} s, compilation included: "
              f"{cut.clocks} clocks, {cut.clocks / cut.seconds:.3g} a second once compiled")
    speeds = {}
    for name, engine in ENGINES.items():
        # Yosys has no model of a block RAM, and nobody has described a board in VHDL.
        if engine.missing() or name.startswith(("netlist", "ghdl")):
            continue
        cut = mill_picture(small, engine)
        assert cut.right
        speeds[name] = cut.clocks / cut.seconds
        print(f"{small.sum()} pixels of 12 x 12 on {name}: {speeds[name]:.3g} clocks a second")
    for name, speed in speeds.items():
        if name != "amaranth":
            print(f"{name} : amaranth = {speed / speeds['amaranth']:.3g}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
