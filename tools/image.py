"""Prepare a picture for milling, and look at it before anything turns."""

import argparse
import json
from pathlib import Path

from PIL import Image

from fresa.machines.mill import PICTURE_MAX

from .console import Parser, check_outputs, command, is_special, say, write_files_atomically
from .picture import LARGEST, Prepared, encode, load, prepare, preview

__all__ = ["add_picture_arguments", "main", "picture_from_arguments", "prepares_picture"]

ABOUT = """\
Turns any picture into the pixels that the machine mills: dark is cut, light stays.

The result is a PNG of one bit a pixel, black where the tool cuts. python -m tools.build and
python -m tools.simulate take it as it is: whatever has two values and fits is never altered.
A pixel is 128 steps, 0.56 mm; the machine takes 400 x 400 of them. The nearest pixel is milled
next, which leaves some in the corners of filled figures for later: a rectangle of 17 x 13 takes 6
plunges of 22.7 s each, and with --outline one.
"""

EXAMPLES = """\
examples:
  python -m tools.image photo.jpg
      Write photo.jpg-mill.png, at most 400 x 400 pixels, cut at a threshold found by itself, and
      photo.jpg-preview.png, what it will look like, with a bar of millimetres.

  python -m tools.image drawing.png --size 96x96 --keep-lines --thin
      Shrink a drawing without losing its fine lines, then mill each line once.

  python -m tools.image logo.png --invert --outline -o cut.png
      A logo light on dark, only along its edge.

  python -m tools.image photo.jpg --threshold 90
      Too much is black? Lower the threshold. Too little? Raise it.

  python -m tools.image stamp.png --mirror horizontal
      A stamp reads from right to left.
"""


def add_picture_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options that prepare a picture, for `picture_from_arguments` to read.

    The name of the file is the command's own: its argument must arrive as ``image``.

    Parameters
    ----------
    parser : argparse.ArgumentParser
        The parser of the command.
    """
    group = parser.add_argument_group("preparing the picture")
    group.add_argument(
        "--size",
        metavar="WxH",
        type=_size,
        help=f"fit into W columns and H rows (default: {PICTURE_MAX}x{PICTURE_MAX}, or what the "
        f"board holds for which it is built; more, up to {LARGEST} each, for python -m tools.send, "
        "or as far as a larger board's memory goes); a smaller picture stays as it is",
    )
    group.add_argument(
        "--threshold",
        metavar="N",
        type=_threshold,
        default=None,
        help="count greys from 0 (black) to N as dark, or 'otsu' to find N (the default)",
    )
    group.add_argument("--invert", action="store_true", help="mill what is light")
    lines = group.add_mutually_exclusive_group()
    lines.add_argument("--outline", action="store_true", help="mill only the edge of each figure")
    lines.add_argument("--thin", action="store_true", help="mill only its middle line")
    group.add_argument(
        "--turn",
        metavar="DEGREES",
        type=int,
        choices=(0, 90, 180, 270),
        default=0,
        help="turn clockwise by 90, 180 or 270, before any mirror",
    )
    group.add_argument(
        "--mirror",
        metavar="WAY",
        choices=("horizontal", "vertical"),
        default=None,
        help="horizontal: swap left and right; vertical: swap top and bottom",
    )
    group.add_argument("--enlarge", action="store_true", help="let a small picture grow to fit")
    group.add_argument(
        "--keep-lines", action="store_true", help="do not let fine lines fade when shrinking"
    )


def prepares_picture(args: argparse.Namespace) -> bool:
    """Return whether any of these options was given a value other than its own."""
    parser = argparse.ArgumentParser()
    add_picture_arguments(parser)
    return any(getattr(args, name) != value for name, value in vars(parser.parse_args([])).items())


def picture_from_arguments(args: argparse.Namespace) -> Prepared:
    """Load and prepare the picture that a command was given.

    Parameters
    ----------
    args : argparse.Namespace
        What a parser with `add_picture_arguments` gave; ``args.image`` is the file.

    Returns
    -------
    Prepared
        At least one of its pixels is set.

    Raises
    ------
    PictureError
        If the file cannot be read, or there would be nothing to mill.
    """
    width, height = args.size or (PICTURE_MAX, PICTURE_MAX)
    return prepare(
        load(args.image),
        width=width,
        height=height,
        threshold=args.threshold,
        invert=args.invert,
        outline=args.outline,
        thin=args.thin,
        turn=args.turn,
        mirror=args.mirror,
        enlarge=args.enlarge,
        keep_lines=args.keep_lines,
    )


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = Parser(prog="python -m tools.image", description=ABOUT, epilog=EXAMPLES)
    parser.add_argument("image", metavar="PICTURE", type=Path, help="PNG, JPEG, GIF, BMP, TIFF ...")
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE.png",
        type=Path,
        help="write the pixels to FILE.png (default: beside PICTURE, as NAME-mill.png; NAME is "
        "that of PICTURE, without .png)",
    )
    parser.add_argument(
        "--preview",
        metavar="FILE.png",
        type=Path,
        help="draw there what is milled, enlarged and measured (default: beside the pixels, as "
        "NAME-preview.png)",
    )
    parser.add_argument(
        "--json", metavar="FILE", type=Path, help="write what was done: size, threshold, pixels ..."
    )
    add_picture_arguments(parser)
    args = parser.parse_args(argv)

    # Pictures that differ in their ending alone have files of their own.
    name = args.image.name.removesuffix(".png")
    output = args.output or args.image.parent / f"{name}-mill.png"
    look = args.preview
    if look is None and not is_special(output):
        look = output.with_name(f"{output.stem.removesuffix('-mill')}-preview.png")
    check_outputs(args.image, pictures=[output, look], others=[args.json])
    prepared = picture_from_arguments(args)

    # Pillow reads 1 as white; what is cut is black.
    files = {output: encode(Image.fromarray(~prepared.pixels))}
    if look is not None:
        files[look] = encode(preview(prepared.pixels))
    if args.json is not None:
        files[args.json] = (json.dumps(prepared.facts(), indent=2) + "\n").encode()
    write_files_atomically(files)

    say(prepared.summary())
    for path in files:
        say(f"wrote {path}")
    return 0


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.lower().partition("x")
    sides = [int(side) if side.isascii() and side.isdecimal() else 0 for side in (width, height)]
    if not cross or not all(1 <= side <= LARGEST for side in sides):
        raise argparse.ArgumentTypeError(
            f"must be columns and rows from 1x1 to {LARGEST}x{LARGEST}, such as 200x150, "
            f"not {text!r}"
        )
    return sides[0], sides[1]


def _threshold(text: str) -> int | None:
    if text.lower() == "otsu":
        return None
    if not (text.isascii() and text.isdecimal() and len(text) <= 3 and int(text) <= 255):
        raise argparse.ArgumentTypeError(f"must be 'otsu' or 0 to 255, not {text!r}")
    return int(text)


if __name__ == "__main__":
    raise SystemExit(main())
