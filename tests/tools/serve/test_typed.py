"""What is typed while a machine runs: its limit switches, and breaks."""

import asyncio
import os
from typing import Any

import pytest

from tools.console import UserError
from tools.serve import Switches, typed
from tools.serve.typed import Typed

ENDS = ("X+", "Y-", "Y+")


class Told:
    """What a machine that is served is told."""

    def __init__(self) -> None:
        self.limits, self.others, self.breaks = [], [], 0

    def set(self, *, limits: int | None = None, **others: int) -> None:
        self.limits += [] if limits is None else [limits]
        self.others += others.items()

    def send_break(self) -> None:
        self.breaks += 1


@pytest.fixture
def machine() -> Any:
    return Told()


def test_switches_are_the_bits_of_an_input(machine):
    switches = Switches(ENDS, machine)
    assert [switches.press("x", True), switches.press("Y+", True), switches.press("y+", True)] == [
        "X+", "Y+", "Y+"]
    assert switches.pressed == ["X+", "Y+"]
    switches.press("X+", False)
    assert machine.limits == [0b001, 0b101, 0b101, 0b100] and switches.pressed == ["Y+"]
    for name in ("y", "z", "", "x-"):
        with pytest.raises(UserError, match="there is no limit switch"):
            switches.press(name, True)


def test_a_switch_may_have_an_input_of_its_own(machine):
    switches = Switches(ENDS, machine, {"X2+": "second_limit"})
    assert [switches.press(name, on) for name, on in (
        ("x2", True), ("x", True), ("X2+", False))] == ["X2+", "X+", "X2+"]
    assert machine.limits == [1] and machine.others == [("second_limit", 1), ("second_limit", 0)]
    assert switches.pressed == ["X+"] and switches.ends == (*ENDS, "X2+")


def test_what_is_typed_is_done_and_said(machine, capsys):
    console = Typed(machine, Switches(ENDS, machine))
    for line in ("limit x on", "  LIMIT Y-  ON", "", "limit x off", "break"):
        console.execute(line)
    out, err = capsys.readouterr()
    assert out.splitlines() == ["limit switch X+ pressed", "limit switch Y- pressed",
                                "limit switch X+ released", "a break was sent"]
    assert machine.limits == [1, 3, 2] and machine.breaks == 1 and not err
    for line in ("limit", "limit x", "limit x maybe", "explode", "limit y on", "\x1b[A" * 200):
        console.execute(line)
    out, err = capsys.readouterr()
    assert not out and err.count("note: ") == err.count("\n") == 6
    assert "type limit x on, limit x off, or break" in err and "\x1b" not in err
    assert machine.limits == [1, 3, 2]


def test_other_inputs_are_switched_by_their_names(machine, capsys):
    console = Typed(machine, Switches((), machine), ("door", "motor_fault"))
    for line in ("door on", "MOTOR_FAULT on", "door off", "door", "door open", "limits on"):
        console.execute(line)
    out, err = capsys.readouterr()
    assert machine.others == [("door", 1), ("motor_fault", 1), ("door", 0)]
    assert out.splitlines() == ["door on", "motor_fault on", "door off"]
    assert err.count("type door or motor_fault and on or off, or break\n") == 3


def test_a_machine_without_switches_offers_none(machine, capsys):
    Typed(machine, Switches((), machine)).execute("limit x on")
    assert capsys.readouterr().err == "note: not understood: 'limit x on'; type break\n"


def test_lines_are_read_in_any_pieces_until_there_are_no_more(machine, monkeypatch):
    monkeypatch.setattr(typed, "POLL_S", 0.001)
    theirs, ours = os.pipe()

    async def session():
        listening = asyncio.create_task(Typed(machine, Switches(ENDS, machine)).listen(theirs))
        for piece in (b"limit x", b" on\nlimit", b" x off\nbreak\n", b"x" * 10**4, b"\nbreak"):
            os.write(ours, piece)
            await asyncio.sleep(0.01)
        os.close(ours)
        await asyncio.wait_for(listening, 60)

    asyncio.run(session())
    os.close(theirs)
    assert machine.limits == [1, 0] and machine.breaks == 1


def test_what_is_typed_for_another_program_is_left_to_it(machine, monkeypatch):
    monkeypatch.setattr(typed, "POLL_S", 0.001)
    monkeypatch.setattr(os, "tcgetpgrp", lambda file: os.getpgrp() + 1)
    theirs, ours = os.pipe()

    async def session():
        listening = asyncio.create_task(Typed(machine, Switches(ENDS, machine)).listen(theirs))
        os.write(ours, b"break\n")
        await asyncio.sleep(0.05)
        listening.cancel()

    asyncio.run(session())
    assert os.read(theirs, 100) == b"break\n" and not machine.breaks
    os.close(ours)
    os.close(theirs)
