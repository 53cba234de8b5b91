"""Subcommand `view`: open a wave in GTKWave or Surfer."""

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

from vcd.gtkw import GTKWColor, GTKWFlag, GTKWSave

from ..console import UserError, check_output, say, staged
from . import names
from .options import print_json
from .radix import Radixes, is_graph
from .reader import Signal, Wave

__all__ = ["save", "view"]

VIEWERS = ("gtkwave", "surfer")

ABOUT = """\
Opens a wave in GTKWave or Surfer, whichever is installed.

With SIGNAL, a save file for GTKWave with these signals is written; Surfer has files of its own and
opens the wave alone. Without SIGNAL, a save file next to the wave is used if there is one, such as
python -m tb writes.
"""

EXAMPLES = """\
examples:
  python -m tools.wave view mill.vcd
      With mill.gtkw, if it exists.

  python -m tools.wave view mill.vcd 'axis_?' ready --save mine.gtkw
      These signals, saved in mine.gtkw.

  python -m tools.wave view mill.vcd ready --save mine.gtkw --no-open
      Write the save file only.
"""


def view(subparsers) -> None:
    """Add the subcommand `view`."""
    parser = subparsers.add_parser("view", help="open it in GTKWave or Surfer", description=ABOUT,
                                   epilog=EXAMPLES)
    parser.add_argument("file", metavar="FILE", type=Path, help="a waveform: VCD, FST or GHW")
    parser.add_argument("signals", metavar="SIGNAL", nargs="*", help="names or patterns")
    parser.add_argument("--save", metavar="FILE", type=Path,
                        help="path of the save file (default: FILE.view.gtkw)")
    parser.add_argument("--viewer", choices=VIEWERS, help="the program (default: first installed)")
    parser.add_argument("--no-open", action="store_true", help="do not open the viewer")
    parser.add_argument("--radix", metavar="NAME=hex", action="append", default=[],
                        help="show a signal as bin, hex, dec or signed; may be repeated")
    parser.add_argument("--json", action="store_true", help="print the result in JSON")
    parser.set_defaults(run=_view)


def save(path: Path, wave: Wave, signals: list[Signal], radixes: Radixes) -> None:
    """Write a save file for GTKWave with these signals.

    Raises
    ------
    UserError
        If it cannot be written.
    """
    with staged(path) as place, place.open("w", encoding="utf-8") as file:
        gtkw = GTKWSave(file)
        gtkw.dumpfile(str(wave.path.absolute()))
        gtkw.savefile(str(path.absolute()))
        for signal in signals:
            name = signal.declared + (f"[{signal.bits - 1}:0]" if signal.bits > 1 and
                                      signal.kind in ("bits", "signed") else "")
            if signal.kind in ("text", "event", "real"):
                gtkw.trace(name, datafmt="ascii" if signal.kind == "text" else "real",
                           color=GTKWColor.orange if signal.kind == "text" else None)
            else:
                gtkw.trace(name, datafmt=radixes.of(signal) if signal.bits > 1 else "bin",
                           extraflags=GTKWFlag.analog_step if is_graph(signal) else GTKWFlag(0))
                if is_graph(signal):
                    gtkw.blank(analog_extend=True)


def _view(args: argparse.Namespace) -> int:
    wave = Wave(args.file)
    default_save = args.file.with_suffix(".gtkw")
    target = args.save or (args.file.with_suffix(".view.gtkw") if args.signals else None)
    if target is not None:
        if not args.signals:
            raise UserError("--save goes with signals: python -m tools.wave list shows them")
        if target.suffix != ".gtkw":
            raise UserError(f"{target} is not a name that ends in .gtkw")
        check_output(target)
    viewer = None if args.no_open else _viewer(args.viewer)
    if target is not None:
        save(target, wave, names.several(wave, args.signals), Radixes(wave, args.radix))
    elif default_save.is_file():
        target = default_save
    opened = target if target is not None and viewer and viewer.endswith("gtkwave") else args.file
    if viewer is not None:
        # In a session of its own it survives the end of the terminal.
        subprocess.Popen([viewer, str(opened)], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                         stderr=subprocess.DEVNULL, start_new_session=True)
    if args.json:
        print_json({"viewer": viewer, "opened": str(opened) if viewer else None,
                  "save": None if target is None else str(target)})
        return 0
    if args.signals:
        say(f"wrote {target}")
    if viewer is not None:
        say(f"opened {opened} in {Path(viewer).name}")
    return 0


def _viewer(wanted: str | None) -> str:
    """Return the path of an installed viewer."""
    found = [path for name in ([wanted] if wanted else VIEWERS) if (path := shutil.which(name))]
    if not found:
        raise UserError(f"{wanted or 'neither GTKWave nor Surfer'} is "
                        f"{'not ' if wanted else ''}installed; python -m tools.wave draw makes "
                        "pictures without")
    if sys.platform.startswith("linux") and not (
            os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise UserError(f"there is no screen to open {Path(found[0]).name} on; "
                        "python -m tools.wave draw makes pictures without")
    return found[0]
