"""Uploaded pictures, prepared as `tools.image` does, with its options."""

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import NoReturn

from ..console import Parser, UserError
from ..image import add_picture_arguments, picture_from_arguments
from ..picture import Prepared

__all__ = ["LARGEST_UPLOAD", "prepared"]

#: Most bytes of an uploaded file.
LARGEST_UPLOAD = 32 << 20

#: Options without a value.
FLAGS = ("invert", "outline", "thin", "enlarge", "keep-lines")
VALUES = ("size", "threshold", "turn", "mirror")


class _Options(Parser):
    def error(self, message: str) -> NoReturn:
        raise UserError(message)  # there is no --help on a page


def prepared(data: bytes, query: Mapping[str, str]) -> Prepared:
    """Prepare a picture.

    Parameters
    ----------
    data : bytes
        The file of a picture.
    query : mapping of str to str
        Options of `tools.image` without their dashes. Options without a value are set by 1 and
        cleared by 0; an empty value counts as none.

    Raises
    ------
    UserError
        If the options or the picture are invalid.
    """
    if not data:
        raise UserError("no picture was sent: choose a file")
    parser = _Options(add_help=False)
    add_picture_arguments(parser)
    with tempfile.TemporaryDirectory(prefix="fresa-") as folder:
        path = Path(folder) / "picture"
        path.write_bytes(data)
        args = parser.parse_args(_arguments(query))
        args.image = path
        try:
            return picture_from_arguments(args)
        except UserError as error:
            raise UserError(str(error).replace(str(path), "the file")) from error


def _arguments(query: Mapping[str, str]) -> list[str]:
    arguments: list[str] = []
    for name, value in query.items():
        if name in VALUES:
            arguments += [f"--{name}={value}"] if value else []
        elif name not in FLAGS:
            raise UserError(f"there is no option {name[:40]!r}: {', '.join((*VALUES, *FLAGS))}")
        elif value not in ("", "0", "1"):
            raise UserError(f"{name} must be 0 or 1, not {value[:40]!r}")
        elif value == "1":
            arguments.append(f"--{name}")
    return arguments
