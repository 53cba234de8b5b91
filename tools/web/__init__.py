"""What pages share: a server on the loopback, and a state that is sent to each page."""

from .redirect import redirect
from .session import FRAME_INTERVAL, Pages, Shown, View
from .site import Refused, serve, site, stopping

__all__ = ["FRAME_INTERVAL", "Pages", "Refused", "Shown", "View", "redirect", "serve",
           "site", "stopping"]
