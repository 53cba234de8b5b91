"""What a test run tells of what it leaves out."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent


def test_a_missing_compiler_is_named_at_both_ends():
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-n0", "-p", "no:cacheprovider",
         "tests/tb/test_engines.py", "-k", "test_cache_is_bounded or test_two_processes_at_once"],
        cwd=ROOT, env={**os.environ, "CXX": "no-such-compiler"}, text=True, capture_output=True)
    assert done.returncode == 0
    lines = done.stdout.splitlines()
    assert ("the fast engine is missing: CXXRTL needs a C++ compiler: CXX is 'no-such-compiler', "
            "which is not found; what can, runs on the slow one") in lines
    assert "no C++ compiler: 2 tests left out; pip install -e '.[fast]'" in lines
