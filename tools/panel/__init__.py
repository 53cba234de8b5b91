"""The page of the stage: jogs it, shows its position, and stores its points."""

from .panel import Panel

__all__ = ["Panel"]
