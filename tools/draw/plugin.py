"""A command of vpype, `fresa`, that writes what is in its pipeline as G-code for the wall."""

from pathlib import Path

import click
import numpy as np
import vpype
import vpype_cli

from ..console import UserError, write_atomically
from .curves import Polyline
from .program import gcode
from .wall import Part, Wall, place

__all__ = ["fresa"]


@click.command()
@click.argument("output", type=click.Path(dir_okay=False, path_type=Path))
@click.option("--wall", type=(float, float), metavar="WIDTH HEIGHT", default=(1768.0, 1768.0),
              show_default=True, help="Size of the wall in mm; pulleys are at its upper corners.")
@click.option("--top", type=float, metavar="MM", default=200.0, show_default=True,
              help="Begin so far below the pulleys.")
@click.option("--margin", type=float, metavar="MM", default=100.0, show_default=True,
              help="Left free at the left, at the right and below.")
@click.option("--own-size", is_flag=True, help="As large as it is: else as large as it fits.")
@click.option("--width", type=float, metavar="MM", help="Width of the drawing on the wall.")
@click.option("--at", type=(float, float), metavar="X Y",
              help="Upper left corner of the drawing on the wall; else it is in the middle.")
@click.option("--feed", type=float, metavar="N", default=1800.0, show_default=True,
              help="Speed with the pen down, mm/min.")
@click.option("--dwell", type=float, metavar="S", default=0.0, show_default=True,
              help="Seconds that the pen takes to go down or up.")
@vpype_cli.global_processor
def fresa(document: vpype.Document, output: Path, wall: tuple[float, float], top: float,
          margin: float, own_size: bool, width: float | None, at: tuple[float, float] | None,
          feed: float, dwell: float) -> vpype.Document:
    """Write G-code for a hanging plotter of Fresa, a pen for each layer.

    Lines are written in the order in which they are: sort them before.

    Example: vpype read drawing.svg linemerge linesort fresa drawing.gcode
    """
    try:
        write_atomically(output, _program(
            document, Wall(*wall, top=top, margin=margin), width, own_size, at, feed, dwell))
    except UserError as error:
        raise click.ClickException(str(error)) from error
    return document


fresa.help_group = "Output"  # type: ignore[attr-defined]  # where vpype's help lists it


def _program(document: vpype.Document, wall: Wall, width: float | None, own_size: bool,
             at: tuple[float, float] | None, feed: float, dwell: float) -> bytes:
    layers = {number: [np.asarray(line) for line in lines if len(line)]
              for number, lines in document.layers.items()}
    layers = {number: lines for number, lines in layers.items() if lines}
    if not layers:
        raise UserError("there are no lines to draw: read a file first")
    if not (0 < feed < np.inf and 0 <= dwell < np.inf):
        raise UserError("--feed must be above 0, and --dwell not below it")
    points: Polyline = np.concatenate([line for lines in layers.values() for line in lines])
    placement = place(complex(points.real.min(), points.imag.min()),
                      complex(points.real.max(), points.imag.max()), wall, width=width,
                      scale=1.0 if own_size else None, at=None if at is None else complex(*at))
    move = placement.affine
    parts = []
    for number, lines in layers.items():
        about = document.layers[number].metadata
        name = about.get(vpype.METADATA_FIELD_NAME) or f"layer {number}"
        parts.append(Part(str(name), "#000000", [
            line * move.x + move.origin for line in lines]))
    return gcode(parts, wall, feed, dwell).encode("ascii")
