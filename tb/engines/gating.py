"""Conditional evaluation of a design that Yosys' `write_cxxrtl` has written.

Most of a machine stands still in most clocks: a planner that has nothing to plan, a line on which
nothing comes. So its logic, a list of statements in the order of their data flow, is cut into
segments, each of statements of one module that have data flow in common or read much the same, and
a segment is evaluated only when something that it reads has changed: an input, a register, a
memory, or a value of a segment before. Of what it compares with numbers only the outcome counts,
and of what it reads some bits these: most of what reads a counter waits for a number, and what
reads a state for a state. What a segment gives depends on nothing else, so all registers and
outputs are in every clock as if all of it were evaluated.

The idea is that of Beamer and Donofrio, "Efficiently exploiting low activity factors to accelerate
RTL simulation", DAC 2020.
"""

import math
import operator
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from itertools import groupby

__all__ = ["gated", "statements"]

#: Names of values and registers, of locals, and of memories.
NAME = re.compile(r"\b(?:memory_)?[pi]_\w+")

#: What is read of a value or register: some of its bits, or the outcome of a comparison.
BITS = r"[pi]_\w+(?:\.curr)?"
SLICE = r"\.slice<[\d,]+>\(\)\.val\(\)"
PART = re.compile(
    rf"\b(?:eq|ne|lt|le|gt|ge)_uu<1>\({BITS}(?:{SLICE})?, value<\d+>\{{[^}}]*\}}\)"
    rf"|\b(?:logic_not|reduce_bool|reduce_or)<1>\({BITS}(?:{SLICE})?\)|\b{BITS}{SLICE}")
WHOLE = "@"

#: Comparisons of all bits, and those with 0.
COMPARED = re.compile(r"(eq|ne|lt|le|gt|ge)_uu<1>\(@, value<\d+>\{(?:0x)?([0-9a-f]+)u\}\)")
TRUE = re.compile(r"(?:logic_not|reduce_bool|reduce_or)<1>\(@\)")

#: Up to so many parts of a value are compared when it has changed; if more are read, all that reads
#: one of them is evaluated.
COMPARISONS = 12

#: But so many or more are looked up, if all are comparisons of a value of at most so many bits.
TABLED = 4
TABLE_BITS = 6

#: What is called seldom is not made a part of what calls it.
APART = "__attribute__((noinline))"

#: Bits of a word of flags.
WORD = 64

#: Up to so many statements that read a value are evaluated together with it.
FEW = 3

#: What part of all that two segments of a module read both must read to be one, where what many
#: read counts little. With less, much is evaluated that has not changed; with more, calls take
#: longer than what they evaluate.
ALIKE = 0.05


@dataclass(eq=False)
class Statement:
    """A statement of the logic, or some that belong together.

    Attributes
    ----------
    text : str
        Its lines.
    values, registers, memories : set of str
        What it changes: values at once, registers and memories at the end of the clock.
    kept : set of str
        Registers that it changes only under a condition.
    reads : set of str
        What it needs, by name.
    parts : dict
        What it needs of each name: parts, as expressions of ``@``.
    module : tuple of str, optional
        Path of the module that it is from.
    """

    text: str
    values: set[str] = field(default_factory=set)
    registers: set[str] = field(default_factory=set)
    memories: set[str] = field(default_factory=set)
    kept: set[str] = field(default_factory=set)
    reads: set[str] = field(default_factory=set)
    parts: dict[str, set[str]] = field(default_factory=dict)
    module: tuple[str, ...] | None = None


def statements(lines: str) -> list[Statement]:
    """Return the statements of the logic, in their order.

    Parameters
    ----------
    lines : str
        The body of ``eval``, without declarations of locals.
    """
    texts: list[str] = []
    depth, shared = 0, None
    for line in lines.splitlines(keepends=True):
        if line.lstrip().startswith("//"):
            continue
        if depth or (shared and re.search(rf"\b{shared}\b", line)):
            texts[-1] += line
        else:
            texts.append(line)
            begun = re.match(r"\tauto (tmp_\d+) = ", line)
            shared = begun[1] if begun else None
        depth += line.count("{") - line.count("}")
    return [_statement(text) for text in texts]


def _statement(text: str) -> Statement:
    made = Statement(text)
    rest = text
    for left in re.findall(r"^\s*((?:p_|i_)[^=\n]*?) = ", text, re.M):
        names = NAME.findall(left)
        (made.registers if ".next" in left else made.values).update(names)
        rest = rest.replace(f"{left} = ", " ", 1)
    if re.search(r"^\t\tif \((?!tmp_)", text, re.M):
        made.kept.update(made.registers)
    made.memories.update(re.findall(r"\b(memory_\w+)\.update\(", text))
    if ".next" in rest:
        raise ValueError(f"the next value of a register is read: {text}")

    def part(found: re.Match[str]) -> str:
        name = NAME.findall(found[0])[0]
        made.parts.setdefault(name, set()).add(re.sub(rf"\b{BITS}", WHOLE, found[0], count=1))
        return " "

    made.parts.update((name, {WHOLE}) for name in NAME.findall(PART.sub(part, rest)))
    made.reads.update(made.parts)
    made.module = _module(next(iter(sorted(made.values | made.registers | made.memories)), ""))
    return made


def _module(name: str) -> tuple[str, ...] | None:
    """Return the path of the module that a name is from; None if the name does not say it."""
    if re.match(r"i_(?!flatten)", name):
        return None
    parts = re.sub(r"^(?:memory_)?(?:p|i_flatten|i)_", "", name).split("_2e_")
    return tuple(re.sub(r"^_?5c_", "", part) for part in parts[:-1])


@dataclass(eq=False)
class Segment:
    """Statements that are evaluated together, or not at all.

    Attributes
    ----------
    statements : list of Statement
        Those, in an order in which they can be evaluated.
    number : int
        The place of its flag.
    runs : bool
        It has registers that are likely to change in every clock.
    """

    statements: list[Statement]
    number: int = 0
    runs: bool = False

    @property
    def flag(self) -> tuple[int, int]:
        """The word of its flag, and the bit there."""
        return self.number // WORD, 1 << self.number % WORD

    def all(self, what: str) -> set[str]:
        """Return what its statements have under a name."""
        return set().union(*(getattr(each, what) for each in self.statements))

    def parts(self, name: str) -> set[str]:
        """Return what parts of a name it reads."""
        parts = set().union(*(each.parts.get(name, set()) for each in self.statements))
        return {WHOLE} if WHOLE in parts else parts

    @cached_property
    def needs(self) -> set[tuple[str, str]]:
        """What it reads that is not its own, by name and part; not to be changed after."""
        return {(name, part) for name in self.all("reads") - self.all("values")
                for part in self.parts(name)}


def _joined(segments: Iterable[Segment]) -> Segment:
    """Make segments one."""
    return Segment([one for each in segments for one in each.statements])


def _place(every: Sequence[Statement]) -> None:
    """Give statements whose names say no module that of what reads them."""
    wanted: dict[str, Counter] = {}
    for each in reversed(every):
        if each.module is None:
            votes = sum((wanted.get(name, Counter()) for name in sorted(each.values)), Counter())
            each.module = votes.most_common(1)[0][0] if votes else ()
        for name in each.reads:
            wanted.setdefault(name, Counter())[each.module] += 1


def _segments(every: Sequence[Statement]) -> list[Segment]:
    """Order statements so that those of a module come together as far as their data flow lets.

    Of the modules whose statements have what they need it takes the one of which most can follow
    each other, again and again. Statements that only registers wait for come as late as a segment
    of their module does; those that write memories are last, in segments of their own.
    """
    _place(every)
    flow = [each for each in every if each.values]
    writers: dict[str, list[int]] = {}
    needs: list[set[int]] = []
    for number, each in enumerate(flow):
        before = {other for name in each.reads | each.values for other in writers.get(name, ())}
        needs.append(before)
        for name in each.values:
            writers.setdefault(name, []).append(number)
    users: dict[int, list[int]] = {}
    for number, before in enumerate(needs):
        for other in before:
            users.setdefault(other, []).append(number)
    left = [len(before) for before in needs]
    ready: dict[tuple[str, ...], list[int]] = {}
    for number, count in enumerate(left):
        if not count:
            ready.setdefault(flow[number].module or (), []).append(number)

    def closure(module: tuple[str, ...]) -> list[int]:
        found, missing = list(ready[module]), dict[int, int]()
        for number in found:
            for user in users.get(number, ()):
                missing[user] = missing.get(user, left[user]) - 1
                if not missing[user] and flow[user].module == module:
                    found.append(user)
        return found

    segments: list[Segment] = []
    while ready:
        chosen = max((closure(module) for module in ready), key=len)
        module = flow[chosen[0]].module or ()
        del ready[module]
        segments.append(Segment([flow[number] for number in chosen]))
        for number in chosen:
            for user in users.get(number, ()):
                left[user] -= 1
                if not left[user] and flow[user].module != module:
                    ready.setdefault(flow[user].module or (), []).append(user)
    readers: Counter[str | tuple[str, str]] = Counter()
    for each in every:
        readers.update(each.reads)
        readers.update((name, part) for name, parts in each.parts.items() for part in parts)
    found = [part for each in segments + _ends(every, segments) for part in _cut(each, readers)]
    apart = [each for each in found if not each.runs]
    if running := [one for each in found if each.runs for one in each.statements]:
        apart.append(Segment(running, runs=True))
    return apart


def _ends(every: Sequence[Statement], segments: Sequence[Segment]) -> list[Segment]:
    """Put statements that change registers into segments, or give further ones of them."""
    written = {name: place for place, segment in enumerate(segments)
               for name in segment.all("values")}
    last = {segment.statements[0].module: place for place, segment in enumerate(segments)}
    rest = []
    for each in every:
        if each.values:
            continue
        place = last.get(each.module, -1)
        if segments and not each.memories and all(
                written.get(name, -1) <= place for name in each.reads):
            segments[place].statements.append(each)
        else:
            rest.append(each)
    rest.sort(key=lambda each: (bool(each.memories), each.module or ()))
    return [Segment(list(group)) for _, group in groupby(
        rest, key=lambda each: (bool(each.memories), each.module))]


def _cut(segment: Segment, readers: Counter) -> list[Segment]:
    """Cut a segment into what has much data flow in common, or reads much the same.

    Parameters
    ----------
    segment : Segment
        The segment.
    readers : Counter
        How many statements read a name, and a part of it.
    """
    if segment.all("memories"):
        return [segment]
    pieces: list[Segment] = []
    for each in segment.statements:
        near = each.values | {name for name in each.reads if readers[name] <= FEW}
        joined = [piece for piece in pieces if piece.all("values") & near]
        pieces = [piece for piece in pieces if piece not in joined]
        pieces.append(_joined([*joined, Segment([each])]))

    def weight(needs: set[tuple[str, str]]) -> float:
        return math.fsum(1 / readers[need] for need in needs)  # whatever their order

    def likeness(other: Segment, piece: Segment) -> float:
        every = weight(other.needs | piece.needs)
        return weight(other.needs & piece.needs) / every if every else 1

    found: list[Segment] = []
    for piece in _ordered(pieces):
        piece.runs = _runs(piece, readers)
        like = [other for other in found if not (piece.runs or other.runs)]
        alike = max(like, key=lambda other: likeness(other, piece), default=piece)
        if alike is not piece and likeness(alike, piece) >= ALIKE:
            later = found[found.index(alike) + 1:]
            # One of both moves to the other, if no other needs it or is needed between.
            if not any(other.all("values") & piece.all("reads") for other in later):
                found[found.index(alike)] = _joined([alike, piece])
                continue
            if not any(other.all("reads") & alike.all("values") for other in later):
                found.remove(alike)
                piece = _joined([alike, piece])
        found.append(piece)
    places = {each: place for place, each in enumerate(segment.statements)}
    for each in found:
        each.statements.sort(key=places.__getitem__)
    return found


def _ordered(pieces: list[Segment]) -> list[Segment]:
    """Order segments by their data flow; those that need each other become one."""
    while True:
        writer = {name: each for each in pieces for name in each.all("values")}
        flow = {each: [writer[name] for name in sorted(each.all("reads"))
                       if writer.get(name, each) is not each] for each in pieces}
        try:
            return list(TopologicalSorter(flow).static_order())
        except CycleError as error:
            circle = [each for each in pieces if each in error.args[1]]
            pieces = [each for each in pieces if each not in circle] + [_joined(circle)]


def _runs(segment: Segment, readers: Counter) -> bool:
    """Tell whether a segment is likely to be a counter that nothing stops.

    That is a register with a sum or a difference, and one other name, the reset of most.
    """
    registers = segment.all("registers")
    return (len(registers) == 1
            and len(segment.all("reads") - segment.all("values") - registers) <= 1
            and any(re.search(r"\b(?:add|sub)_", each.text) for each in segment.statements)
            and all(readers[name] == sum(name in each.reads for each in segment.statements)
                    for name in segment.all("values")))


class _Writer:
    """Writes segments in C++, with a flag for each that something it reads has changed."""

    def __init__(self, module: str, edge: str, lines: str, bits: Mapping[str, int]) -> None:
        # Some locals hide a member of the same name, which is for waveforms.
        hiding = set(re.findall(r"^\tvalue<\d+> p_(\w+);\n", lines, re.M))
        lines = re.sub(r"\bp_(\w+)", lambda found: (
            f"i_{found[1]}" if found[1] in hiding else found[0]), lines)
        self._module, self._edge = module, edge
        self._bits = {**bits, **{f"i_{name}": bits[f"p_{name}"] for name in hiding}}
        self._locals = {name: kind
                        for kind, name in re.findall(r"^\t(value<\d+>) (\w+);\n", lines, re.M)}
        found = _segments(statements(re.sub(
            r"^\t(?:value<\d+> \w+;|bool \w+ = [^\n]*;)\n", "", lines, flags=re.M)))
        self.stores = [each for each in found if each.all("memories")]
        self.flow = [each for each in found if each not in self.stores]
        # What writes memories has flags in words of its own, and runs once a clock.
        begin = -(-len(self.flow) // WORD) * WORD
        for first, of in ((0, self.flow), (begin, self.stores)):
            for number, each in enumerate(of, first):
                each.number = number
        self.words = -(-(begin + len(self.stores)) // WORD) or 1
        # Registers that are taken together, of each segment.
        self.taken = {each: [names] if each.runs else [[name] for name in names] for each in found
                      if (names := sorted(each.all("registers")))}
        self.groups = {name: number for number, group in enumerate(
            group for groups in self.taken.values() for group in groups) for name in group}
        self._readers: dict[str, list[Segment]] = {}
        self._homes: dict[str, set[int]] = {}
        for each in found:
            for name in each.all("reads") | each.all("memories"):
                self._readers.setdefault(name, []).append(each)
            for name in each.all("reads") | each.all("values"):
                self._homes.setdefault(name, set()).add(each.number)

    @property
    def all(self) -> list[Segment]:
        """All segments, in the order in which they are evaluated."""
        return self.flow + self.stores

    @property
    def shared(self) -> list[str]:
        """Declarations of locals of `eval` that several segments have in common."""
        return [f"{kind} {name};" for name, kind in self._locals.items()
                if len(self._homes.get(name, ())) > 1]

    def wake(self, every: Iterable[Segment]) -> str:
        """Raise the flags of segments."""
        masks = [0] * self.words
        for each in every:
            word, bit = each.flag
            masks[word] |= bit
        return " ".join(f"dirty[{word}] |= {mask:#x}ull;"
                        for word, mask in enumerate(masks) if mask)

    def readers(self, name: str, but: Segment | None = None) -> list[Segment]:
        """Return the segments that read a name, but for one."""
        return [each for each in self._readers.get(name, ()) if each is not but]

    def changed(self, name: str, before: str, after: str, but: Segment | None = None) -> str:
        """Raise the flags of the segments that read what has changed of a name, but for one."""
        parts: dict[str, list[Segment]] = {}
        for each in self.readers(name, but):
            for part in each.parts(name):
                parts.setdefault(part, []).append(each)
        always = self.wake(parts.pop(WHOLE, ()))
        bits = self._bits[name]
        if len(parts) >= TABLED and bits <= TABLE_BITS and all(
                COMPARED.fullmatch(part) or TRUE.fullmatch(part) for part in parts):
            return always + self._table(parts, before, after, 1 << bits)
        if len(parts) > COMPARISONS or bits == 1:
            return self.wake(self.readers(name, but))
        return always + " ".join(
            f"if ({part.replace(WHOLE, before)} != {part.replace(WHOLE, after)}) "
            f"{{ {self.wake(every)} }}" for part, every in sorted(parts.items()))

    def _table(self, parts: dict[str, list[Segment]], before: str, after: str, size: int) -> str:
        """Look up the flags to raise: of comparisons with the rarer outcome, before or after."""
        tables = [[0] * size for _ in range(self.words)]
        for part, every in parts.items():
            found = COMPARED.fullmatch(part)
            compare, number = (getattr(operator, found[1]), int(found[2], 16)) if found else (
                operator.eq, 0)
            outcomes = [compare(value, number) for value in range(size)]
            rare = sum(outcomes) <= size // 2
            for each in every:
                word, bit = each.flag
                for value, outcome in enumerate(outcomes):
                    tables[word][value] |= bit * (outcome == rare)
        return " ".join(
            f"{{ static constexpr uint64_t flags[] = {{{', '.join(map(hex, table))}}}; "
            f"dirty[{word}] |= flags[{before}.data[0]] | flags[{after}.data[0]]; }}"
            for word, table in enumerate(tables) if any(table))

    def evaluate(self, each: Segment) -> list[str]:
        """Define the function that evaluates a segment."""
        outside = [name for name in sorted(each.all("values")) if self.readers(name, each)]
        moved = [
            f"\tmoved[{self.groups[group[0]] // WORD}] |= uint64_t("
            + " || ".join(f"{name}.curr != {name}.next" for name in group)
            + f") << {self.groups[group[0]] % WORD};" for group in self.taken.get(each, ())]
        return [
            f"void {self._module}::segment_{each.number}() {{",
            f"\tconstexpr bool {self._edge} = true; (void){self._edge};",
            *(f"\t{kind} {name};" for name, kind in self._locals.items()
              if self._homes.get(name) == {each.number}),
            *(f"\tauto was_{name} = {name};" for name in outside),
            # It may have been evaluated in this clock, with another outcome of the condition.
            *(f"\t{name}.next = {name}.curr;" for name in sorted(each.all("kept"))),
            *(one.text.rstrip("\n") for one in each.statements),
            *(f"\tif ({name} != was_{name}) "
              f"{{ {self.changed(name, f'was_{name}', name, each)} }}" for name in outside),
            *moved, "}"]

    def take(self, each: Segment) -> list[str]:
        """Define the functions by which registers of a segment take their next values."""
        return [
            f"void {self._module}::take_{self.groups[group[0]]}() {{ " + " ".join(
                f"if ({name}.curr != {name}.next) {{ "
                f"{self.changed(name, f'{name}.curr', f'{name}.next')} "
                f"{name}.curr = {name}.next; }}" for name in group) + " }"
            for group in self.taken.get(each, ())]

    def call(self, function: str, flags: str, numbers: Collection[int]) -> list[str]:
        """Call the function of each flag that is up, also of those that it raises behind it.

        A branch for each flag would take longer, and so would one for all words, whose target no
        processor foresees. There are no flags but those of the functions.
        """
        lines = []
        for word, every in groupby(sorted(numbers), lambda number: number // WORD):
            calls = "".join(f"case {number % WORD}: {function}_{number}(); break; "
                            for number in every)
            lines.append(
                f"\tfor (uint64_t up; (up = {flags}[{word}]);) {{ {flags}[{word}] = up & (up - 1); "
                f"switch (__builtin_ctzll(up)) {{ {calls}default: __builtin_unreachable(); }} }}")
        return lines


def gated(module: str, edge: str, lines: str, inputs: Sequence[str],
          memories: Sequence[str], bits: Mapping[str, int]) -> tuple[str, list[str], str]:
    """Return members of the module for conditional evaluation, and their definitions.

    Those of segments come one by one, so that they may be compiled apart, then all others.

    ``inputs()`` looks at the inputs, ``outputs()`` settles the outputs, ``next()`` makes a clock,
    and ``wake()`` has all of it evaluated again, at first and after something else has changed the
    state.

    Parameters
    ----------
    module : str
        The class in C++.
    edge : str
        Name of the clock edge in `lines`.
    lines : str
        The body of ``eval``.
    inputs, memories : sequence of str
        Members that hold what comes from outside, and memories.
    bits : mapping of str to int
        Widths of members and locals.
    """
    write = _Writer(module, edge, lines, bits)
    groups = set(write.groups.values())
    inputs = [name for name in inputs if write.readers(name)]
    flags = [sum(each.flag[1] for each in write.all if each.flag[0] == word)
             for word in range(write.words)]
    members = [
        *write.shared, f"uint64_t dirty[{write.words}], moved[{len(groups) // WORD + 1}];",
        *(f"decltype({name}) was_{name};" for name in inputs),
        "void wake();", "void inputs();", "void outputs();", "void next();",
        *(f"{APART} void segment_{each.number}();" for each in write.all),
        *(f"{APART} void take_{number}();" for number in sorted(groups))]
    segments = ["\n".join([*write.evaluate(each), *write.take(each), ""]) for each in write.all]
    return "".join(f"\t{member}\n" for member in members), segments, "\n".join([
        f"void {module}::wake() {{",
        *(f"\tdirty[{word}] = {mask:#x}ull;" for word, mask in enumerate(flags)),
        "\tmemset(moved, 0, sizeof(moved));", "}",
        f"void {module}::inputs() {{",
        *(f"\tif ({name} != was_{name}) "
          f"{{ was_{name} = {name}; {write.wake(write.readers(name))} }}"
          for name in inputs), "}",
        f"void {module}::outputs() {{",
        *write.call("segment", "dirty", {each.number for each in write.flow}), "}",
        f"void {module}::next() {{", "\tobserver observer;", "\toutputs();",
        *write.call("segment", "dirty", {each.number for each in write.stores}),
        *write.call("take", "moved", groups),
        *(f"\tif ({name}.commit(observer)) {{ {write.wake(write.readers(name))} }}"
          for name in memories),
        "}", ""])
