"""A redirection to an address that other users of the computer cannot read.

The command line of a browser can be read by all of them, in the list of processes.
"""

import html
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

__all__ = ["redirect"]

PAGE = """\
<!doctype html>
<meta charset="utf-8">
<meta http-equiv="refresh" content="0; url={address}">
<title>Fresa</title>
<p><a href="{address}">Go to the page</a>
"""


@contextmanager
def redirect(address: str) -> Iterator[str]:
    """Yield the address of a file that redirects to `address`; it exists while the body runs.

    Only the user can read the file.
    """
    handle, name = tempfile.mkstemp(prefix="fresa-", suffix=".html")  # mode 0600
    try:
        with os.fdopen(handle, "w") as file:
            file.write(PAGE.format(address=html.escape(address)))
        yield Path(name).as_uri()
    finally:
        with suppress(OSError):
            os.unlink(name)
