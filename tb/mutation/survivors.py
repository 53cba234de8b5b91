"""Why some mutants are found by nothing, in words."""

__all__ = ["EXPLAINED"]

EXPLAINED: dict[tuple[str, str], str] = {
}
"""By component and mutant, as ``tools.mutate`` writes it."""
