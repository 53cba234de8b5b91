"""What a panel saves: its settings, and whether the machine moves."""

import os
from pathlib import Path
from typing import IO

from ..console import UserError, warn
from .settings import Settings, load, save

__all__ = ["Store"]

MOVING, AT_REST = b"moving ", b"at rest"


class Store:
    """A settings file that only this process writes.

    Another file, beside it, is locked for that. It holds whether the machine moves, which is
    written before an order to move is sent: at once, while the settings are written durably, which
    takes too long for that.

    Parameters
    ----------
    path : path
        The settings file.

    Attributes
    ----------
    settings : Settings
        What is in the file.
    moving : bool
        Whether the machine has moved since the settings were written, as far as is known. At first,
        whether it did when the last panel ended.

    Raises
    ------
    UserError
        If another panel uses the file, or it cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._mark = _locked(path.with_name(path.name + ".lock"), path)
        self.moving = self._mark is not None and self._mark.read() == MOVING
        try:
            self.settings = load(path)
        except UserError:
            self.close()
            raise

    def close(self) -> None:
        """Unlock the file."""
        if self._mark is not None:
            self._mark.close()

    def mark(self, *, moving: bool) -> None:
        """Write whether the machine moves."""
        self.moving = moving
        if self._mark is not None:
            os.pwrite(self._mark.fileno(), MOVING if moving else AT_REST, 0)

    def save(self, settings: Settings) -> None:
        """Write the settings. May be called in a thread, one at a time.

        Raises
        ------
        UserError
            If the file cannot be written.
        """
        save(self._path, settings)
        self.settings = settings


def _locked(mark: Path, path: Path) -> IO[bytes] | None:
    """Open and lock a file, as long as the process lives; None where that cannot be done."""
    try:
        import fcntl

        mark.parent.mkdir(parents=True, exist_ok=True)
        file = os.fdopen(os.open(mark, os.O_RDWR | os.O_CREAT, 0o600), "rb", buffering=0)
    except (ImportError, OSError) as error:  # Windows, or a folder that cannot be written to
        warn(f"cannot lock {mark} ({error}): use {path} for one panel only")
        return None
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        file.close()
        raise UserError(f"another panel uses {path}: end it first, or set XDG_CONFIG_HOME to "
                        "another folder") from error
    except OSError as error:  # such as a file system without locks
        warn(f"cannot lock {mark} ({error}): use {path} for one panel only")
    return file
