"""What the canonical form of a design forgets, and what it keeps."""

import ast
import functools
import inspect
import linecache
import types

import pytest
from amaranth import Cat, Module, Value, signed, unsigned
from amaranth.back import rtlil
from amaranth.hdl._ir import PortDirection
from amaranth.lib import data, memory, wiring
from amaranth.lib.wiring import In, Out

from fresa import drive, motion, protocol
from tb.boards import component
from tb.engines.source import rtlil as rtlil_of
from tb.rtlil import canonical, fingerprint

SOURCE = '''
class Toy(wiring.Component):
    """Counts, and says when."""

    go: In(1)
    shown: Out(5)
    last: Out(1)

    def __init__(self):
        super().__init__()

    def elaborate(self, platform):
        m = Module()
        count = Signal(5, init=3)
        full = Signal()
        m.submodules.memory = words = memory.Memory(shape=4, depth=4, init=[1, 2])
        port = words.read_port(domain="comb")
        m.d.comb += [full.eq(is_full(count)), port.addr.eq(count), self.last.eq(full),
                     self.shown.eq(count ^ port.data)]
        m.submodules.inside = inside = Inside()
        m.d.comb += inside.i.eq(count[0])
        with m.If(self.go & inside.o):
            m.d.sync += count.eq(count + 1)
        return m


def is_full(count):
    return count == 19


class Inside(wiring.Component):
    i: In(1)
    o: Out(1)

    def elaborate(self, platform):
        m = Module()
        kept = Signal()
        m.d.sync += kept.eq(self.i)
        m.d.comb += self.o.eq(~kept)
        return m
'''
HEAD = """
from amaranth import Module, Signal
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out
"""


@functools.cache
def toy(source: str) -> str:
    """Return the canonical form of the component that a text describes."""
    space: dict = {"__name__": "toy"}
    linecache.cache["toy.py"] = (1, None, source.splitlines(keepends=True), "toy.py")
    exec(compile(HEAD + source, "toy.py", "exec"), space)
    return canonical(rtlil.convert(space["Toy"](), name="toy"))


def changed(old: str, new: str) -> str:
    assert SOURCE.count(old) == 1
    return SOURCE.replace(old, new)


class Memories(wiring.Component):
    """Memories of several shapes, one with nothing in it."""

    def __init__(self):
        super().__init__({"address": In(2), "read": Out(21)})

    def elaborate(self, platform):
        m = Module()
        words = []
        for place, (shape, init) in enumerate([
                (1, [1, 0, 1]), (unsigned(5), [3, 31]), (signed(4), [-1, -8, 7]), (6, []), (0, [0]),
                (data.StructLayout({"low": 3, "high": signed(2)}), [{"low": 5, "high": -2}])]):
            m.submodules[f"part_{place}"] = part = memory.Memory(shape=shape, depth=4, init=init)
            port = part.read_port(domain="comb")
            m.d.comb += port.addr.eq(self.address)
            words.append(Value.cast(port.data))
        m.d.comb += self.read.eq(Cat(words))
        return m


def test_it_is_as_amaranth_writes_it():
    design, other = (component("memories", Memories()) for _ in range(2))
    ports = {name: (Value.cast(signal), way) for way, signals in (
        (PortDirection.Input, {"clk": other.clk, **other.inputs}),
        (PortDirection.Output, other.outputs)) for name, signal in signals.items()}
    assert rtlil_of(design) == rtlil.convert(
        other.top, name="memories", emit_src=False, ports=ports)


REWRITTEN = {
    "a local signal renamed": SOURCE.replace("full", "at_end"),
    "a register renamed": SOURCE.replace("count", "number"),
    "a local of a part renamed": SOURCE.replace("kept", "before"),
    "a signal with the name of a part": changed("full = Signal()", 'full = Signal(name="inside")'),
    "a second name": changed("full = Signal()", "full, also = Signal(), Signal()").replace(
        "m.d.comb += inside", "m.d.comb += also.eq(full)\n        m.d.comb += inside"),
    "no name": changed("self.last.eq(full)", "self.last.eq(is_full(count))").replace(
        "full.eq(is_full(count)), ", ""),
    "other lines": "\n\n\n" + SOURCE,
    "another docstring": changed("Counts, and says when.", "Something else."),
    "formatted": changed("self.last.eq(full),\n", "self.last.eq(full),\n\n"),
    "a function moved": "\ndef is_full(count):\n    return 19 == count\n" + changed(
        "def is_full(count):\n    return count == 19", "").replace("19 == count", "count == 19"),
    "a class moved": SOURCE[SOURCE.index("class Inside"):] + SOURCE[:SOURCE.index("class Inside")],
}
OTHERS = {
    "operator": changed("count ^ port.data", "count | port.data"),
    "order of operands": changed("count == 19", "19 - count == 0"),
    "constant": changed("count == 19", "count == 18"),
    "init": changed("init=3", "init=2"),
    "width": changed("Signal(5,", "Signal(6,"),
    "content of a memory": changed("init=[1, 2]", "init=[1, 3]"),
    "no reset": changed("Signal(5, init=3)", "Signal(5, init=3, reset_less=True)"),
    "attribute": changed("kept = Signal()", 'kept = Signal(attrs={"keep": 1})'),
    "condition": changed("self.go & inside.o", "self.go"),
    "name of a port": SOURCE.replace("shown", "seen"),
    "name of a part": changed("m.submodules.inside", "m.submodules.other"),
    "wiring": changed("inside.i.eq(count[0])", "inside.i.eq(count[1])"),
}


class TestCanonical:
    @pytest.mark.parametrize("what", REWRITTEN)
    def test_the_same_design_is_the_same(self, what):
        assert REWRITTEN[what] != SOURCE
        assert toy(REWRITTEN[what]) == toy(SOURCE)

    @pytest.mark.parametrize("what", OTHERS)
    def test_another_design_is_another(self, what):
        assert fingerprint(toy(OTHERS[what])) != fingerprint(toy(SOURCE))

    def test_has_no_private_names_or_places(self):
        text = toy(SOURCE)
        for word in ("count", "full", "kept", "src", "port__data", "toy.py"):
            assert word not in text
        for word in ("\\go", "\\shown", "\\inside", "\\toy.inside", "init 5'00011"):
            assert word in text

    def test_of_a_canonical_text_is_the_same(self):
        assert canonical(toy(SOURCE)) == toy(SOURCE)


class _Renamed(ast.NodeTransformer):
    """Gives all local variables of `elaborate` other names."""

    def __init__(self, names: set[str]) -> None:
        self.names = names

    def visit_Name(self, node: ast.Name) -> ast.Name:
        return ast.Name(f"{node.id}_x" if node.id in self.names else node.id, node.ctx)


def renamed(kind: type, prefix: str) -> type:
    """Return a class whose method `elaborate` has other locals, in other lines."""
    module = inspect.getmodule(kind)
    assert module is not None
    tree = ast.parse(inspect.getsource(module))
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef) and function.name == "elaborate":
            names = {node.id for node in ast.walk(function) if isinstance(node, ast.Name)
                     and isinstance(node.ctx, ast.Store)}
            function.body = [_Renamed(names).visit(item) for item in function.body]
    text = prefix + ast.unparse(ast.fix_missing_locations(tree))
    other = types.ModuleType(module.__name__)
    other.__dict__.update(__package__=module.__package__, __file__="other.py")
    linecache.cache["other.py"] = (1, None, text.splitlines(keepends=True), "other.py")
    exec(compile(text, "other.py", "exec"), other.__dict__)
    return getattr(other, kind.__name__)


@pytest.mark.parametrize(("kind", "parameters"), [
    (motion.MotionSequencer, {"z_travel": 400}), (drive.FrequencyDivider, {"period": 9}),
    (motion.CoordinateGenerator, {"picture": [[True, False]], "pixel_steps": 2}),
    (motion.OrderLedger, {"depth": 2}),
    (protocol.UARTReceiver, {"period": 20}),
])
def test_a_component_with_other_locals_is_the_same(kind, parameters):
    texts = [rtlil_of(component("top", made(**parameters)))
             for made in (kind, renamed(kind, "# Moved.\n\n\n"))]
    assert fingerprint(canonical(texts[0])) == fingerprint(canonical(texts[1]))
    assert texts[0] != texts[1]
