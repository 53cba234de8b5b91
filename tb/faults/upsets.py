"""A machine to strike: flip-flops that change by themselves, and resets at any time, on CXXRTL.

The loops are in C++, in ``upsets.cc``, below the design that CXXRTL has written.
"""

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import IntEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..design import Design
from ..engines import EngineError
from ..engines.build import library
from ..models.mill import MillInputs
from .work import Rows

__all__ = ["Register", "Silent", "Trial", "Verdict", "WrongReset"]

PATIENCE = 2000
"""Clocks more than a row took without an upset after which nobody waits for the machine."""

WINDOW = 400
"""Clocks of work after an upset, at least, before it is asked what has become of it."""

ROOM = 8
"""Silent upsets of which a call tells more."""


class Verdict(IntEnum):
    """What an upset comes to.

    HARMLESS
        The motors end where they would have without it, and the machine counts so.
    VISIBLE
        `error` is shown, outside a reset, in a clock of the work in which it would not be, or in
        place of `ready` for ever.
    STUCK
        The machine stands still and is never ready again; but it knows where it is.
    SILENT
        None of these: without a word the motors end somewhere else, or the machine believes so.
    """

    HARMLESS = 0
    VISIBLE = 1
    STUCK = 2
    SILENT = 3


@dataclass(frozen=True)
class Register:
    """A register by its path, and its bits."""

    name: str
    width: int


@dataclass(frozen=True)
class Silent:
    """A silent upset: which bit, in which clock of the work, and where the motors are for it.

    `place` is X, Y and Z from power-up, and `asked` where they would be without the upset.
    """

    register: str
    bit: int
    clock: int
    place: tuple[int, ...]
    asked: tuple[int, ...]


@dataclass(frozen=True)
class WrongReset:
    """What was found wrong with a reset, and in which clock."""

    clock: int
    what: str


class Trial:
    """A milling machine, and work for it.

    Parameters
    ----------
    design : Design
        The raw machine, of `tb.boards.mill`.

    Raises
    ------
    EngineError
        If CXXRTL cannot run here.
    """

    def __init__(self, design: Design) -> None:
        self._lib = _declare(library(design, more=Path(__file__).with_name("upsets.cc")))
        inputs, outputs = list(design.inputs), list(design.outputs)
        if inputs != [field.name for field in fields(MillInputs)]:
            raise ValueError(f"Inputs must be those of the mill, not {inputs}")
        coils = np.array([outputs.index(f"axis_{axis}") for axis in "xyz"], np.int32)
        self._pins = inputs.index("rst"), inputs.index("mode")
        for part in ("", "main "):  # without a guard, and with it
            names = [f"dut controller {part}automatic {axis} count".encode() for axis in "xyz"]
            self._handle = self._lib.faults_new(
                (ctypes.c_char_p * 3)(*names), outputs.index("ready"), outputs.index("error"),
                coils, self._pins[0])
            if self._handle:
                break
        else:
            raise EngineError("CXXRTL knows no axis counters")
        self.registers = self._find_registers()
        self._rows: Rows | None = None

    def _find_registers(self) -> list[Register]:
        width, found = ctypes.c_int64(), []
        while name := self._lib.faults_register(self._handle, len(found), width):
            path = name.decode().removeprefix("dut ").replace(" ", ".")
            found.append(Register(path, width.value))
        return found

    def close(self) -> None:
        """Let go of the machine."""
        if self._handle:
            self._lib.faults_delete(self._handle)
            self._handle = None

    def load(self, rows: Rows) -> None:
        """Give the machine work."""
        self._rows = rows  # whose arrays the loops read
        self._lib.faults_rows(self._handle, len(rows), rows.levels, rows.clocks, rows.waits,
                              *self._pins)

    def work(self) -> int:
        """Do the work undisturbed; give its clocks.

        Raises
        ------
        ValueError
            If the machine is never ready, or its counters are not what its coils have done.
        """
        compared = np.array([not register.name.startswith("monitor.")
                             for register in self.registers], np.uint8)
        clocks = self._lib.faults_work(self._handle, compared, PATIENCE)
        if clocks < 0:
            raise ValueError("The machine does not do this work, even undisturbed")
        return clocks

    def flips(self, seed: int, first: int, count: int) -> tuple[NDArray[np.int64], list[Silent]]:
        """Upset a bit in a clock of the work, both by chance, again and again.

        Parameters
        ----------
        seed, first : int
            Of the chance, and the number of the first upset: it says where and when.
        count : int
            Upsets.

        Returns
        -------
        array, list of Silent
            How often it came to each `Verdict`, one row a register; the first silent ones.
        """
        verdicts = np.zeros((len(self.registers), len(Verdict)), np.int64)
        silent = np.zeros((ROOM, 9), np.int64)
        found = self._lib.faults_flips(self._handle, seed, first, count, WINDOW, PATIENCE, verdicts,
                                       silent, ROOM)
        return verdicts, [
            Silent(self.registers[fact[0]].name, fact[2], fact[1], tuple(fact[3:6]),
                   tuple(fact[6:9])) for fact in silent[:found].tolist()]

    def resets(self, gaps: Sequence[int], lengths: Sequence[int], kept: Sequence[str]
               ) -> tuple[int, int, WrongReset | None]:
        """Do the work over and over from power-up, with resets between.

        Parameters
        ----------
        gaps, lengths : sequence of int
            Clocks before each reset, and of it; 1 at least.
        kept : sequence of str
            Last names of the registers that a reset does not set.

        Returns
        -------
        int, int, WrongReset or None
            Clocks, steps of all motors, and what was wrong first.
        """
        set_by_reset = np.array([register.name.rpartition(".")[2] not in kept
                                 for register in self.registers], np.uint8)
        clock, which, steps = ctypes.c_int64(), ctypes.c_int32(), ctypes.c_int64()
        wrong = self._lib.faults_resets(
            self._handle, len(gaps), np.array(gaps, np.int64), np.array(lengths, np.int64),
            set_by_reset, clock, which, steps)
        found = None
        if wrong:
            axis = "xyz"[which.value] if wrong < 4 else ""
            found = WrongReset(clock.value, {
                1: f"the coil word of {axis} is illegal",
                2: f"the coil word of {axis} jumps",
                3: f"a reset moves {axis}",
                4: f"{self.registers[which.value].name} is not as from power-up after a reset",
            }[wrong])
        return clock.value, steps.value, found


def _declare(lib: ctypes.CDLL) -> ctypes.CDLL:
    def array(kind: type) -> type:
        return np.ctypeslib.ndpointer(kind, flags="C_CONTIGUOUS")

    i32, i64, u64, handle = ctypes.c_int32, ctypes.c_int64, ctypes.c_uint64, ctypes.c_void_p
    ports, bits, longs, flags = array(np.int32), array(np.uint64), array(np.int64), array(np.uint8)
    for name, result, arguments in [
        ("new", handle, [ctypes.POINTER(ctypes.c_char_p), i32, i32, ports, i32]),
        ("delete", None, [handle]),
        ("register", ctypes.c_char_p, [handle, i32, ctypes.POINTER(i64)]),
        ("rows", None, [handle, i64, bits, longs, flags, i32, i32]),
        ("work", i64, [handle, flags, i64]),
        ("flips", i64, [handle, u64, i64, i64, i64, i64, longs, longs, i64]),
        ("resets", i32, [handle, i64, longs, longs, flags, ctypes.POINTER(i64),
                         ctypes.POINTER(i32), ctypes.POINTER(i64)]),
    ]:
        function = getattr(lib, f"faults_{name}")
        function.restype, function.argtypes = result, arguments
    return lib
