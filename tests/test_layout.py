"""The house: which folder may know which, and what must never be there."""

import ast
import platform
import re
import sys
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from tools.__main__ import commands

ROOT = Path(__file__).parent.parent
ROOMS = {  # what each may import beside the standard library and itself
    "hdl/fresa": {"amaranth"},
    "platform/fresa_boards": {"amaranth", "amaranth_boards", "fresa"},
    "host/fresa_host": {"serial"},
    "tb": {"amaranth", "numpy", "platformdirs", "vcd", "fresa", "fresa_boards"},
    "tools": {"aiohttp", "amaranth", "click", "cssselect2", "defusedxml", "numpy", "PIL",
              "platformdirs", "pywellen", "svgelements", "tinycss2", "tqdm", "vcd", "vpype",
              "vpype_cli", "fresa", "fresa_boards", "fresa_host", "tb"},
    "launcher": {"tools"},
}

LAYERS = {  # rooms of a package, from the bottom: each may import those of its line and before
    "tb": {
        "what runs": "design mistake models rtlil yosys",
        "what runs it": "engines",
        "what is at its pins": "pins plant uart wall_plant waves",
        "what is proved, and compared with VHDL": "contracts vhdl",
        "boards, benches and stimulus, in general": "bench boards compare diagram stimulus",
        "what a machine declares, and the kits that check it":
            "faults fuzz gcode_options machine netlist runners scoreboard",
        "machines, each declared once": "machines",
        "what they declare, by name": "registry",
        "benches of them all, and a whole job of the mill": "benches milling",
        "checks of them all": "cosim coverage mutation shrink",
        "the command": "__main__",
    },
    "tools": {
        "what commands share": "console",
        "parts of commands": "bitstream campaign canvas cut_picture job keyboard picture "
                             "processes raster record_page synthesis throttle web",
        "checks": "bench cosim coverage faults fingerprints fuzz mutate netlist prove record "
                  "vhdl",
        "pictures and waveforms, boards at USB": "image load wave",
        "what uses these": "diagrams send simulate",
        "what is built of them": "board build draw gcode machines serve",
        "the panel, which serves its machine": "panel",
        "the list": "__main__",
    },
}


@cache
def tree(path: Path) -> ast.Module:
    """Return the syntax of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


def imports(path: Path) -> set[str]:
    """Top-level packages that a file imports, anywhere in it."""
    found = set()
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            found.add(node.module.split(".")[0])
    return found


@pytest.mark.parametrize("room", ROOMS)
def test_arrows_point_downwards(room):
    own = Path(room).name
    for path in (ROOT / room).rglob("*.py"):
        foreign = imports(path) - set(sys.stdlib_module_names) - {own}
        assert foreign <= ROOMS[room], path


@cache
def rooms(package: str) -> dict[str, set[str]]:
    """Return the modules and packages of a package, each with those of them that it imports."""
    top = ROOT / package
    found = {}
    for path in top.rglob("*.py"):
        parts = path.relative_to(top).with_suffix("").parts
        used = found.setdefault(parts[0], set()) if parts != ("__init__",) else set()
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.ImportFrom):
                module = node.module.split(".") if node.module else []
                outer = [package, *parts][:-node.level] if node.level else []
                names = [*outer, *module]
                if names[:1] == [package]:
                    used.update(names[1:2] or (alias.name for alias in node.names))
    return {name: (used & found.keys()) - {name} for name, used in found.items()}


@pytest.mark.parametrize("package", LAYERS)
def test_rooms_know_those_before_them(package):
    found = rooms(package)
    layers = [layer.split() for layer in LAYERS[package].values()]
    assert sorted(found) == sorted(name for layer in layers for name in layer)
    for number, layer in enumerate(layers):
        known = {name for before in layers[:number + 1] for name in before}
        for name in layer:
            assert found[name] <= known, f"{package}/{name}"


@pytest.mark.parametrize("package", LAYERS)
def test_no_rooms_know_each_other(package):
    TopologicalSorter(rooms(package)).prepare()  # raises CycleError, which names them


@pytest.mark.parametrize("package", LAYERS)
def test_every_room_says_what_it_is(package):
    for name in rooms(package):
        path = ROOT / package / name
        path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        about = (ast.get_docstring(tree(path)) or "").partition("\n")[0]
        assert about.endswith("."), path


def test_platform_is_still_the_standard_library():
    assert platform.python_implementation()
    assert not (ROOT / "platform" / "__init__.py").exists()
    assert not (ROOT / "hdl" / "__init__.py").exists()


def test_packages_of_the_gateware_know_those_before_them():
    layers = ["arithmetic", "drive", "protocol", "motion", "panel", "machines"]
    for number, layer in enumerate(layers):
        for path in (ROOT / "hdl" / "fresa" / layer).glob("*.py"):
            known = set(re.findall(r"^from \.\.(\w+)[\w.]* import", path.read_text("utf-8"), re.M))
            assert known & {*layers} <= {*layers[:number]}, path


def test_nothing_below_the_boards_asks_for_a_pin():
    for path in (ROOT / "hdl").rglob("*.py"):
        assert "platform." not in path.read_text(encoding="utf-8"), path


class TestReadme:
    text = (ROOT / "README.md").read_text(encoding="utf-8")

    def test_two_commands_do_everything(self):
        commands = re.findall(r"^python3 -m venv .*", self.text, re.M)
        assert commands[0].endswith("-m tools.build")
        assert commands[1].endswith("-m pytest -q")
        assert commands[2:] == [line for line in commands if "[ecp5,load]" in line]  # a board

    def test_the_first_screen_says_what_was_never_tried(self):
        assert "not yet run on hardware" in "".join(self.text.splitlines(keepends=True)[:15])


@pytest.mark.parametrize("page", [ROOT / "README.md", *(ROOT / "docs").glob("*.md")],
                         ids=lambda page: page.name)
class TestPages:
    def test_links_lead_somewhere(self, page):
        for target in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), target

    def test_commands_exist(self, page):
        text = page.read_text(encoding="utf-8")
        named = set(re.findall(r"python -m tools\.(\w+)", text))
        named |= set(re.findall(r"(?:^|`)fresa (\w+)", text, re.M))
        assert named - {"NAME"} <= commands().keys()


def test_the_page_of_commands_has_them_all():
    text = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `fresa (\w+)", text, re.M)) == commands().keys()
