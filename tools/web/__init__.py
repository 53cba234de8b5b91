"""Local web pages: an HTTP server on the loopback, and state that is published to each page."""

from .redirect import redirect
from .session import FRAME_INTERVAL, Backend, Pages, View
from .site import Refused, serve, site, stopping

__all__ = ["FRAME_INTERVAL", "Pages", "Refused", "Backend", "View", "redirect", "serve",
           "site", "stopping"]
