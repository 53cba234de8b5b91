"""What the commands share: one line an error, whole files or none, quiet progress."""

import io
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fresa_boards.programs import ProgramError
from tools import console
from tools.console import (
    Parser,
    Progress,
    UserError,
    colour,
    command,
    staged,
    write_atomically,
    write_files_atomically,
    write_folder_atomically,
)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def tree(folder) -> dict[str, bytes | None]:
    """Everything below a folder, hidden files too: None for a folder, bytes for a file."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in folder.rglob("*")
    }


def fail_at(monkeypatch, name: str, nth: int, error: BaseException) -> None:
    """Let the `nth` call of a function of `os` fail, once."""
    real, calls = getattr(os, name), 0

    def failing(*args, **kwargs):
        nonlocal calls
        calls += 1
        if calls == nth:
            raise error
        return real(*args, **kwargs)

    monkeypatch.setattr(console.os, name, failing)


class TestCommand:
    @pytest.mark.parametrize(
        ("error", "status", "line"),
        [
            (UserError("do this"), 2, "error: do this\n"),
            (UserError("two\nlines of it"), 2, "error: two lines of it\n"),
            (PermissionError(13, "Permission denied", "x"), 2, "error: x: Permission denied\n"),
            (OSError("odd"), 2, "error: odd\n"),
            (ProgramError("Yosys failed:\nno"), 2, "error: Yosys failed: no\n"),
            (KeyboardInterrupt(), 130, "error: interrupted\n"),
        ],
    )
    def test_foreseen_is_one_line(self, error, status, line, capsys):
        @command
        def main(argv):
            raise error

        assert main([]) == status
        assert capsys.readouterr() == ("", line)

    def test_status_is_passed_on(self, capsys):
        assert command(lambda argv: 7)() == 7
        assert capsys.readouterr() == ("", "")

    def test_our_own_mistake_keeps_its_traceback(self):
        with pytest.raises(ZeroDivisionError):
            command(lambda argv: 1 // 0)()

    def test_reader_that_leaves_is_no_error(self):
        code = (
            "from tools.console import command, say\n"
            "@command\n"
            "def main(argv):\n"
            "    for _ in range(100_000): say('line')\n"
            "    return 0\n"
            "raise SystemExit(main())\n"
        )
        child = subprocess.Popen(
            [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        assert child.stdout is not None and child.stderr is not None
        assert child.stdout.readline().strip() == b"line"
        child.stdout.close()
        assert child.stderr.read() == b""
        child.stderr.close()
        assert child.wait() == 1

    def test_parser_raises_instead_of_printing(self, capsys):
        parser = Parser(prog="it")
        parser.add_argument("--long-one", type=int)
        with pytest.raises(UserError, match=r"invalid int value: 'x' \(see it --help\)$"):
            parser.parse_args(["--long-one", "x"])
        with pytest.raises(UserError, match=r"unrecognized arguments: --long"):
            parser.parse_args(["--long", "1"])
        assert capsys.readouterr() == ("", "")


class TestColour:
    def test_only_on_a_terminal(self, monkeypatch):
        monkeypatch.delenv("NO_COLOR", raising=False)
        monkeypatch.setenv("TERM", "xterm")
        assert colour("a", 31, io.StringIO()) == "a"
        assert colour("a", 31, Terminal()) == "\x1b[31ma\x1b[0m"

    @pytest.mark.parametrize(("name", "value"), [("NO_COLOR", ""), ("TERM", "dumb")])
    def test_not_when_unwanted(self, name, value, monkeypatch):
        monkeypatch.setenv(name, value)
        assert colour("a", 31, Terminal()) == "a"


def test_say_escapes_what_stdout_lacks():
    environment = os.environ | {"PYTHONIOENCODING": "ascii"}
    code = "from tools.console import say; say('caf\\u00e9 \\udcff')"
    run = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True)
    assert (run.returncode, run.stdout.strip()) == (0, rb"caf\xe9 \udcff")


class TestWriteAtomically:
    def test_new_and_replaced(self, tmp_path):
        path = tmp_path / "a"
        for data in (b"one", b"two", b""):
            write_atomically(path, data)
            assert tree(tmp_path) == {"a": data}

    def test_mode(self, tmp_path):
        path = tmp_path / "a"
        plain = tmp_path / "plain"
        plain.write_bytes(b"")
        write_atomically(path, b"one")
        assert path.stat().st_mode == plain.stat().st_mode
        path.chmod(0o750)
        write_atomically(path, b"two")
        assert path.stat().st_mode & 0o777 == 0o750

    def test_a_script_may_be_run(self, tmp_path):
        path = tmp_path / "build.sh"
        path.write_bytes(b"written before, and not to be run")
        path.chmod(0o640)
        write_atomically(path, b"#!/bin/sh\n")
        assert path.stat().st_mode & 0o777 == 0o750

    def test_link_stays(self, tmp_path):
        (tmp_path / "link").symlink_to(tmp_path / "file")
        write_atomically(tmp_path / "link", b"data")
        assert (tmp_path / "link").is_symlink()
        assert (tmp_path / "file").read_bytes() == b"data"

    def test_longest_name(self, tmp_path):
        write_atomically(tmp_path / ("n" * 255), b"data")
        assert (tmp_path / ("n" * 255)).read_bytes() == b"data"

    def test_pipe_stays_a_pipe(self, tmp_path):
        # A pipe of our own: were the rule broken, a real device would be lost to the whole machine.
        pipe = tmp_path / "pipe"
        os.mkfifo(pipe)
        reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
        try:
            write_atomically(pipe, b"data")
            assert pipe.is_fifo()
            assert os.read(reader, 100) == b"data"
        finally:
            os.close(reader)

    def test_old_file_survives_a_failure(self, tmp_path, monkeypatch):
        path = tmp_path / "a"
        path.write_bytes(b"old")
        fail_at(monkeypatch, "fsync", 1, OSError(28, "No space left on device"))
        with pytest.raises(UserError, match=r"^cannot write .*a: No space left on device$"):
            write_atomically(path, b"new")
        assert tree(tmp_path) == {"a": b"old"}

    def test_no_folder(self, tmp_path):
        with pytest.raises(UserError, match=r"^cannot write .*: its folder does not exist$"):
            write_atomically(tmp_path / "none" / "a", b"")

    def test_file_for_a_folder(self, tmp_path):
        (tmp_path / "file").write_bytes(b"")
        with pytest.raises(UserError, match=r"a file is where its folder should be$"):
            write_atomically(tmp_path / "file" / "a", b"")

    def test_folder_for_a_file(self, tmp_path):
        with pytest.raises(UserError, match=r"Is a directory$"):
            write_atomically(tmp_path, b"")


FILES = {"a": b"new a", "sub/b": b"new b", "c": b"new c"}
FAILURES = [OSError(28, "No space left on device"), KeyboardInterrupt()]


class TestWriteFolderAtomically:
    def test_new(self, tmp_path):
        write_folder_atomically(tmp_path / "x" / "y", FILES)
        assert tree(tmp_path / "x" / "y") == FILES | {"sub": None}

    def test_keeps_other_files(self, tmp_path):
        (tmp_path / "mine").write_bytes(b"kept")
        (tmp_path / "a").write_bytes(b"old a")
        write_folder_atomically(tmp_path, FILES)
        assert tree(tmp_path) == FILES | {"sub": None, "mine": b"kept"}

    @pytest.mark.parametrize("error", FAILURES, ids=["full", "interrupted"])
    @pytest.mark.parametrize(
        ("name", "nth"),
        [*(("fsync", nth) for nth in range(1, 4)), *(("replace", nth) for nth in range(1, 6))],
    )
    def test_all_or_nothing(self, name, nth, error, tmp_path, monkeypatch):
        # Two files are moved away and others moved in, the last is moved in only: five moves.
        (tmp_path / "sub").mkdir()
        for file in FILES:
            (tmp_path / file).write_bytes(b"old " + file.encode())
        (tmp_path / "mine").write_bytes(b"kept")
        before = tree(tmp_path)
        fail_at(monkeypatch, name, nth, error)
        with pytest.raises((UserError, KeyboardInterrupt)):
            write_folder_atomically(tmp_path, FILES)
        assert tree(tmp_path) == before

    @pytest.mark.parametrize("nth", [1, 2, 3])
    def test_new_folders_go_again(self, nth, tmp_path, monkeypatch):
        fail_at(monkeypatch, "replace", nth, FAILURES[0])
        with pytest.raises(UserError, match=r"^cannot write .*: No space left on device$"):
            write_folder_atomically(tmp_path / "x" / "y", FILES)
        assert tree(tmp_path) == {}

    def test_file_for_a_folder(self, tmp_path):
        (tmp_path / "file").write_bytes(b"mine")
        for folder in (tmp_path / "file", tmp_path / "file" / "sub"):
            with pytest.raises(UserError, match=r"a file is where its folder should be$"):
                write_folder_atomically(folder, FILES)
        assert tree(tmp_path) == {"file": b"mine"}

    def test_folder_for_a_file(self, tmp_path):
        (tmp_path / "c").mkdir()
        (tmp_path / "c" / "mine").write_bytes(b"kept")
        with pytest.raises(UserError, match=r"c: Is a directory$"):
            write_folder_atomically(tmp_path, FILES)
        assert tree(tmp_path) == {"c": None, "c/mine": b"kept"}

    @pytest.mark.parametrize("name", ["", "/a", "../a", "b/../../a", "b\\a"])
    def test_names_stay_inside(self, name, tmp_path):
        with pytest.raises(ValueError, match=r"^File name must stay inside its folder, not "):
            write_folder_atomically(tmp_path, {name: b""})
        assert tree(tmp_path) == {}

    def test_several_places(self, tmp_path):
        one, two = tmp_path / "one", tmp_path / "none" / "two"
        with pytest.raises(UserError):
            write_files_atomically({one: b"1", two: b"2"})
        assert tree(tmp_path) == {}


class TestProgress:
    def rows(self, stream: io.StringIO, seconds: float) -> list[str]:
        """Count 30 rows of so many seconds each."""
        now = 0.0
        with Progress(30, "rows", "milling", stream=stream, clock=lambda: now) as progress:
            for _ in range(30):
                now += seconds
                progress.advance()
        return stream.getvalue().splitlines()

    def test_silent_when_short_and_no_terminal(self):
        assert self.rows(io.StringIO(), 1.9 / 30) == []

    def test_lines_when_long_and_no_terminal(self):
        lines = ["milling: 2 of 30 rows, 00:28 left", "milling: 12 of 30 rows, 00:18 left",
                 "milling: 22 of 30 rows"]
        assert self.rows(io.StringIO(), 1) == lines

    def test_no_lines_on_a_terminal(self):
        assert self.rows(Terminal(), 1) == []


class TestCache:
    def test_another_where_none_can_be_kept(self, tmp_path, monkeypatch, capsys):
        (tmp_path / "file").write_text("")
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file" / "cache"))
        seen = []

        @command
        def main(argv) -> int:
            place = Path(os.environ["XDG_CACHE_HOME"])
            (place / "kept").write_text("something")
            seen.append(place)
            return 0

        assert main() == 0
        assert "set XDG_CACHE_HOME" in capsys.readouterr().err
        assert not seen[0].exists()
        assert os.environ["XDG_CACHE_HOME"] == str(tmp_path / "file" / "cache")

    def test_the_usual_one_where_it_can(self, tmp_path, monkeypatch, capsys):
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))

        @command
        def main(argv) -> int:
            return int(os.environ["XDG_CACHE_HOME"] != str(tmp_path / "cache"))

        assert main() == 0
        assert capsys.readouterr().err == ""


class TestStaged:
    def test_whole(self, tmp_path):
        with staged(tmp_path / "a") as place:
            place.write_text("all")
            assert not (tmp_path / "a").exists()
        assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"a": "all"}

    def test_or_not_at_all(self, tmp_path):
        (tmp_path / "a").write_text("before")
        with pytest.raises(KeyboardInterrupt), staged(tmp_path / "a") as place:
            place.write_text("half")
            raise KeyboardInterrupt
        assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"a": "before"}

    def test_nowhere(self, tmp_path):
        with pytest.raises(UserError, match="its folder does not exist"), staged(tmp_path / "b/a"):
            pass


@pytest.mark.parametrize(("kind", "shown"), [(io.StringIO, "making ...\n"), (Terminal, "0/3")])
def test_work_that_counts_nothing_is_named(monkeypatch, kind, shown):
    """On a terminal its bar is drawn again and again, as the time goes on."""
    monkeypatch.setattr(console, "PATIENCE", 0)
    monkeypatch.setattr(console, "BEAT", 0.01)
    stream, deadline = kind(), time.monotonic() + 30
    with console.Progress(3, "things", "making", stream=stream):
        while stream.getvalue().count(shown) < (3 if kind is Terminal else 1):
            assert time.monotonic() < deadline
            time.sleep(0.01)
    assert kind is Terminal or stream.getvalue() == shown


def test_closed_stdout(monkeypatch):
    monkeypatch.setattr(console.sys, "stdout", None)
    console.say("nobody hears this")
