"""`fresa NAME`: the commands of a checkout, from any folder.

The commands are not part of the wheel. An editable install runs this file in the checkout, and its
path locates them.
"""

import sys
from pathlib import Path

__all__ = ["main"]

CHECKOUT = Path(__file__).resolve().parent.parent


def main() -> int:
    """Run the command; return its exit status."""
    if not (CHECKOUT / "tools" / "__main__.py").exists():
        print("error: the commands need a checkout of Fresa: run  pip install -e .  in one",
              file=sys.stderr)
        return 2
    sys.path.insert(0, str(CHECKOUT))
    sys.argv[0] = "fresa"  # for help and errors, whatever the path of the script
    from tools.__main__ import main as run

    return run()


if __name__ == "__main__":
    raise SystemExit(main())
