"""Fault injection on CXXRTL: bit upsets of flip-flops, and resets at any time.

The loops are in C++, below the design that CXXRTL has written.
"""

import ctypes
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from amaranth import Value
from numpy.typing import NDArray

from ..engines import EngineError
from ..engines.build import library
from .rows import Rows
from .target import Coils, FaultTarget
from .verdicts import Register, Silent, Verdict, WrongReset

__all__ = ["Trial"]

LOOPS = [Path(__file__).with_name(name)
         for name in ("pins.h", "trial.h", "upsets.cc", "resets.cc")]

ROOM = 8
"""Silent upsets that a call describes."""

MOTORS, ANSWERS = 3, 2
"""Most motors, and kinds of answers, for which the loops have room."""


class Trial:
    """A machine with faults injected, and work for it.

    Parameters
    ----------
    machine : Machine
        What it is.

    Raises
    ------
    EngineError
        If CXXRTL cannot run here, or knows no register by the name of a count.
    """

    def __init__(self, machine: FaultTarget) -> None:
        self.machine, design = machine, machine.design
        self._lib = _declare(library(design, more=LOOPS))
        self._inputs, self._outputs = list(design.inputs), list(design.outputs)
        (idle, level), output = machine.idle, self._outputs.index
        self._handle = self._lib.faults_new(output(idle), level, output(machine.fault),
                                            self._inputs.index("rst"))
        for motor in machine.motors:
            count = f"dut {motor.count}".encode()
            if isinstance(motor, Coils):
                words = np.array(motor.words, np.int32)
                added = self._lib.faults_coils(
                    self._handle, count, motor.first, output(motor.output),
                    output(motor.power) if motor.power else -1, motor.may_be_off, words,
                    len(words))
            else:
                names = "step", "direction", "enable"
                pads = [output(name) for name in names]
                bits = [motor.bit if len(Value.cast(design.outputs[name])) > 1 else 0
                        for name in names]
                added = self._lib.faults_pulses(
                    self._handle, count, np.array(pads, np.int32), np.array(bits, np.int32),
                    np.array(motor.times, np.int64))
            if not added:
                raise EngineError(f"CXXRTL knows no {motor.count}")
        if line := machine.line:
            self._lib.faults_line(self._handle, output("tx"), line.bit, line.answers)
            rows, answers, moves = self._question = line.question  # whose arrays the loops read
            self._lib.faults_question(
                self._handle, *self._given(rows), _filled(answers, ANSWERS), _filled(moves, MOTORS))
        self.registers = self._find_registers()
        self._rows: Rows | None = None

    def _find_registers(self) -> list[Register]:
        width, found = ctypes.c_int64(), []
        while name := self._lib.faults_register(self._handle, len(found), width):
            # RTLIL numbers names that clash, such as those of a submodule and a port.
            path = re.sub(r"\$\d+", "", name.decode().removeprefix("dut ").replace(" ", "."))
            found.append(Register(path, width.value))
        return found

    def close(self) -> None:
        """Let go of the machine."""
        if self._handle:
            self._lib.faults_delete(self._handle)
            self._handle = None

    def _given(self, rows: Rows) -> tuple:
        """Give rows as the loops take them."""
        level = {name: rows.levels[:, number] for number, name in enumerate(self._inputs)}
        zero = np.any([level[name] == value for name, value in self.machine.origin.items()], axis=0)
        marks = rows.waits | rows.begins << 1 | (level["rst"] != 0) << 2 | zero << 3
        return len(rows), rows.levels, rows.clocks, marks.astype(np.uint8)

    def load(self, rows: Rows) -> None:
        """Give the machine work."""
        self._rows = rows  # whose arrays the loops read
        self._lib.faults_rows(self._handle, *self._given(rows))

    def work(self) -> int:
        """Do the work undisturbed; give its clocks.

        Raises
        ------
        ValueError
            If the machine is never idle, or its counters are not what its motors have done.
        """
        compared = np.array([not register.name.startswith(self.machine.ignored)
                             for register in self.registers], np.uint8)
        clocks = self._lib.faults_work(self._handle, compared, self.machine.timeout)
        if clocks < 0:
            raise ValueError("The machine does not do this work, even undisturbed")
        return clocks

    def upsets(self, seed: int, first: int, count: int) -> tuple[NDArray[np.int64], list[Silent]]:
        """Upset a random bit in a random clock of the work, again and again.

        Parameters
        ----------
        seed, first : int
            Seed and number of the first upset, which determine its bit and clock.
        count : int
            Upsets.

        Returns
        -------
        array, list of Silent
            How often it came to each `Verdict`, one row a register; the first silent ones.

        Raises
        ------
        ValueError
            If no row of the work waits before the last: only there is it seen what became of one.
        """
        if self._rows is None or not self._rows.waits[:-1].any():
            raise ValueError("The work must wait for the machine, and go on after that")
        verdicts = np.zeros((len(self.registers), len(Verdict)), np.int64)
        silent = np.zeros((ROOM, 3 + 2 * MOTORS), np.int64)
        found = self._lib.faults_upsets(
            self._handle, seed, first, count, self.machine.window, self.machine.timeout, verdicts,
            silent, ROOM)
        motors = len(self.machine.motors)
        return verdicts, [
            Silent(self.registers[fact[0]].name, fact[2], fact[1], tuple(fact[3:3 + motors]),
                   tuple(fact[3 + MOTORS:][:motors])) for fact in silent[:found].tolist()]

    def resets(self, gaps: Sequence[int], lengths: Sequence[int], questions: Sequence[bool] = ()
               ) -> tuple[int, int, WrongReset | None]:
        """Do the work over and over from power-up, with resets between.

        Parameters
        ----------
        gaps, lengths : sequence of int
            Clocks before each reset, and of it; 1 at least.
        questions : sequence of bool
            Which of them are followed by the question; none by default.

        Returns
        -------
        int, int, WrongReset or None
            Clocks, steps of all motors, and what was wrong first.
        """
        set_by_reset = np.array([not f".{register.name}".endswith(
            tuple(f".{kept}" for kept in self.machine.kept)) for register in self.registers],
            np.uint8)
        clock, which, steps = ctypes.c_int64(), ctypes.c_int32(), ctypes.c_int64()
        wrong = self._lib.faults_resets(
            self._handle, len(gaps), np.array(gaps, np.int64), np.array(lengths, np.int64),
            _filled(questions, len(gaps)).astype(np.uint8), set_by_reset, self.machine.timeout,
            clock, which, steps)
        found = WrongReset(clock.value, self._describe(wrong, which.value)) if wrong else None
        return clock.value, steps.value, found

    def _describe(self, wrong: int, which: int) -> str:
        """Return what is wrong, as the loops number it, and with which motor or register."""
        if wrong == 6:
            return f"{self.registers[which].name} is not as from power-up after a reset"
        if wrong == 7:
            return "after a reset it does not obey the question, or does not answer it"
        name = self.machine.motors[which].name
        return {
            1: f"the coil word of {name} is illegal",
            2: f"the coil word of {name} jumps",
            3: f"a pulse of {name} is cut, or comes too soon",
            4: f"DIR or ENABLE of {name} changes too close to a pulse",
            5: f"a reset moves {name}",
        }[wrong]


def _filled(numbers: Sequence[int], length: int) -> NDArray[np.int64]:
    return np.array([*numbers, *[0] * (length - len(numbers))], np.int64)


def _declare(lib: ctypes.CDLL) -> ctypes.CDLL:
    def array(kind: type) -> type:
        return np.ctypeslib.ndpointer(kind, flags="C_CONTIGUOUS")

    text, flag, handle = ctypes.c_char_p, ctypes.c_bool, ctypes.c_void_p
    i32, i64, u64 = ctypes.c_int32, ctypes.c_int64, ctypes.c_uint64
    ints, bits, longs, flags = array(np.int32), array(np.uint64), array(np.int64), array(np.uint8)
    rows = [handle, i64, bits, longs, flags]
    for name, result, arguments in [
        ("new", handle, [i32, u64, i32, i32]),
        ("coils", flag, [handle, text, i64, i32, i32, flag, ints, i32]),
        ("pulses", flag, [handle, text, ints, ints, longs]),
        ("line", None, [handle, i32, i32, text]),
        ("delete", None, [handle]),
        ("register", text, [handle, i32, ctypes.POINTER(i64)]),
        ("rows", None, rows),
        ("question", None, [*rows, longs, longs]),
        ("work", i64, [handle, flags, i64]),
        ("upsets", i64, [handle, u64, i64, i64, i64, i64, longs, longs, i64]),
        ("resets", i32, [handle, i64, longs, longs, flags, flags, i64, ctypes.POINTER(i64),
                         ctypes.POINTER(i32), ctypes.POINTER(i64)]),
    ]:
        function = getattr(lib, f"faults_{name}")
        function.restype, function.argtypes = result, arguments
    return lib
