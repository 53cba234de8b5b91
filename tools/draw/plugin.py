"""A command of vpype, `fresa`, that writes what is in its pipeline as G-code for the wall."""

from math import isfinite
from pathlib import Path
from typing import Any

import click
import numpy as np
import vpype
import vpype_cli

from ..console import UserError, write_atomically
from .curves import Polyline
from .program import MOST_DWELL_S, MOST_MM, MOST_SPEED, gcode
from .wall import Part, Wall, place

__all__ = ["fresa"]


class _Number(click.FloatRange):
    """A number of a range; what is none, NaN, is in no range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None
                ) -> float:
        number = super().convert(value, param, ctx)
        if not isfinite(number):
            self.fail(f"{value!r} is not a number that is meant here.", param, ctx)
        return number


LENGTH, SPEED = _Number(0, MOST_MM), _Number(1, MOST_SPEED)


@click.command()
@click.argument("output", type=click.Path(dir_okay=False, path_type=Path))
@click.option("--wall", type=(_Number(1, MOST_MM),) * 2, metavar="WIDTH HEIGHT",
              default=(1768.0, 1768.0), show_default=True,
              help="Size of the wall in mm; pulleys are at its upper corners.")
@click.option("--top", type=LENGTH, metavar="MM", default=200.0, show_default=True,
              help="Begin so far below the pulleys.")
@click.option("--margin", type=LENGTH, metavar="MM", default=100.0, show_default=True,
              help="Left free at the left, at the right and below.")
@click.option("--own-size", is_flag=True, help="As large as it is: else as large as it fits.")
@click.option("--width", type=_Number(0.001, MOST_MM), metavar="MM",
              help="Width of the drawing on the wall.")
@click.option("--at", type=(LENGTH,) * 2, metavar="X Y",
              help="Upper left corner of the drawing on the wall; else it is in the middle.")
@click.option("--rest", type=(LENGTH,) * 2, metavar="X Y",
              help="Where the pen is before and after; else the middle of the wall.")
@click.option("--feed", type=SPEED, metavar="N", default=1800.0, show_default=True,
              help="Speed with the pen down, mm/min.")
@click.option("--dwell", type=_Number(0, MOST_DWELL_S), metavar="S", default=0.0, show_default=True,
              help="Seconds that the pen takes to go down or up.")
@vpype_cli.global_processor
def fresa(document: vpype.Document, output: Path, wall: tuple[float, float], top: float,
          margin: float, own_size: bool, width: float | None, at: tuple[float, float] | None,
          rest: tuple[float, float] | None, feed: float, dwell: float) -> vpype.Document:
    """Write G-code for a hanging plotter of Fresa, a pen for each layer.

    Lines are written in the order in which they are: sort them before.

    Example: vpype read drawing.svg linemerge linesort fresa drawing.gcode
    """
    try:
        if own_size and width is not None:
            raise UserError("--own-size and --width say two sizes")
        write_atomically(output, _program(
            document, Wall(*wall, top=top, margin=margin, rest=_place(rest)), width, own_size,
            _place(at), feed, dwell))
    except UserError as error:
        refused = click.ClickException(str(error))
        refused.exit_code = 2
        raise refused from error
    return document


fresa.help_group = "Output"  # type: ignore[attr-defined]  # where vpype's help lists it


def _place(words: tuple[float, float] | None) -> complex | None:
    return None if words is None else complex(*words)


def _program(document: vpype.Document, wall: Wall, width: float | None, own_size: bool,
             at: complex | None, feed: float, dwell: float) -> bytes:
    layers = {number: [np.asarray(line) for line in lines if len(line)]
              for number, lines in document.layers.items()}
    layers = {number: lines for number, lines in layers.items() if lines}
    if not layers:
        raise UserError("there are no lines to draw: read a file first")
    points: Polyline = np.concatenate([line for lines in layers.values() for line in lines])
    placement = place(complex(points.real.min(), points.imag.min()),
                      complex(points.real.max(), points.imag.max()), wall, width=width,
                      scale=1.0 if own_size else None, at=at)
    move = placement.affine
    parts = []
    for number, lines in layers.items():
        about = document.layers[number].metadata
        name = about.get(vpype.METADATA_FIELD_NAME) or f"layer {number}"
        parts.append(Part(str(name), "#000000", [
            line * move.x + move.origin for line in lines]))
    return gcode(parts, wall, feed, dwell).encode("ascii")
