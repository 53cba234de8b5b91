"""Time and memory of commands on a large waveform."""

import os
import sys
import tempfile
import time
from pathlib import Path

from tools.console import Parser, command, whole

ABOUT = """\
Makes a VCD, and runs commands on it, each in a process of its own. Prints the time, its ratio to
the time in which Python reads the bytes of the file, and the peak memory as a multiple of the file,
or for diff of both files. Commands with millions of lines are limited by --to; they read the whole
file nevertheless.
"""

SIGNALS = 200
OTHER = "OTHER"
"""Stands for a second waveform of the same content, which also counts as read."""

COMMANDS = (
    ("list",), ("stats", "clk"), ("stats", "count"), ("stats", "state", "axis_x"),
    ("find", "rise step and count > 0x100", "--to", "1us"),
    ("find", "change clk and count[3:0] == 5 and state == 'MOVING'", "--to", "1us"),
    ("at", "10000clk", "count", "state"), ("table", "clk", "count", "state", "--to", "10us"),
    ("diff", OTHER, "clk", "count"),
)


def write(path: Path, size: int) -> None:
    """Write a VCD of a clock, a counter, a state, a coil word, and buses that change rarely."""
    heads = ["$timescale 1 ps $end", "$scope module bench $end", "$var wire 1 ! clk $end",
             '$var wire 1 " step $end', "$var wire 16 # count $end", "$var wire 4 $ axis_x $end",
             "$var string 1 % state $end"]
    heads += [f"$var wire 8 s{n} bus_{n} $end" for n in range(SIGNALS)]
    heads += ["$upscope $end", "$enddefinitions $end", ""]
    words = ("0110", "0011", "1001", "1100")
    with path.open("w", encoding="ascii") as file:
        file.write("\n".join(heads))
        clock = 0
        while file.tell() < size:
            lines = []
            for _ in range(50_000):
                lines.append(f"#{clock * 20_000}\n1!\nb{clock & 0xFFFF:b} #\n"
                             f"b{clock * 7 & 255:b} s{clock % SIGNALS}")
                if clock % 4 == 0:
                    lines.append(f'1"\nb{words[clock // 4 % 4]} $')
                elif clock % 4 == 1:
                    lines.append('0"')
                if clock % 16 == 0:
                    lines.append(f"s{('REST/0', 'MOVING/1')[clock // 16 % 2]} %")
                lines.append(f"#{clock * 20_000 + 10_000}\n0!\n")
                clock += 1
            file.write("\n".join(lines).replace("\n\n", "\n"))


def run(*command: str) -> tuple[float, int]:
    """Run a command; return its time in seconds and its peak memory in bytes."""
    begun = time.perf_counter()
    child = os.fork()
    if child == 0:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.execv(sys.executable, [sys.executable, "-m", *command])
    _, status, usage = os.wait4(child, 0)
    seconds = time.perf_counter() - begun
    if os.waitstatus_to_exitcode(status) not in (0, 1):
        raise SystemExit(f"python -m {' '.join(command)} failed")
    return seconds, usage.ru_maxrss * 1024


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = Parser(prog="python -m benchmarks.waves", description=ABOUT)
    parser.add_argument("megabytes", metavar="MEGABYTES", type=whole(1, 10_000), nargs="?",
                        default=100, help="size of the VCD (default: %(default)s)")
    size = parser.parse_args(argv).megabytes * 1_000_000
    with tempfile.TemporaryDirectory() as folder:
        vcd = Path(folder) / "large.vcd"
        write(vcd, size)
        size = vcd.stat().st_size
        begun = time.perf_counter()
        with vcd.open("rb") as file:
            while file.read(1 << 20):
                pass
        read = time.perf_counter() - begun
        print(f"{size / 1e6:.0f} MB of VCD, read by Python in {read:.2f} s")
        for name, *rest in COMMANDS:
            files = 1 + rest.count(OTHER)
            seconds, memory = run("tools.wave", name, str(vcd),
                                  *(str(vcd) if word == OTHER else word for word in rest))
            words = " ".join((name, *rest))
            print(f"{words:69} {seconds:5.2f} s, {seconds / read / files:4.0f} x reading; "
                  f"{memory / 1e6:4.0f} MB, {memory / size / files:.2f} x the file")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
