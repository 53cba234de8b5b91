"""The stage's panel: a page that moves it, knows where it is, and keeps its points."""

from .panel import Panel

__all__ = ["Panel"]
