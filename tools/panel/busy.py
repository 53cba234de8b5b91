"""What takes its time, one at once."""

import asyncio
from collections.abc import Callable, Coroutine

from fresa_host import MachineError

from ..console import UserError

__all__ = ["Busy"]


class Busy:
    """Whether something is being done, and what.

    Parameters
    ----------
    ended : callable
        Called in the event loop when it is done, with what was wrong with the machine, if anything.

    Attributes
    ----------
    doing : str
        What is being done; empty if nothing.
    """

    def __init__(self, ended: Callable[[MachineError | None], None]) -> None:
        self._ended = ended
        self._task: asyncio.Task[None] | None = None
        self.doing = ""

    def begin(self, doing: str, work: Coroutine[None, None, None]) -> None:
        """Begin something.

        Raises
        ------
        UserError
            If something is being done.
        """
        if self._task is not None:
            work.close()
            raise UserError(f"{self.doing}: wait a moment")
        self.doing = doing
        self._task = asyncio.create_task(work)
        self._task.add_done_callback(self._done)

    async def cancel(self) -> None:
        """End it, whether it is done or not."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    def _done(self, task: asyncio.Task[None]) -> None:
        self._task, self.doing = None, ""
        error = None if task.cancelled() else task.exception()
        self._ended(error if isinstance(error, MachineError) else None)
        if error is not None and not isinstance(error, MachineError):
            raise error  # a mistake of ours must be seen
