"""The ports that the panel offers: a page may not open what it likes."""

import asyncio
from collections.abc import Callable

from fresa_host.port import find_ports

from ..console import UserError

__all__ = ["Ports"]

#: Seconds from one look for ports to the next.
POLL_S = 2.0


class Ports:
    """Ports that are offered.

    Parameters
    ----------
    own : str, optional
        A port to offer beside those that the system knows, before all others.
    only : bool
        Offer no other port.
    """

    def __init__(self, own: str | None, *, only: bool) -> None:
        self._own = [own] if own else []
        self._only = only
        self._found: list[str] = []

    @property
    def offered(self) -> list[str]:
        """Names of all of them."""
        return self._own + [port for port in self._found if port not in self._own]

    def chosen(self, last: str) -> str | None:
        """Give the port to choose at first, where that which was used last is known."""
        return last if last in self.offered else next(iter(self._own), None)

    def known(self, port: str) -> str:
        """Give a port that is offered.

        Raises
        ------
        UserError
            If it is not.
        """
        if port not in self.offered:
            raise UserError(f"there is no port {port}: choose one of the list")
        return port

    async def watch(self, wanted: Callable[[], bool]) -> None:
        """Look for ports, for ever, while they are wanted."""
        while not self._only:
            if wanted():
                self._found = await asyncio.to_thread(find_ports)
            await asyncio.sleep(POLL_S)
