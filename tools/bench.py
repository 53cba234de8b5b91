"""Run a bench, or list all."""

from tb.__main__ import main as benches

from .console import spelt

__all__ = ["main"]


def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    return benches(argv, prog=spelt("python -m tools.bench"))


if __name__ == "__main__":
    raise SystemExit(main())
