"""A simulated machine for the panel: its port, switches and break condition."""

from fresa_host import Port

from ..serve import Service, Switches

__all__ = ["Simulated"]


class Simulated:
    """A machine in simulation.

    Parameters
    ----------
    service : Service
        The machine.
    switches : Switches
        Its limit switches.

    Attributes
    ----------
    port : str
        Its serial port.
    """

    def __init__(self, service: Service, switches: Switches) -> None:
        self._service = service
        self.switches = switches
        self.port = service.path

    def open(self, name: str) -> Port:
        """Open its port. See `Port`."""
        return _Breaking(name, self._service)


class _Breaking(Port):
    """A pseudo-terminal. It carries no break condition, which goes to the service directly."""

    def __init__(self, name: str, service: Service) -> None:
        super().__init__(name)
        self._service = service

    @property
    def can_break(self) -> bool:
        return True

    def _hold_low(self) -> None:
        self._service.send_break()
