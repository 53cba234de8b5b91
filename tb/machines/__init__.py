"""The registry of machines: a folder each, here and in the folders of ``FRESA_MACHINES``.

What a machine's folder holds is said in docs/adding-a-machine.md. A machine of another folder is
imported like those here, as ``tb.machines.NAME``; processes that are started inherit the variable.
"""

import functools
import importlib
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from ..machine import Machine

__all__ = ["OPTION", "VARIABLE", "added", "machines", "split_option"]

#: The environment variable that names further folders, as PATH does.
VARIABLE = "FRESA_MACHINES"

#: The option of commands that names one.
OPTION = "--machines"

_HERE = Path(__file__).parent


@functools.cache
def machines() -> dict[str, Machine]:
    """Return every machine by name, in the order of `Machine.order` and the alphabet.

    Raises
    ------
    ValueError
        If a folder does not hold what it must; the message names the file.
    """
    further = os.environ.get(VARIABLE, "").split(os.pathsep)
    folders = list(dict.fromkeys([_HERE, *(Path(each).resolve() for each in further if each)]))
    __path__[:] = map(str, folders)
    found: dict[str, Machine] = {}
    for folder in folders:
        if not folder.is_dir():
            raise ValueError(f"{folder} is no folder of machines")
        files = sorted(folder.glob("*/__init__.py"))
        if not files:
            raise ValueError(f"{folder} holds no machine: a folder with an __init__.py for each")
        for file in files:
            name = file.parent.name
            if name in found:
                raise ValueError(f"{file}: there is a machine {name} already")
            found[name] = _declared(name, file)
    return dict(sorted(found.items(), key=lambda item: (item[1].order, item[0])))


@contextmanager
def added(folders: Iterable[str | os.PathLike[str]]) -> Iterator[None]:
    """Add the machines of folders, for this process and those that it starts meanwhile.

    Raises
    ------
    ValueError
        As `machines`.
    """
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = os.pathsep.join(
        [*filter(None, [before]), *(str(Path(folder).resolve()) for folder in folders)])
    machines.cache_clear()
    try:
        machines()
        yield
    finally:
        os.environ.pop(VARIABLE)
        if before is not None:
            os.environ[VARIABLE] = before
        machines.cache_clear()


def split_option(argv: Sequence[str]) -> tuple[list[str], list[str]]:
    """Take ``--machines FOLDER`` out of a command line; return the folders and the rest.

    Raises
    ------
    ValueError
        If no folder follows it.
    """
    folders, rest, words = [], [], iter(argv)
    for word in words:
        if word == "--":
            return folders, [*rest, word, *words]
        if word == OPTION:
            folders.append(next(words, ""))
        elif word.startswith(f"{OPTION}="):
            folders.append(word.removeprefix(f"{OPTION}="))
        else:
            rest.append(word)
    if "" in folders:
        raise ValueError(f"{OPTION} wants a folder")
    return folders, rest


def _declared(name: str, file: Path) -> Machine:
    """Import a declaration."""
    package = f"{__name__}.{name}"
    known = sys.modules.get(package)
    if known is not None and known.__file__ != str(file):  # of a folder that was added before
        for module in [each for each in sys.modules if f"{each}.".startswith(f"{package}.")]:
            del sys.modules[module]
    importlib.invalidate_caches()
    try:
        declared = getattr(importlib.import_module(package), "MACHINE", None)
    except Exception as error:
        raise ValueError(f"{file}: {type(error).__name__}: {error}") from error
    if not isinstance(declared, Machine):
        raise ValueError(f"{file} has no MACHINE, a value of tb.machine.Machine")
    if declared.name != name:
        raise ValueError(f"{file}: the machine is named {declared.name}, its folder {name}")
    return declared
