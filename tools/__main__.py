"""List the commands."""

import ast
import difflib
from pathlib import Path

from .console import Parser, UserError, command, say

__all__ = ["commands", "main"]

EPILOG = """\
examples:
  python -m tools
      List them.

  python -m tools.build --help
      What a command does, and its options.
"""


def commands(folder: Path = Path(__file__).parent) -> dict[str, str]:
    """Return the first line of each command by its name.

    A command is a module that runs when it is called, or a package with a `__main__` that does.
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


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; give its exit status."""
    parser = Parser(prog="python -m tools", description="Lists the commands.", epilog=EPILOG)
    _, rest = parser.parse_known_args(argv)
    known = commands()
    if rest:
        near = difflib.get_close_matches(rest[0], known, 1)
        raise UserError(f"run python -m tools.{near[0]}" if near
                        else f"there is no command {rest[0]!r}; python -m tools lists them")
    width = max(map(len, known))
    for name, about in known.items():
        say(f"  {name:{width}}  {about}")
    say("\npython -m tools.NAME runs one, and explains itself with --help. "
        "python -m tb lists the benches.")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
