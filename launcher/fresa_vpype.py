"""`vpype ... fresa out.gcode`: vpype's command of that name, which is in the checkout.

An editable install runs this file in the checkout, and its path locates the commands.
"""

import sys
from importlib import import_module
from pathlib import Path

__all__ = ["fresa"]

CHECKOUT = Path(__file__).resolve().parent.parent

if str(CHECKOUT) not in sys.path:
    sys.path.append(str(CHECKOUT))

fresa = import_module("tools.draw.plugin").fresa
