"""RTLIL in a canonical form: the design without how its source was written.

Amaranth names wires after local variables, numbers anonymous ones, and gives the source line of
everything. The canonical form drops that: within a module, wires, cells and inner ports are
numbered in the order in which its cells use them. It changes only with the design: verdicts on a
design are keyed by it, and mutants are made of it.
"""

import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

__all__ = ["canonical", "fingerprint"]

_IDENTIFIER = re.compile(r"(?<!\S)[\\$]\S+")
#: Attributes of wires, cells and modules that nothing depends on.
_SHOWN = re.compile(r" *attribute \\(src|generator|enum_\w+) ")
_SUFFIX = re.compile(r"\$\d+$")


@dataclass
class _Item:
    """A wire, memory, cell, process or connection: its attributes, its first line, the others."""

    attributes: list[str]
    head: str
    body: list[str] = field(default_factory=list)

    @property
    def kind(self) -> str:
        return self.head.split(None, 1)[0]

    @property
    def name(self) -> str:
        return self.head.split()[-1]

    @property
    def lines(self) -> list[str]:
        return [*self.attributes, self.head, *self.body]


@dataclass
class _Module:
    """A module: its attributes, its name and what is in it."""

    attributes: list[str]
    name: str
    items: list[_Item]


def canonical(text: str) -> str:
    """Return a design in its canonical form.

    Ports of the top, instances of modules, memories, named cells (properties) and attributes other
    than ``src``, ``generator`` and those of enumerations stay as they are.

    Parameters
    ----------
    text : str
        RTLIL as :func:`amaranth.back.rtlil.convert` writes it.
    """
    modules = list(_modules(text))
    names = _module_names(modules)
    ports: dict[str, dict[str, str]] = {}
    written = [_write(module, names, ports) for module in reversed(modules)]
    return "".join(reversed(written))


def fingerprint(*texts: str) -> str:
    """Return the SHA-256 of some texts in order, in hexadecimal."""
    key = hashlib.sha256()
    for text in texts:
        key.update(hashlib.sha256(text.encode()).digest())
    return key.hexdigest()


def _modules(text: str) -> Iterator[_Module]:
    attributes: list[str] = []
    module: _Module | None = None
    item: _Item | None = None
    for line in text.splitlines():
        if not line or _SHOWN.match(line):
            continue
        depth = len(line) - len(line.lstrip())
        if item is not None and (depth > 2 or line == "  end"):
            item.body.append(line)
        elif line.lstrip().startswith("attribute "):
            attributes.append(line)
        elif line.startswith("module "):
            module, attributes = _Module(attributes, line.split()[1], []), []
        elif line == "end":
            assert module is not None
            yield module
            item = None
        else:
            assert module is not None
            item, attributes = _Item(attributes, line), []
            module.items.append(item)


def _module_names(modules: Iterable[_Module]) -> dict[str, str]:
    """Return new names of modules by their old ones: `motor$17` is numbered among its siblings.

    Amaranth also numbers a submodule that has the name of a signal, and counts the signals.
    """
    new: dict[str, str] = {}
    for module in modules:  # each comes after the one that it is in
        path = new.setdefault(module.name, module.name)
        taken: set[str] = set()
        for item in module.items:
            if item.kind == "cell" and (kind := item.head.split()[1]).startswith("\\"):
                plain = name = _SUFFIX.sub("", item.name[1:])
                while name in taken:
                    name = f"{plain}${len(taken)}"
                taken.add(name)
                new.setdefault(kind, f"{path}.{name}")
    return new


def _write(module: _Module, names: Mapping[str, str], ports: dict[str, dict[str, str]]) -> str:
    """Write a module; `ports` has those of its submodules, and gets its own."""
    is_top = any("\\top " in attribute for attribute in module.attributes)
    wires = {item.name: item for item in module.items if item.kind == "wire"}
    aliases = set(_aliases(module.items, wires))
    connections = [item for item in module.items
                   if item.kind == "connect" and item.head.split()[1] not in aliases]
    cells = [item for item in module.items if item.kind not in ("wire", "connect", "memory")]
    memories = [item for item in module.items if item.kind == "memory"]
    new: dict[str, str] = {item.name: item.name for item in memories}
    new |= {name: name for name, item in wires.items() if is_top and _is_port(item)}

    def rename(name: str) -> str:
        if name not in new:
            is_port = name in wires and _is_port(wires[name])
            new[name] = f"\\port${len(new)}" if is_port else f"${len(new)}"
        return new[name]

    def renamed(line: str) -> str:
        return _IDENTIFIER.sub(lambda match: rename(match[0]), line)

    body: list[str] = []
    for item in cells:
        body += item.attributes
        _, *kind, name = item.head.split()
        inner: Mapping[str, str] | None = None
        if kind and kind[0] in names:  # the instance of a module of the design
            inner = ports[kind[0]]
            instance = names[kind[0]].rpartition(".")[2]
            body.append(f"  cell {names[kind[0]]} \\{instance}")
        else:
            number = name if name.startswith("\\") else rename(name)
            body.append(" ".join(["  " + item.kind, *kind, number]))
        lines = item.body
        if inner is not None:
            order = list(inner)
            lines = sorted(lines[:-1], key=lambda line: order.index(line.split()[1])) + lines[-1:]
        for line in lines:
            words = line.split(None, 2)
            if words[0] == "parameter":
                body.append(line)
            elif words[0] == "connect":
                port = inner[words[1]] if inner is not None else words[1]
                body.append(f"    connect {port} {renamed(words[2])}")
            else:
                body.append(renamed(line))
    connected = sorted((renamed(value), target) for target, value in (
        item.head.split(None, 2)[1:] for item in connections))
    body += [f"  connect {rename(target)} {value}" for value, target in connected]

    left = [item for item in wires.values() if item.name not in aliases]
    for item in left:  # those that no cell has
        rename(item.name)
    place = {name: number for number, name in enumerate(new)}
    left.sort(key=lambda item: place[item.name])
    ports[module.name] = {item.name: new[item.name] for item in left if _is_port(item)}
    lines, number = [], 0
    for item in left:
        lines += sorted(item.attributes)
        _, _, width, *words = item.head.split()
        if _is_port(item):
            lines.append(f"  wire width {width} {words[0]} {number} {rename(item.name)}")
            number += 1
        else:
            lines.append(f"  wire width {width} {rename(item.name)}")
    for item in memories:
        lines += item.lines
    return "\n".join([*module.attributes, f"module {names[module.name]}", *lines, *body, "end",
                      "", ""])


def _is_port(wire: _Item) -> bool:
    return wire.head.split()[3] in ("input", "output", "inout")


def _aliases(items: Iterable[_Item], wires: Mapping[str, _Item]) -> Iterator[str]:
    """Return the wires that are only another name of a port or wire."""
    items = list(items)
    lines = [line for item in items for line in [item.head, *item.body]]
    # The word after `connect` is a port of a cell, or what is driven here.
    read = {name for line in lines if not line.lstrip().startswith("parameter ")
            for name in _IDENTIFIER.findall(re.sub(r"^ *connect \S+|^  (wire|cell) .*", "", line))}
    for item in items:
        if item.kind != "connect":
            continue
        name, value = item.head.split()[1], item.head.split(None, 2)[2]
        alias = wires.get(name)
        if alias is None or _is_port(alias) or name in read:
            continue
        whole = wires.get(value.split()[0]) if " " in value else None
        if whole is not None and whole.head.split()[2] != alias.head.split()[2]:
            whole = None
        if set(alias.attributes) <= set(whole.attributes if whole is not None else ()):
            yield name
