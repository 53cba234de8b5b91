"""Gowin's FPGAs with nextpnr's newer program for them, which Amaranth 0.5 does not call yet."""

from amaranth.vendor import GowinPlatform

__all__ = ["HimbaechelPlatform"]


class HimbaechelPlatform(GowinPlatform):
    """A board with a Gowin FPGA: Yosys, nextpnr-himbaechel and gowin_pack.

    The clock is constrained on the command line, as Amaranth writes no constraint of it for these
    programs. A clock that is too fast does not fail there: nextpnr takes addresses of a ROM of 36
    bits for too early, with a requirement of four times its own (nextpnr #1803), and the caller
    judges what it reports.
    """

    required_tools = ["yosys", "nextpnr-himbaechel-gowin", "gowin_pack"]
    command_templates = [
        """
        {{invoke_tool("yosys")}} {{quiet("-q")}} -l {{name}}.rpt {{name}}.ys
        """,
        """
        {{invoke_tool("nextpnr-himbaechel-gowin")}}
            {{quiet("--quiet")}}
            {{get_override("nextpnr_opts")|options}}
            --log {{name}}.tim
            --device {{platform.part}}
            --vopt family={{platform.chip}}
            --vopt cst={{name}}.cst
            --timing-allow-fail
            --freq {{"%g"|format(platform.default_clk_frequency / 1e6)}}
            --json {{name}}.syn.json
            --write {{name}}.pnr.json
        """,
        """
        {{invoke_tool("gowin_pack")}} -d {{platform.chip}} -o {{name}}.fs {{name}}.pnr.json
        """,
    ]

    @property
    def chip(self) -> str:
        """What the programs call the die: memory in its package makes no difference to them."""
        return self.family.replace("R-", "-")
