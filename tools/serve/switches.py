"""Limit switches of a simulated machine, pressed by a command or on a page."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from ..console import known
from .service import Service

__all__ = ["Switches"]


class Switches:
    """The limit switches of a machine.

    Parameters
    ----------
    ends : sequence of str
        Their names, such as ``X+``, by bits of the machine's input ``limits``.
    service : Service
        The machine.
    further : mapping of str to str
        Names of those that have an input of their own, and its name.
    """

    def __init__(self, ends: Sequence[str], service: Service,
                 further: Mapping[str, str] = MappingProxyType({})) -> None:
        self.ends = (*ends, *further)
        self._limits, self._further = tuple(ends), further
        self._service = service
        self._pressed: set[str] = set()

    @property
    def pressed(self) -> list[str]:
        """The pressed switches."""
        return [end for end in self.ends if end in self._pressed]

    def press(self, name: str, on: bool) -> str:
        """Press or release a switch; return its full name.

        Parameters
        ----------
        name : str
            Its name, in either case; the axis is enough if it has one switch.
        on : bool
            Whether to press or release it.

        Raises
        ------
        UserError
            If there is no such switch.
        """
        name = name.upper()
        of_axis = [end for end in self.ends if end[:-1] == name]
        end = of_axis[0] if len(of_axis) == 1 else known(name, self.ends, "limit switch")
        (self._pressed.add if on else self._pressed.discard)(end)
        if end in self._further:
            self._service.set(**{self._further[end]: int(on)})
        else:
            self._service.set(limits=sum((each in self._pressed) << bit
                                         for bit, each in enumerate(self._limits)))
        return end
