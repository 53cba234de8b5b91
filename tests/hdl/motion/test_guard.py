# amaranth: UnusedElaboratable=no

"""The guard: there when it is wanted, with the same pins, and synthesis leaves it there."""

import json
import re
import subprocess

from amaranth.back import rtlil

from fresa.machines import Mill
from fresa.machines.mill import MillTiming
from fresa_boards.verilog import from_rtlil
from tb.yosys import YOSYS

TIMING = MillTiming(period=4, scan_bits=3)
TRAVEL = 6


def gateware(*, guard: bool) -> str:
    return rtlil.convert(Mill(timing=TIMING, z_travel=TRAVEL, guard=guard), name="mill",
                         emit_src=False)


class TestOption:
    def test_without_it_there_is_none(self):
        text = gateware(guard=False)
        assert "shadow" not in text and "keep" not in text
        assert text == rtlil.convert(Mill(timing=TIMING, z_travel=TRAVEL), name="mill",
                                     emit_src=False)

    def test_same_pins(self):
        tops = (re.search(r"^module \\mill\n.*?^end$", gateware(guard=guard), re.S | re.M)
                for guard in (False, True))
        plain, guarded = (re.findall(r"wire width \d+ (?:in|out)put .*", top[0])
                          for top in tops if top)
        assert len(plain) == 20
        assert plain == guarded


class TestSynthesis:
    @staticmethod
    def flip_flops(folder, text: str) -> int:
        (folder / "design.il").write_text(text)
        # Up to where enables are known, behind which registers are merged.
        script = ("read_rtlil design.il; synth -flatten -top mill -run begin:fine; "
                  "opt_merge -share_all; write_json design.json")
        subprocess.run([*YOSYS, "-q", "-p", script], cwd=folder, check=True)
        cells = json.loads((folder / "design.json").read_text())["modules"]["mill"]["cells"]
        return sum(len(cell["connections"]["Q"]) for cell in cells.values() if "ff" in cell["type"])

    def test_no_register_is_merged(self, tmp_path):
        plain, guarded = (self.flip_flops(tmp_path, gateware(guard=guard))
                          for guard in (False, True))
        display, comparison = TIMING.scan_bits + 2, 3 * 2 + 2
        assert guarded == 2 * (plain - display) + display + comparison

    def test_registers_are_marked_for_xst(self):
        text = from_rtlil(gateware(guard=True))
        mark = r'\(\* equivalent_register_removal = "no" \*\)\n'
        declared = r"  (?:output|reg) (?:signed )?(?:\[\d+:0\] )?(\S+)"
        found = {True: 0, False: 0}
        for name, body in re.findall(r"^module (\w+)\(.*?;(.*?)^endmodule", text, re.S | re.M):
            registers = re.findall(r"^  reg .*?(\S+) +=", body, re.M)
            marked = re.findall(rf"{mark}(?:  \(\*.*\n)*{declared}", body)
            marked = {register.rstrip(";") for register in marked}
            assert set(registers) & marked == (set(registers) if "shadow" in name else set()), name
            found["shadow" in name] += len(registers)
        assert found[False] == found[True] + 6  # three differences, fault, seen, the display's time
