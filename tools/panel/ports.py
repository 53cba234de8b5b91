"""The ports that the panel offers: a page cannot open others."""

import asyncio
from collections.abc import Callable

from fresa_host.port import find_ports

from ..console import UserError

__all__ = ["Ports"]

#: Seconds between two listings of the ports.
POLL_S = 2.0


class Ports:
    """Ports that are offered.

    Parameters
    ----------
    own : str, optional
        A port to offer before those that the system lists.
    only : bool
        Offer no other port.
    """

    def __init__(self, own: str | None, *, only: bool) -> None:
        self._own = [own] if own else []
        self._only = only
        self._found: list[str] = []

    @property
    def offered(self) -> list[str]:
        """Names of all offered ports."""
        return self._own + [port for port in self._found if port not in self._own]

    def chosen(self, last: str) -> str | None:
        """Return the port to select first: the one used last if it is offered."""
        return last if last in self.offered else next(iter(self._own), None)

    def known(self, port: str) -> str:
        """Return a port if it is offered.

        Raises
        ------
        UserError
            If it is not.
        """
        if port not in self.offered:
            raise UserError(f"there is no port {port}: choose one of the list")
        return port

    async def watch(self, wanted: Callable[[], bool]) -> None:
        """List the ports again and again, while `wanted` returns true."""
        while not self._only:
            if wanted():
                self._found = await asyncio.to_thread(find_ports)
            await asyncio.sleep(POLL_S)
