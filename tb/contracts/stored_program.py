"""Contract of a program in the bitstream."""

from amaranth import Array, Mux

from fresa.protocol import LineEnd, StoredProgram

from .contract import Case, Component, Contract

__all__ = ["STORED_PROGRAM"]


def describe(c: Contract, dut: StoredProgram) -> None:
    """Every line is passed whole or broken, and every byte of the program in its order."""
    lines, items = dut.lines, dut.items
    given = items.valid & items.ready
    taken = lines.valid & lines.ready
    ends = items.p.end
    begins = c.past(0, init=1) | c.past(c.rst)

    # An answer follows a line, and lines stay until taken.
    c.assume(begins | ~c.past(lines.valid & ~lines.ready)
             | (lines.valid & (lines.payload.as_value() == c.past(lines.payload.as_value()))))
    waits = c.keep(1, name="line_is_not_answered")
    c.assume(~dut.answered | waits)
    with c.m.If(dut.answered):
        c.m.d.sync += waits.eq(0)
    with c.m.If(given & ends):
        c.m.d.sync += waits.eq(1)
    at = c.keep(range(len(dut.program) + 1), name="bytes_of_it")
    with c.m.If(given & dut.running):
        c.m.d.sync += at.eq(at + 1)
    with c.m.If(~dut.running):
        c.m.d.sync += at.eq(0)
    owes, broken = c.keep(1, name="line_is_not_done"), c.keep(1, name="line_is_broken")
    with c.m.If(dut.line_done):
        c.m.d.sync += owes.eq(0)
    with c.m.If(taken & lines.p.end):
        c.m.d.sync += owes.eq(1)
    state = c.state("program_state")
    with c.m.If(given & state("BREAK")):
        c.m.d.sync += broken.eq(1)
    with c.m.Elif(taken & lines.p.end):
        c.m.d.sync += broken.eq(0)
    with c.m.If(c.rst):
        c.m.d.sync += [waits.eq(0), at.eq(0), owes.eq(0), broken.eq(0)]

    byte = Array(dut.program)[at]
    ended = byte == ord("\n")
    c.implication("bytes-in-order", "A running program gives its bytes one after the other.",
                  when=dut.running & items.valid & (at < len(dut.program)),
                  then=(ends == ended)
                  & (items.p.byte == Mux(ended, LineEnd.GOOD.value, byte)))
    c.implication("no-byte-more", "It gives no more than these.",
                  when=dut.running & items.valid, then=at < len(dut.program))
    c.implication("lines-wait", "While it runs no line is taken.", when=dut.running,
                  then=~lines.ready)
    c.implication("one-at-a-time", "The next line begins when the last is answered.", when=waits,
                  then=~items.valid)
    c.implication("lines-pass", "Otherwise what comes is passed as it is, or ended.",
                  when=items.valid & ~dut.running & ~state("BREAK"),
                  then=lines.valid & (taken == given)
                  & (items.payload.as_value() == lines.payload.as_value()))
    begun = c.signal("begun")
    c.implication("broken", "Only a line that has begun is broken, and is said to be damaged.",
                  when=state("BREAK"), then=items.valid & ends & begun
                  & (items.p.byte == LineEnd.DAMAGED.value))
    c.implication("refused-ends-it", "A line that is refused ends the program.",
                  when=~begins & c.past(dut.running & dut.answered & dut.refused
                                        & ~c.signal("wanted")), then=~dut.running | dut.fault)
    c.implication("runs-if-asked", "It runs only if it is asked to.",
                  when=~begins & dut.running & ~c.past(dut.running),
                  then=c.past(c.signal("wanted")))
    c.implication("asked", "And that is by `run`.",
                  when=~begins & c.signal("wanted") & ~c.past(c.signal("wanted")),
                  then=c.past(dut.run))
    c.implication("busy-until-it-ends", "From when it is asked to it is busy until it has run.",
                  when=~begins & c.past(dut.busy) & ~c.past(dut.running & dut.answered),
                  then=dut.busy | dut.fault)
    c.implication("busy-only-so", "And only if it is asked to.",
                  when=~begins & dut.busy & ~c.past(dut.busy), then=dut.run)
    c.implication("done-is-one-line", "A line that is done was taken to its end, and is done once.",
                  when=dut.line_done, then=owes)
    c.implication("done-when-answered", "A line is done when it is answered.",
                  when=owes & dut.answered, then=dut.line_done)
    c.implication("done-when-dropped", "One that was broken is when the rest of it is taken.",
                  when=~begins & c.past(taken & lines.p.end & broken), then=dut.line_done)
    c.implication("stable-until-ready", "An item that is offered stays until it is taken.",
                  when=~begins & c.past(items.valid & ~items.ready),
                  then=items.valid & (items.payload.as_value()
                                      == c.past(items.payload.as_value())) | dut.fault)
    place, read = c.signal("place"), c.signal("read")
    c.invariant("place", "The place is that of the byte.",
                ~dut.running | state("FAULT") | (place == at) | (at == len(dut.program)),
                cover=at == 2, lemma=True)
    c.invariant("byte", "The byte is that of the place.",
                ~state("GIVE") | (c.signal("byte") == byte), cover=state("GIVE"), lemma=True)
    c.invariant("asked-once", "While it runs it is not asked to.",
                ~dut.running | ~c.signal("wanted"), cover=c.signal("wanted"), lemma=True)
    c.invariant("states", "It reads only while it runs, and waits only for an answer.",
                (state("ANSWER") == waits) & (~state("READ", "GIVE") | dut.running)
                & (~dut.running | state("READ", "GIVE", "ANSWER")) & (state("READ") | ~read)
                | state("FAULT"), cover=waits, lemma=True)
    c.invariant("left", "While it runs and goes on there is a byte left.",
                ~state("READ", "GIVE") | (at < len(dut.program)), cover=state("GIVE"), lemma=True)
    c.invariant("last", "Behind its last byte the last line is known.",
                ~dut.running | (at < len(dut.program)) | c.signal("last") | state("FAULT"),
                cover=at == len(dut.program), lemma=True)
    dropped = c.signal("dropped")
    c.invariant("drops", "It drops the rest of a line that was broken.",
                (c.signal("drops") == broken) & (~dropped | (owes & state("LINE") & ~broken))
                & (owes == (dropped | (waits & ~dut.running & ~broken)))
                | state("FAULT"), cover=dropped, lemma=True)
    c.leaves_unused_codes("program_state", fault=dut.fault, shows=~items.valid)


PROGRAM = {"program": b"G1\nX\n"}

STORED_PROGRAM = Component(make=StoredProgram, describe=describe,
                           cases=(Case(PROGRAM), Case(PROGRAM, upset=True)), depth=24)
