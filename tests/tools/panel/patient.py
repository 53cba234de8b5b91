"""The panel, for tests on a slow machine: a browser that is kept waiting goes on holding.

That a hold times out is tested in `test_stopping`; here it would end a jog at random.
"""

from tests.tools.process import PATIENCE
from tools.panel import jogging
from tools.panel.__main__ import main

if __name__ == "__main__":
    jogging.HOLD_TIMEOUT_S = PATIENCE
    raise SystemExit(main())
