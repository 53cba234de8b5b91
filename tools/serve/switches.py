"""Limit switches of a machine that runs in simulation: somebody else has to press them."""

from collections.abc import Sequence

from ..console import known
from .service import Service

__all__ = ["Switches"]


class Switches:
    """Limit switches.

    Parameters
    ----------
    ends : sequence of str
        Their names, such as ``X+``, by the bits of the machine's input ``limits``.
    service : Service
        The machine.
    """

    def __init__(self, ends: Sequence[str], service: Service) -> None:
        self.ends = tuple(ends)
        self._service = service
        self._pressed: set[str] = set()

    @property
    def pressed(self) -> list[str]:
        """Those that are pressed."""
        return [end for end in self.ends if end in self._pressed]

    def press(self, name: str, on: bool) -> str:
        """Press a switch, or let go of it; give its whole name.

        Parameters
        ----------
        name : str
            Its name, in capitals or not; the axis is enough where that has one switch.
        on : bool
            Whether to press it.

        Raises
        ------
        UserError
            If there is no such switch.
        """
        name = name.upper()
        of_axis = [end for end in self.ends if end[:-1] == name]
        end = of_axis[0] if len(of_axis) == 1 else known(name, self.ends, "limit switch")
        (self._pressed.add if on else self._pressed.discard)(end)
        self._service.set(limits=sum((end in self._pressed) << bit
                                     for bit, end in enumerate(self.ends)))
        return end
