"""What the commands of the positioner read: a line's words and numbers, and what they order."""

from amaranth import Cat, Const, Mux

from fresa.protocol import positioner
from fresa.protocol.line import LineEnd
from fresa.protocol.positioner import CLOCKWISE, MOT, Answer, Command, Kind, PositionerCommands
from fresa.protocol.words import NUMBER_STARTS
from tb.contracts.contract import Bits, Contract

__all__ = ["watch_read"]


def watch_read(c: Contract, dut: PositionerCommands) -> None:
    """State that what is offered is what the line says, letter by letter and digit by digit."""
    state, kind, byte = c.state("commands_state"), c.signal("kind"), dut.items.p.byte
    taken, order = dut.items.valid & dut.items.ready, dut.orders.p
    answer, command = order.answer.as_value(), order.command.as_value()
    was_reset = c.past(c.rst)
    word, word_there = _word(c, dut, taken)
    number, number_there, wrong, number_says = _number(c, dut, taken, kind)

    first, later = state("COMMAND") & word_there, state("WORD") & word_there
    is_command = Cat(word[:len(Command)]).any()
    is_way = later & (kind == Kind.WAY) & Cat(word[CLOCKWISE:]).any()
    digit = state("DIGIT") & taken

    def follows(name: str, says: str, register: Bits, sources: list[tuple[Bits, Bits]]) -> None:
        """State what sets a register: the first that does; nothing else changes it."""
        value = c.past(register)
        for when, source in reversed(sources):
            value = Mux(c.past(when), c.past(source), value)
        c.invariant(name, says, register == Mux(was_reset, 0, value),
                    cover=Cat(when for when, _ in sources).any())

    which = Const(0, 4)
    for index, is_it in enumerate(word[:len(Command)]):
        which = Mux(is_it, index, which)
    c.implication("command-is-its-word", "The command is the first word of the line.",
                  when=c.past(first & is_command & ~c.rst),
                  then=(command == c.past(which)) & (answer == Answer.NONE.value))
    c.implication("command-stays", "No other word changes it.", when=~c.past(first),
                  then=command == Mux(was_reset, 0, c.past(command)))
    follows("motor-is-its-digit", "The motor is the digit behind MOT, less 1.", order.motor,
            [(digit, (byte - ord("1"))[:2])])
    follows("way-is-its-word", "C is clockwise, CC is not.", order.clockwise,
            [(is_way, word[CLOCKWISE])])
    good = number_there & ~wrong
    follows("point-is-its-number", "The point is the number that follows.", order.point,
            [(good & (kind == Kind.POINT), number[:3])])
    shifted = Cat(*dut.numbers[1:], number)
    follows("numbers-are-read", "The numbers are those that were read last, the last in its end.",
            Cat(dut.numbers), [(good & (kind != Kind.POINT), shifted)])

    # Why a line is refused
    bad_word = later & ~Mux(kind == Kind.MOTOR, word[MOT], Cat(word[CLOCKWISE:]).any())
    ended = state("SKIP") & taken & dut.items.p.end
    says = Mux(byte == LineEnd.LONG, Answer.LONG.value, Mux(
        byte == LineEnd.GOOD, answer, Answer.DAMAGED.value))
    stops = state("SEPARATE") & dut.items.valid & ~taken & ~(
        dut.items.p.end & (kind == Kind.END))
    no_digit = state("DIGIT") & dut.items.valid & ~taken
    follows("first-error-is-reason", "The first thing that is wrong in a line is its reason, or "
            "that it is long or damaged; a new line has none.", answer,
            [(first & ~is_command, Const(Answer.COMMAND.value, 4)),
             (bad_word | stops | no_digit, Const(Answer.ARGUMENT.value, 4)),
             (number_there & wrong, number_says), (ended, says),
             (dut.orders.valid & dut.orders.ready, Const(0, 4))])


def _word(c: Contract, dut: PositionerCommands, taken: Bits) -> tuple[list[Bits], Bits]:
    """Watch the word that is read; return which of the table it is, and whether it has ended."""
    state, byte = c.state("commands_state"), dut.items.p.byte
    there, table = c.part("words").words.valid, c.part("words").table
    longest, reads = max(map(len, table)), state("COMMAND", "WORD")
    belongs = ~dut.items.p.end & ~Cat(byte == stop for stop in b" " + NUMBER_STARTS).any()
    count = c.keep(range(longest + 2), name="letters")
    letters = [c.keep(8, name=f"letter_{place}") for place in range(longest)]
    with c.m.If(c.rst | there):
        c.m.d.sync += count.eq(0)
    with c.m.Elif(reads & taken & (count <= longest)):
        c.m.d.sync += count.eq(count + 1)
        for place, at in enumerate(letters):
            with c.m.If(count == place):
                c.m.d.sync += at.eq(byte)
    begun = [(count <= len(word)) & Cat((count <= place) | (letters[place] == expected)
                                        for place, expected in enumerate(word)).all()
             for word in table]
    looks = reads & dut.items.valid & ~there
    c.implication("word-bytes-taken", "Of a word all is taken that belongs to it, and nothing "
                  "else.",
                  when=looks, then=dut.items.ready == belongs)
    c.invariant("word-ends", "It has ended with the clock after something else was seen.",
                there == c.past(looks & ~belongs & ~c.rst), cover=there)
    c.invariant("letters-matched", "It knows which words begin with the letters that were read.",
                (c.signal("words.alive") == Cat(begun)) & (c.signal("words.place") == count)
                & (count <= longest + 1), cover=count == longest)
    return [begins & (count == len(word))
            for word, begins in zip(table, begun, strict=True)], there


def _number(c: Contract, dut: PositionerCommands, taken: Bits, kind: Bits
            ) -> tuple[Bits, Bits, Bits, Bits]:
    """Watch the number that is read; return it, whether it has ended, is wrong, and why."""
    byte, end = dut.items.p.byte, dut.items.p.end
    there, reads = c.part("number").numbers.valid, c.state("commands_state")("NUMBER")
    begun, some = c.keep(1, name="has_begun"), c.keep(1, name="has_digits")
    minus, large = c.keep(1, name="is_minus"), c.keep(1, name="too_large")
    magnitude = c.keep(33, name="magnitude")
    is_digit = ~end & (byte >= ord("0")) & (byte <= ord("9"))
    belongs = is_digit | ~end & ~begun & ((byte == ord("+")) | (byte == ord("-")))
    grown, limit = magnitude * 10 + (byte - ord("0"))[:4], 2**32 - 1 + minus
    with c.m.If(c.rst | there):
        c.m.d.sync += [begun.eq(0), some.eq(0), minus.eq(0), large.eq(0), magnitude.eq(0)]
    with c.m.Elif(reads & taken):
        c.m.d.sync += begun.eq(1)
        with c.m.If(is_digit):
            c.m.d.sync += [some.eq(1), magnitude.eq(grown), large.eq(large | (grown > limit))]
        with c.m.Else():
            c.m.d.sync += minus.eq(byte == ord("-"))
    looks = reads & dut.items.valid & ~there
    c.implication("number-bytes-taken",
                  "Of a number all is taken that belongs to it, and nothing else.",
                  when=looks, then=dut.items.ready == belongs)
    c.invariant("number-ends", "It has ended with the clock after something else was seen.",
                there == c.past(looks & ~belongs & ~c.rst), cover=there)
    exact = Mux(minus, -magnitude, magnitude)
    known = {name: c.signal(f"number.{name}") for name in (
        "digits", "overflow", "value", "begun", "negative")}
    c.invariant("digits-held", "What was read so far is known, as long as it fits.",
                (known["digits"] == some) & (known["overflow"] == large) & (known["begun"] == begun)
                & (known["negative"] == minus) & (~some | begun) & (~minus | begun)
                & (~large | some) & (some | (magnitude == 0))
                & (large | (known["value"] == exact) & (magnitude <= limit)),
                cover=magnitude == 8)
    most = Mux(kind == Kind.POINT, positioner.POINTS, Mux(kind == Kind.FLAG, 1, dut.top_speed))
    none = (magnitude == 0) & (kind != Kind.FLAG)
    out = Mux(kind == Kind.NUMBER, minus & (magnitude > 2**31),
              minus & (magnitude != 0) | none | (magnitude > most))
    says = Mux(some, Answer.RANGE.value, Answer.ARGUMENT.value)
    return exact[:32], reads & there, ~some | large | out, says[:4]
