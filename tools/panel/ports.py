"""The serial ports of this computer."""

__all__ = ["find_ports"]


def find_ports() -> list[str]:
    """Give the names of the serial ports that the system knows, those on USB first."""
    from serial.tools.list_ports import comports  # only who talks to a machine needs it

    found = sorted(comports(), key=lambda port: (port.vid is None, port.device))
    return [port.device for port in found]
