"""List the commands, or run one."""

import ast
import importlib
import sys
from pathlib import Path

from .console import Parser, command, known, say, spelt

__all__ = ["commands", "main"]

EPILOG = """\
examples:
  python -m tools.build --help
      Describe a command and its options.
"""


def commands(folder: Path = Path(__file__).parent) -> dict[str, str]:
    """Return the first line of each command's docstring by its name.

    A command is a runnable module, or a package with a `__main__`.
    """
    modules = {path.stem: path for path in folder.glob("*.py") if not path.stem.startswith("_")}
    modules |= {path.parent.name: path for path in folder.glob("*/__main__.py")}
    found = {}
    for name, path in sorted(modules.items()):
        module = ast.parse(path.read_text(encoding="utf-8"))
        if any(map(_is_guard, module.body)):
            found[name] = (ast.get_docstring(module) or "").partition("\n")[0]
    return found


def _is_guard(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.If) and ast.unparse(statement.test) == "__name__ == '__main__'"


def listing() -> str:
    """Return the names of all commands, one per line."""
    found = commands()
    width = max(map(len, found))
    lines = [f"  {name:{width}}  {about}" for name, about in found.items()]
    return "\n".join(["commands:", *lines, "",
                      "python -m tools.NAME runs one, and --help describes it."])


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    given = sys.argv[1:] if argv is None else argv
    if given and not given[0].startswith("-"):
        name = known(given[0], commands(), "command")
        package = Path(__file__).with_name(name).is_dir()
        module = f"tools.{name}.__main__" if package else f"tools.{name}"
        return importlib.import_module(module).main(given[1:])
    Parser(prog="python -m tools", description=listing(), epilog=EPILOG,
           usage=spelt("python -m tools.NAME ...")).parse_args(given)
    say(listing())
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
