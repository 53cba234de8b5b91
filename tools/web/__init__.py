"""What any page of ours needs: a server on the loopback, and pages that are shown a state."""

from .redirect import redirect
from .session import FRAME_INTERVAL, Pages, Shown, View
from .site import Refused, serve, site, stopping

__all__ = ["FRAME_INTERVAL", "Pages", "Refused", "Shown", "View", "redirect", "serve",
           "site", "stopping"]
