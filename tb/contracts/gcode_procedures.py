# amaranth: UnusedElaboratable=no

"""Procedures of the planner of G-code, for its contract: what is under way, and which row of it.

What is known of each row is for lemmas alone. A planner with few rows has procedures in the order
of the real ones, with rows of all kinds.
"""

from collections.abc import Mapping
from typing import Any
from unittest.mock import patch

from amaranth import Cat, Module, Mux, Value
from amaranth.lib import data, memory

from fresa.motion import gcode_planner
from fresa.motion.gcode_planner import GCodePlanner, HomingRequest
from fresa.protocol import GCodeActionKind as Kind

from .contract import Bits, Contract, State, Unknown

__all__ = ["ACTION", "ADDRESSES", "BEGIN", "CONFIGURE", "HOME", "NONE", "REPORT", "PlannerControl",
           "Procedures"]

NONE, ACTION, CONFIGURE, BEGIN, REPORT, HOME = range(6)
"""What is asked for: an action last."""

ROWS = 82
"""Most rows of a procedure."""

FEW_ROWS = 5
"""Most of one with few."""

ADDRESSES = 20
"""Of the words of a block, the last of which commits it."""


class Procedures:
    """What is under way, by what was asked for at rest.

    Attributes
    ----------
    under : Value
        What it is, one of six.
    doing, home : Value
        Which action, and which request of a homing cycle.
    begins : Value
        It begins in the next clock.
    row : View
        What is known of the row that is carried out, by the place.
    """

    def __init__(self, c: Contract, dut: "PlannerControl", state: State) -> None:
        actions, idle = dut.actions, state("IDLE")
        self.under, asked = (c.keep(3, name=name) for name in ("under", "asked"))
        self.doing = c.keep(4, name="doing")
        self.home = c.keep(2, name="home")
        kind = actions.p.kind.as_value()
        homing = Value.cast(dut.homing.kind)
        c.m.d.sync += asked.eq(Mux(idle & ~c.rst, Mux(
            dut.configure, CONFIGURE, Mux(dut.begin, BEGIN, Mux(dut.report, REPORT, Mux(
                homing != 0, HOME, Mux(actions.valid & dut.room, ACTION, NONE))))), NONE))
        self.begins = idle & (asked != NONE)
        before = c.past(kind), c.past(homing)
        with c.m.If(self.begins):
            c.m.d.sync += [self.under.eq(asked), self.doing.eq(before[0]), self.home.eq(before[1])]
        with c.m.If(state("TELL")):
            c.m.d.sync += self.under.eq(NONE)
        with c.m.If(c.rst):
            c.m.d.sync += self.under.eq(NONE)
        self.asked = asked

        # Of each row: the procedure, and what is done before it.
        known = _known(dut)
        layout = data.StructLayout({
            "row": gcode_planner.ROW.size, "procedure": 6, "some": 1, "index": 7, "commits": 2,
            "headed": 1, "positions": 2})
        c.m.submodules.known = table = memory.Memory(shape=layout, depth=len(known), init=known)
        port = table.read_port(domain="comb")
        place, row = c.signal("place"), data.View(gcode_planner.ROW, c.signal("row"))
        inside = state("ADDRESS", "READ", "WORD", "KEEP", "ACT", "DECIDE", "COMPUTE", "END",
                       "BEYOND")
        c.m.d.comb += port.addr.eq(place - inside)
        self.row: Any = port.data
        self.present: Any = row
        self.inside = inside
        fetched = Value.cast(c.part("rows").read_ports[0].data)
        procedure = self.procedure = Value.cast(c.signal("procedure"))
        c.invariant("rows", "A row is that of its place, of the procedure that is under way.", Cat(
            ~state("LOOK-UP", "IDLE", "TELL") | (place == 0), place - inside < len(known),
            ~state("ROW") | (fetched == self.row.row),
            ~inside | (Value.cast(row) == self.row.row) & (place != 0),
            ~(inside | state("FETCH", "ROW")) | self.row.some
            & (self.row.procedure == procedure),
            ~state("END") | row.last | (row.do == gcode_planner._Do.SKIP)).all(),
            cover=state("COMPUTE"), lemma=True)
        do = gcode_planner._Do
        runs, decides = row.do.as_value()[3:] == 0b10, (row.do == do.SKIP) | (row.do == do.GUARD)
        c.invariant("states", "Each state is one of its rows.", Cat(
            ~state("READ", "WORD") | ~runs, ~state("COMPUTE") | runs,
            ~state("KEEP") | (row.do == do.KEEP), ~state("ACT") | ~(runs | (row.do == do.KEEP)),
            ~state("DECIDE") | decides, ~state("BEYOND") | (row.do == do.GUARD)).all(),
            cover=state("DECIDE"), lemma=True)
        slots = gcode_planner._SLOTS
        of_action = {
            **{each: ["LINE"] for each in (Kind.RAPID, Kind.LINE, Kind.PROBE)},
            **{each: [each.name] for each in (Kind.ARC, Kind.CHECK_ARC, Kind.DWELL, Kind.JOG,
                                              Kind.CHECK_JOG)},
            **{each: ["EVENT", "STOPPED_EVENT"] for each in (Kind.SPINDLE, Kind.COOLANT)},
            **{each: ["STOPPED_EVENT"] for each in (Kind.PAUSE, Kind.END)},
            Kind.OFFSETS: ["ORIGIN"]}
        of_home = {HomingRequest.MOVE: ["HOME_X", "HOME_Y", "HOME_Z"],
                   HomingRequest.PLACE: ["PLACE_X", "PLACE_Y", "PLACE_Z"],
                   HomingRequest.WAIT: ["HOME_WAIT"]}

        def is_one(names: list[str]) -> Bits:
            return Cat(procedure == slots[name] for name in names).any()

        c.invariant("procedures", "The procedure is one of what is under way.", Cat(
            idle == (self.under == NONE), self.under <= HOME,
            (self.asked == NONE) | idle | state("LOOK-UP"),
            *((self.under != number) | is_one([name]) for number, name in (
                (CONFIGURE, "CONFIGURE"), (BEGIN, "BEGIN"), (REPORT, "REPORT"))),
            (self.under != ACTION) | Cat(
                (self.doing == each.value) & is_one(names) for each, names in of_action.items()
            ).any(),
            (self.under != HOME) | Cat(
                (self.home == each.value) & is_one(names) for each, names in of_home.items()
            ).any()).all(), cover=self.under == HOME, lemma=True)

    def does(self, *kinds: Kind) -> Bits:
        """Return whether one of some actions is under way."""
        return (self.under == ACTION) & Cat(self.doing == each.value for each in kinds).any()


def _known(dut: "PlannerControl") -> list[Mapping[str, int]]:
    """Return for each row what is known of it."""
    known: list[Mapping[str, int]] = []
    do = gcode_planner._Do
    for name, rows in dut.procedures.items():
        slot = gcode_planner._SLOTS[name]
        first = slot * dut.slot
        known += [{}] * (first - len(known))
        commits = headed = positions = 0
        for index in range(len(rows)):
            row = dut.rows[first + index]
            known.append({
                "row": gcode_planner.ROW.const(row).as_value().value, "procedure": slot,
                "some": 1, "index": index, "commits": commits, "headed": headed,
                "positions": positions})
            if row["do"] in (do.STORE, do.PUT, do.HEADER):
                commits += row["destination"] == ADDRESSES - 1
                headed = (headed or row["destination"] == 0) and row["destination"] != ADDRESSES - 1
            positions += row["do"] == do.POSITION
    return [{key: int(value) for key, value in each.items()} for each in known]


_Row, _Do = gcode_planner._Row, gcode_planner._Do
_STORE = _Row(_Do.STORE, 3, ADDRESSES - 1)
_BLOCK = _Row(_Do.HEADER, 0, 0), _STORE
_POSITIONS = tuple(_Row(_Do.POSITION, 3 + axis, axis) for axis in range(3))


def _keep(name: str) -> Any:
    return _Row(_Do.KEEP, 2, gcode_planner._Kept[name].value)


FEW = {
    "BEGIN": (*_POSITIONS, *_BLOCK), "REPORT": (_Row(_Do.RUN_WORK, 3), _keep("X")),
    "LINE": (_Row(_Do.FEED, 47, 9), _Row(_Do.GUARD, 5), *_BLOCK),
    "DWELL": (_Row(_Do.HEADER, 0, 0), _Row(_Do.PUT, 6, ADDRESSES - 1)),
    "EVENT": _BLOCK, "STOPPED_EVENT": _BLOCK,
    "ORIGIN": (_Row(_Do.LOAD, 60, 4), _keep("ORIGIN_X")),
    "CHECK_ARC": (_Row(_Do.CENTRE_U, 0, 4), _Row(_Do.RUN_RADIUS, 3), _keep("VERDICT")),
    "ARC": (*_BLOCK, _BLOCK[0], _Row(*_STORE)),  # its last row is another
    "JOG": (_Row(_Do.STORE, 3, 1), _Row(_Do.STORE, 3, 3), _keep("PROGRAMMED"), *_BLOCK),
    "CHECK_JOG": (_Row(_Do.RUN_SOFT, 1), _keep("VERDICT")),
    "CONFIGURE": (_Row(_Do.SETTING, 42, 6), _keep("STEPS_X")),
    **{f"HOME_{axis}": (_Row(_Do.SKIP, 4), *_BLOCK) for axis in "XYZ"},
    **{f"PLACE_{axis}": (_Row(_Do.INPUT, 8, 9, "number"), _keep("SWITCH")) for axis in "XY"},
    "PLACE_Z": (_Row(_Do.SETTING, 42 | gcode_planner._NEAR | gcode_planner._SLOW, 9),
                _keep("SWITCH")),
    "HOME_WAIT": _BLOCK}
"""Procedures of a few rows of all kinds."""


class PlannerControl(GCodePlanner):
    """Without formulas, and with procedures of a few rows, or with all of them."""

    def __init__(self, *, few: bool = False, **parameters) -> None:
        super().__init__(**parameters)
        self.procedures = FEW if few else gcode_planner._PROCEDURES
        self.slot = 2 if few else gcode_planner.SLOT
        self.most_rows = FEW_ROWS if few else ROWS
        self.rows = []

    def elaborate(self, platform) -> Module:
        real = gcode_planner.gcode_formulas
        with (patch.dict(vars(gcode_planner), {
                "_PROCEDURES": self.procedures, "SLOT": self.slot,
                "gcode_formulas": lambda *values, **parameters: Unknown(
                    real(*values, **parameters))})):
            self.rows = gcode_planner._rows()
            return super().elaborate(platform)
