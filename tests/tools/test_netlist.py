"""The command that checks the netlist."""

import json
import re
import time

import pytest

from tb.engines import EngineError
from tb.netlist import CHECKS, Check, Options, Outcome
from tools import netlist


def run(*arguments: object) -> int:
    return netlist.main([str(argument) for argument in arguments])


@pytest.fixture
def checks(monkeypatch):
    """Leave only checks that are made here, of what their tasks say."""
    for name in list(CHECKS):
        monkeypatch.delitem(CHECKS, name)

    def add(name: str, *outcomes: Outcome | Exception, missing: str | None = None,
            **leaves_out: str) -> None:
        def tasks(parts, options: Options):
            def task(outcome):
                def do(folder):
                    assert not list(folder.iterdir())
                    (folder / "mine").touch()
                    time.sleep(0.01)
                    if isinstance(outcome, Exception):
                        raise outcome
                    return outcome

                return do

            return [task(outcome) for outcome in outcomes]

        monkeypatch.setitem(CHECKS, name, Check(f"Says {name}.", tasks, lambda: missing,
                                               lambda parts: leaves_out))

    return add


GOOD = Outcome("it", True, "3 of 3", figures={"cells": 3})
FOUND = Outcome("it", True, "found at a", "a bug", {"where": ["a"]})


class TestCommand:
    def test_all_good(self, checks, capsys, tmp_path):
        checks("one", GOOD, FOUND)
        checks("two", GOOD, other="it cannot")
        path = tmp_path / "it.json"
        assert run("--json", path, "--seed", 7, "--jobs", 2) == 0
        printed = capsys.readouterr().out.splitlines()
        assert re.fullmatch(r"ok +one +it +3 of 3  \(\d+\.\d s\)", printed[0])
        assert re.fullmatch(r"control +one +it +a bug: found at a  \(\d+\.\d s\)", printed[1])
        assert re.fullmatch(r"ok +two +it +3 of 3  \(\d+\.\d s\)", printed[2])
        assert printed[3].split() == ["no", "two", "other", "it", "cannot"]
        assert printed[4].startswith("3 of 3 as they must be, 1 of them controls, seed 7, ")
        facts = json.loads(path.read_text())
        assert (facts["seed"], facts["good"], len(facts["parts"])) == (7, True, 3)
        assert facts["left_out"] == {"one": {}, "two": {"other": "it cannot"}}
        assert facts["parts"][0]["figures"] == {"cells": 3}
        assert facts["parts"][1]["control"] == "a bug"
        assert facts["parts"][1]["seconds"] > 0
        assert facts["versions"]["yosys"]

    @pytest.mark.parametrize(("outcome", "line"), [
        (Outcome("it", False, "2 of 3"), "FAILED  one"),
        (Outcome("it", False, "0 of 3", "a bug"), "MISSED  one"),
    ])
    def test_one_bad(self, outcome, line, checks, capsys):
        checks("one", GOOD, outcome)
        assert run() == 1
        printed = capsys.readouterr().out
        assert f"\n{line}" in printed
        assert "1 of 2 as they must be" in printed

    def test_only_what_is_asked_for(self, checks, capsys):
        checks("one", GOOD)
        checks("two", Outcome("it", False, ""), missing="get Icarus")
        assert run("one", "one") == 0
        assert "1 of 1" in capsys.readouterr().out
        assert run("two") == 2
        assert "two cannot run here: get Icarus" in capsys.readouterr().err

    def test_yosys_that_fails_is_one_line(self, checks, capsys):
        checks("one", GOOD, EngineError("Yosys failed: what"))
        assert run() == 2
        assert capsys.readouterr().err.splitlines()[-1] == "error: Yosys failed: what"

    def test_list(self, capsys):
        assert run("--list") == 0
        printed = capsys.readouterr().out
        assert [line.split()[0] for line in printed.splitlines()] == list(CHECKS)
        assert run("--list", "pins") == 0
        assert "two flip-flops in a row" in capsys.readouterr().out

    def test_help_explains_each(self, capsys):
        with pytest.raises(SystemExit):
            run("--help")
        printed = " ".join(capsys.readouterr().out.split())
        for check in CHECKS.values():
            assert check.summary in printed

    @pytest.mark.parametrize(("arguments", "message"), [
        (["equals"], "there is no check 'equals'; did you mean equal?"),
        (["zzz"], "there is no check 'zzz'; there are "),
        (["--flips", "0"], "must be a whole number from 1 to 10000, not '0'"),
        (["--cycles", "-1"], "must be a whole number from 1 to"),
        (["--seed", "x"], "must be a whole number from 0 to"),
        (["--jobs", "0"], "must be a whole number from 1 to 256, not '0'"),
        (["--json", "nowhere/it.json"], "its folder does not exist"),
    ])
    def test_misuse(self, arguments, message, capsys):
        assert run(*arguments) == 2
        assert message in capsys.readouterr().err
