"""What the commands share: errors in one line, files whole or not at all, progress."""

import argparse
import difflib
import errno
import functools
import os
import re
import secrets
import shutil
import signal
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path, PurePosixPath
from typing import NoReturn, TextIO

import platformdirs
from tqdm import tqdm

from fresa_boards.programs import ProgramError

__all__ = [
    "FIRST_TIME",
    "Parser",
    "Progress",
    "UserError",
    "check_output",
    "check_outputs",
    "colour",
    "command",
    "is_special",
    "known",
    "say",
    "spelt",
    "staged",
    "terminable",
    "warn",
    "whole",
    "write_atomically",
    "write_files_atomically",
    "write_folder_atomically",
]


def spelt(text: str) -> str:
    """Spell the commands in a text as this one was called: `fresa NAME` if it was by `fresa`.

    Commands are written ``python -m tools.NAME`` everywhere; what people read goes through here.
    """
    if sys.argv[0] != "fresa":  # see fresa_launcher
        return text
    text = re.sub(r"python\s+-m\s+tools\.(?=\w)", "fresa ", text)
    text = re.sub(r"python\s+-m\s+tools\b", "fresa", text)
    return re.sub(r"python\s+-m\s+tb\b", "fresa bench", text)


_refused: ContextVar[bool] = ContextVar("_refused", default=False)
"""Whether ``--machines`` was given, and no parser has yet said that its command takes it."""


class UserError(Exception):
    """An error that the user can put right; its text, one line, is how."""


class Parser(argparse.ArgumentParser):
    """An argument parser for a function under `command`.

    It keeps the line breaks of its description, takes no abbreviated option, and raises `UserError`
    instead of printing its usage.

    Parameters
    ----------
    machines : bool
        The command takes ``--machines``, which `command` has taken out of the command line and
        obeyed. One that does not is refused if it was given.
    """

    def __init__(self, *args, machines: bool = False, **kwargs) -> None:
        kwargs.setdefault("formatter_class", argparse.RawDescriptionHelpFormatter)
        kwargs.setdefault("allow_abbrev", False)
        super().__init__(*args, **kwargs)
        self._machines = machines
        if machines:
            self.add_argument("--machines", metavar="FOLDER", default=argparse.SUPPRESS,
                              help="add the machines of a folder, see docs/adding-a-machine.md; "
                                   "may be repeated")
        self.prog = spelt(self.prog)

    def parse_known_args(self, *args, **kwargs):
        if self._machines:
            _refused.set(False)  # nor by parsers of its subcommands
        elif _refused.get():
            self.error("--machines has no meaning here")
        return super().parse_known_args(*args, **kwargs)

    def format_help(self) -> str:
        return spelt(super().format_help())

    def error(self, message: str) -> NoReturn:
        raise UserError(f"{message} (see {self.prog} --help)")


def colour(text: str, code: int, stream: TextIO) -> str:
    """Colour `text` by `code` (31 is red) if `stream` is a terminal that wants colours."""
    plain = "NO_COLOR" in os.environ or os.environ.get("TERM") == "dumb"
    return text if plain or not stream.isatty() else f"\x1b[{code}m{text}\x1b[0m"


def say(text: str) -> None:
    """Print to stdout. What its encoding lacks, such as odd bytes of a file name, is escaped."""
    if sys.stdout is None:  # closed by the caller
        return
    encoding = sys.stdout.encoding or "utf-8"
    print(spelt(text).encode(encoding, "backslashreplace").decode(encoding))


def warn(text: str) -> None:
    """Print to stderr what is worth knowing and stops nothing."""
    _note("note:", 33, text)


def _note(kind: str, code: int, text: str) -> None:
    print(colour(kind, code, sys.stderr), " ".join(spelt(text).split()), file=sys.stderr)


def command(main: Callable[..., int]) -> Callable[..., int]:
    """Make a `main` whose foreseen errors are one line on stderr and an exit status.

    The status is 2 for a `UserError`, a `ProgramError` or an `OSError`, and 130 for control-C. Any
    other exception is a mistake of ours and keeps its traceback.

    The machines of ``--machines FOLDER``, and of the variable that stands for it, are known before
    `main` begins; it is given a command line without that option.
    """

    @functools.wraps(main)
    def guarded(argv: Sequence[str] | None = None, *args, **kwargs) -> int:
        try:
            argv = sys.argv[1:] if argv is None else argv
            with _machines(argv) as argv, _cache():
                return main(argv, *args, **kwargs)
        except (UserError, ProgramError) as error:
            message, status = str(error), 2
        except BrokenPipeError:
            # The reader of our output has left. Python flushes stdout at exit: give it a sink.
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            return 1
        except OSError as error:
            message, status = describe(error), 2
        except KeyboardInterrupt:
            message, status = "interrupted", 130
        # Designs that were made and now are not used are no news.
        warnings.filterwarnings("ignore", ".* created but never used")
        _note("error:", 31, message)
        return status

    return guarded


@contextmanager
def terminable() -> Iterator[None]:
    """End what is in it by `SystemExit` on SIGTERM: programs are ended, passing files removed.

    The exit status is 143, as a shell has it.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # which gets no signals
        return
    before = signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def _machines(argv: Sequence[str]) -> Iterator[list[str]]:
    """Add the machines that a command line names; give the rest of it."""
    if not os.environ.get("FRESA_MACHINES") and not any(
            word.split("=")[0] == "--machines" for word in argv):
        yield list(argv)  # most commands need not import what a machine is
        return
    from tb.machines import added, split_option

    with ExitStack() as stack:
        try:
            folders, rest = split_option(argv)
            stack.enter_context(added(folders))
            _refused.set(bool(folders))
            stack.callback(_refused.set, False)
        except ValueError as error:
            raise UserError(str(error)) from error
        yield rest


@contextmanager
def _cache() -> Iterator[None]:
    """Where no cache can be kept, keep one for this run: Yosys and compilers need a place."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or platformdirs.user_cache_dir())
    try:
        home.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=home):
            pass
    except OSError:
        with tempfile.TemporaryDirectory() as folder:
            warn(f"nothing can be kept in {home}, so every run prepares everything anew; "
                 "set XDG_CACHE_HOME to a folder that can be written to")
            before = os.environ.get("XDG_CACHE_HOME")
            os.environ["XDG_CACHE_HOME"] = folder
            try:
                yield
            finally:
                os.environ.pop("XDG_CACHE_HOME")
                if before is not None:
                    os.environ["XDG_CACHE_HOME"] = before
        return
    yield


def describe(error: OSError) -> str:
    """Return the message of the system, without number or traceback."""
    reason = error.strerror or str(error) or type(error).__name__
    return reason if error.filename is None else f"{error.filename}: {reason}"


def write_atomically(path: str | os.PathLike, data: bytes) -> None:
    """Write a file whole, or leave what was there.

    Parameters
    ----------
    path : path
        The file. Its folder must exist. A device or a pipe is written to as it is.
    data : bytes
        All of its content.

    Raises
    ------
    UserError
        If it cannot be written.
    """
    write_files_atomically({Path(path): data})


def write_files_atomically(files: Mapping[Path, bytes]) -> None:
    """Write several files, or on any failure leave all of them as they were.

    Each is written beside its place first, and all are renamed once all are written. A single file
    is replaced in one step of the system; of several, a power cut may leave some old and some new,
    but each of them whole. What begins with ``#!`` may be run by all who may read it.

    Raises
    ------
    UserError
        If one of them cannot be written.
    """
    # Follow links, so that the file changes and the link stays.
    places = {Path(os.path.realpath(path)): data for path, data in files.items()}
    staged: dict[Path, Path] = {}
    saved: dict[Path, Path] = {}
    created: list[Path] = []
    path = None
    try:
        for path, data in places.items():
            if path.exists() and not path.is_file():
                path.write_bytes(data)
            else:
                staged[path] = _beside(path)
                _write(staged[path], data)
                if path.exists():
                    shutil.copymode(path, staged[path])
                if data.startswith(b"#!"):
                    _make_executable(staged[path])
        for number, (path, new) in enumerate(staged.items(), start=1):
            if not path.exists():
                created.append(path)
            else:
                # The last one needs no way back: when it is in place, everything is.
                if number < len(staged):
                    saved[path] = _beside(path)
                    os.replace(path, saved[path])
            os.replace(new, path)
    except BaseException as error:
        for new in created:
            _discard(new)
        for original, backup in saved.items():
            if backup.exists():
                os.replace(backup, original)
        for new in staged.values():
            _discard(new)
        if isinstance(error, OSError):
            raise UserError(f"cannot write {path}: {_advice(error, path)}") from error
        raise
    for backup in saved.values():
        _discard(backup)


@contextmanager
def staged(path: Path) -> Iterator[Path]:
    """Yield a place beside `path` to write a large file to; it gets its name when all went well.

    Raises
    ------
    UserError
        If it cannot be written.
    """
    target = Path(os.path.realpath(path))
    new = _beside(target)
    try:
        new.touch()
        yield new
        os.replace(new, target)
    except OSError as error:
        raise UserError(f"cannot write {path}: {_advice(error, path)}") from error
    finally:
        _discard(new)


def write_folder_atomically(folder: str | os.PathLike, files: Mapping[str, bytes]) -> None:
    """Write files into a folder, or on any failure leave it as it was.

    Parameters
    ----------
    folder : path
        The folder. It is made if need be, and keeps the other files that it has.
    files : mapping of str to bytes
        Content of each file by name. A name may contain ``/`` for folders inside.

    Raises
    ------
    UserError
        If the folder cannot be made or one of the files cannot be written.
    ValueError
        If a name would lead out of the folder.
    """
    for name in files:
        pure = PurePosixPath(name)
        if not pure.parts or pure.is_absolute() or ".." in pure.parts or "\\" in name:
            raise ValueError(f"File name must stay inside its folder, not {name!r}")
    folder = Path(folder)
    with _folders({folder, *((folder / name).parent for name in files)}):
        write_files_atomically({folder / name: data for name, data in files.items()})


def check_outputs(
    source: Path, *, pictures: Sequence[Path | None], others: Sequence[Path | None]
) -> None:
    """Refuse to write a picture under another kind's name, or two things to one place.

    Parameters
    ----------
    source : path
        What the command reads, and must not write over.
    pictures, others : sequences of path or None
        Where it will write PNG files and other files, if anywhere.

    Raises
    ------
    UserError
        If one of these is not a place to write to.
    """
    for path in pictures:
        if path is not None and path.suffix.lower() != ".png" and not is_special(path):
            raise UserError(f"{path} would be a PNG file: give it a name that ends in .png")
    taken = [source]
    for path in (*pictures, *others):
        if path is None or is_special(path):
            continue
        if path.is_dir():
            raise UserError(f"cannot write {path}: it is a folder")
        if not path.parent.is_dir():
            exists = "a file is where its folder should be" if path.parent.exists() else (
                "its folder does not exist")
            raise UserError(f"cannot write {path}: {exists}")
        for other in taken:
            if os.path.realpath(path) == os.path.realpath(other) or (
                path.exists() and other.exists() and path.samefile(other)
            ):
                what = "what is read" if other is source else "used twice"
                raise UserError(f"{path} is {what}: write to another file")
        taken.append(path)


def check_output(path: Path | None) -> None:
    """Refuse, before any work, a file that cannot be written; see `check_outputs`."""
    check_outputs(Path(), pictures=[], others=[path])


def whole(least: int, most: int | None = None) -> Callable[[str], int]:
    """Make a type for an argument that is a whole number from `least`, and to `most` if given."""
    limits = f"from {least}" + ("" if most is None else f" to {most}")

    def number(text: str) -> int:
        if not (text.isascii() and text.isdecimal()
                and least <= int(text) <= (int(text) if most is None else most)):
            raise argparse.ArgumentTypeError(f"must be a whole number {limits}, not {text!r}")
        return int(text)

    return number


def known(name: str, names: Iterable[str], what: str) -> str:
    """Return a name if it is one of `names`.

    Raises
    ------
    UserError
        If it is not. The message names one that is like it, or else all.
    """
    names = list(names)
    if name in names:
        return name
    near = difflib.get_close_matches(name, names, 1)
    raise UserError(f"there is no {what} {name!r}; "
                    + (f"did you mean {near[0]}?" if near else f"there are {', '.join(names)}"))


def is_special(path: Path) -> bool:
    """Return whether something is there that is neither a file nor a folder, such as a pipe."""
    return path.exists() and not path.is_file() and not path.is_dir()


FIRST_TIME = ", the first time on a machine takes a minute or two"

PATIENCE, BEAT = 2, 1
"""Seconds until work is named of which nothing is counted, and from then on between its times."""


class Progress:
    """A bar on stderr for work that takes long, as a context manager.

    On a terminal the bar shows after half a second and is wiped out at the end. Elsewhere, in a log
    for instance, there is no bar but a line after 2 s and another every 10 s, with the time left
    from 10 s on. Work of which nothing is counted as done for 2 s is named all the same, and on a
    terminal its time goes on.

    Parameters
    ----------
    total : int
        Amount of work.
    unit : str
        What is counted, in the plural.
    label : str
        What is being done.
    stream : text stream
        Where to show it. stderr by default.
    clock : callable
        Gives the time in seconds.
    """

    def __init__(
        self,
        total: int,
        unit: str,
        label: str,
        *,
        stream: TextIO | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._stream = sys.stderr if stream is None else stream
        self._total, self._unit, self._label = total, unit, label
        self._clock = clock
        self._done = 0
        self._began = clock()
        self._next = self._began + 2
        self._ended = threading.Event()
        self._watch = threading.Thread(target=self._show, daemon=True)
        self._bar = tqdm(
            total=total,
            unit=f" {unit}",
            desc=label,
            delay=0.5,
            leave=False,
            dynamic_ncols=True,
            file=self._stream,
            disable=not self._stream.isatty(),
        )

    def __enter__(self) -> "Progress":
        self._watch.start()
        return self

    def __exit__(self, *exception) -> None:
        self._ended.set()
        self._watch.join()
        self._bar.close()

    def _show(self) -> None:
        if self._ended.wait(PATIENCE):
            return
        if self._bar.disable:
            if not self._done:
                print(f"{self._label} ...", file=self._stream, flush=True)
            return
        self._bar.delay = 0
        while not self._ended.wait(BEAT):
            self._bar.refresh()

    def advance(self, amount: int = 1) -> None:
        """Count `amount` more as done."""
        self._done += amount
        self._bar.update(amount)
        now = self._clock()
        if self._bar.disable and now >= self._next:
            self._next = now + 10
            share = f"{self._done} of {self._total} {self._unit}"
            left = (now - self._began) * (self._total / self._done - 1) if self._done else 0
            if left >= 10:
                share += f", {tqdm.format_interval(left)} left"
            print(f"{self._label}: {share}", file=self._stream, flush=True)


def _beside(path: Path) -> Path:
    # Short, so that a name of full length still has one; random, so that two commands never meet.
    return path.parent / f".{secrets.token_hex(6)}.tmp"


def _write(path: Path, data: bytes) -> None:
    with path.open("xb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def _make_executable(path: Path) -> None:
    mode = path.stat().st_mode
    path.chmod(mode | (mode & 0o444) >> 2)


def _discard(path: Path) -> None:
    with suppress(OSError):
        path.unlink()


def _advice(error: OSError, path: Path | None) -> str:
    if error.errno == errno.ENOENT:
        if path is not None and path.parent.is_dir():  # as of /proc
            return f"{path.parent} takes no files of yours"
        return "its folder does not exist"
    if error.errno in (errno.ENOTDIR, errno.EEXIST):
        return "a file is where its folder should be"
    return error.strerror or str(error)


@contextmanager
def _folders(folders: set[Path]) -> Iterator[None]:
    """Make the folders that are missing; take them away again if the body fails."""
    made: list[Path] = []
    try:
        for folder in sorted(folders):
            missing = [path for path in (folder, *folder.parents) if not path.exists()]
            for path in reversed(missing):
                try:
                    path.mkdir()
                except OSError as error:
                    raise UserError(f"cannot make folder {path}: {_advice(error, path)}") from error
                made.append(path)
        yield
    except BaseException:
        for path in reversed(made):
            with suppress(OSError):
                path.rmdir()
        raise
