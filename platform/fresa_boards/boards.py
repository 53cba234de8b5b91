"""Every board, by its name."""

from .board import Board
from .hx8k_evn import BOARDS as HX8K_EVN
from .icebreaker import BOARDS as ICEBREAKER
from .icepi_zero import BOARDS as ICEPI_ZERO
from .nexys2 import BOARDS as NEXYS2
from .tang_nano import BOARDS as TANG_NANO
from .ulx3s import BOARDS as ULX3S

__all__ = ["BOARDS"]

BOARDS: dict[str, Board] = {board.name: board for board in (
    *NEXYS2, *ICEPI_ZERO, *ULX3S, *ICEBREAKER, *TANG_NANO, *HX8K_EVN)}
