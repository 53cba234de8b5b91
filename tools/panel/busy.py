"""One slow operation at a time."""

import asyncio
from collections.abc import Callable, Coroutine

from fresa_host import MachineError

from ..console import UserError

__all__ = ["Busy"]


class Busy:
    """Runs a slow operation in the background, one at a time.

    Parameters
    ----------
    ended : callable
        Called in the event loop at its end, with the machine's error if there was one.

    Attributes
    ----------
    doing : str
        The operation that is running; empty if there is none.
    """

    def __init__(self, ended: Callable[[MachineError | None], None]) -> None:
        self._ended = ended
        self._task: asyncio.Task[None] | None = None
        self.doing = ""

    def begin(self, doing: str, work: Coroutine[None, None, None]) -> None:
        """Begin an operation.

        Raises
        ------
        UserError
            If one is running.
        """
        if self._task is not None:
            work.close()
            raise UserError(f"{self.doing}: wait a moment")
        self.doing = doing
        self._task = asyncio.create_task(work)
        self._task.add_done_callback(self._done)

    async def cancel(self) -> None:
        """Cancel the operation, if one is running."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    def _done(self, task: asyncio.Task[None]) -> None:
        self._task, self.doing = None, ""
        error = None if task.cancelled() else task.exception()
        self._ended(error if isinstance(error, MachineError) else None)
        if error is not None and not isinstance(error, MachineError):
            raise error  # a bug must be shown
