"""The options that machines declare, as options of a command."""

import argparse
from collections.abc import Iterable
from typing import Any

from tb.machine import Option

from ..console import whole

__all__ = ["add_options", "values_of"]


def add_options(group: argparse._ActionsContainer, options: Iterable[Option]) -> None:
    """Add options to a parser or a group of it."""
    for option in options:
        names = ["--" + option.name.replace("_", "-"), *option.aliases]
        if option.default is False:
            group.add_argument(*names, action="store_true", help=option.help)
            continue
        more: dict[str, Any] = {}
        if option.least is not None:
            more["type"] = whole(option.least, option.most)
        if option.choices:
            more["choices"] = option.choices
        if isinstance(option.metavar, tuple):
            more["nargs"] = len(option.metavar)
        group.add_argument(*names, dest=option.name, metavar=option.metavar,
                           default=option.default, help=option.help, **more)


def values_of(args: argparse.Namespace, options: Iterable[Option]) -> dict[str, Any]:
    """Return the values of options by name: those that were parsed, else their defaults."""
    values = {option.name: getattr(args, option.name, option.default) for option in options}
    return {name: tuple(value) if isinstance(value, list) else value
            for name, value in values.items()}
