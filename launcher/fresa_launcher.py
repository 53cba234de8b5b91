"""`fresa NAME`: the commands of a checkout, from any folder.

The commands are no part of the wheel. An editable install runs this file where it lies in the
checkout, and that is how it finds them.
"""

import sys
from pathlib import Path

__all__ = ["main"]

CHECKOUT = Path(__file__).resolve().parent.parent


def main() -> int:
    """Run the command; give its exit status."""
    if not (CHECKOUT / "tools" / "__main__.py").exists():
        print("error: the commands need a checkout of Fresa: run  pip install -e .  in one",
              file=sys.stderr)
        return 2
    sys.path.insert(0, str(CHECKOUT))
    sys.argv[0] = "fresa"  # however the system spells the script; help and errors show it
    from tools.__main__ import main as run

    return run()


if __name__ == "__main__":
    raise SystemExit(main())
