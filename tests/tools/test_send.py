"""The command that sends jobs to a mill, against a model of the mill at the other end."""

import io
import os
import queue
import signal
import threading
import tty

import numpy as np
import pytest
from PIL import Image

from fresa_host.errors import LineLost
from fresa_host.port import Port
from tb.models.orders import OrdersModel
from tools import send
from tools.job import picture_orders, read_orders, write_orders

TEXT = "up\ngo 128 128\ndown\ngo 128 256\nup\ngo 0 0\n"


class Mill:
    """A mill, and the ports that lead to it. Orders are done as soon as they are told of."""

    def __init__(self) -> None:
        self.model, self.done, self.coming = OrdersModel(), [], b""
        self.at = {}  # what happens when so many orders are done
        self.reads = 0

    def __call__(self, name: str) -> "Mill":
        if name != "mill":
            raise LineLost(f"{name} cannot be opened")
        self.coming = b""
        return self

    waiting = False

    def write(self, data: bytes) -> None:
        self.coming += self.model.hear(data)

    def read(self) -> bytes:
        self.reads += 1
        if event := self.at.pop(len(self.done), None):
            event()
        if self.model.ledger.waiting and not self.model.error:
            kind, x, y = self.model.ledger.carry_out()
            self.done.append({2: f"go {x} {y}", 3: "up", 4: "down"}[kind])
        received, self.coming = self.coming, b""
        return received

    def close(self) -> None:
        pass


@pytest.fixture
def mill(monkeypatch):
    mill = Mill()
    monkeypatch.setattr("fresa_host.delivery.Port", mill)
    monkeypatch.setattr("fresa_host.orders.QUIET", 0.001)
    monkeypatch.setattr("fresa_host.delivery.RETRY_S", 0.001)
    monkeypatch.setattr("fresa_host.orders.PAUSE", 0.001)
    return mill


@pytest.fixture
def job(tmp_path):
    path = tmp_path / "job.txt"
    path.write_text(TEXT)
    return path


class Terminal(io.StringIO):
    """A terminal at which lines are typed, and at last nothing more."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: queue.Queue[str] = queue.Queue()

    def isatty(self) -> bool:
        return True

    def __iter__(self):
        return iter(self.lines.get, "")


@pytest.fixture
def typed(monkeypatch):
    """Give what is typed: lines, to be put."""
    terminal = Terminal()
    monkeypatch.setattr("sys.stdin", terminal)
    yield terminal.lines
    terminal.lines.put("")


@pytest.fixture
def half_done(mill, monkeypatch, tmp_path, capsys):
    """Give a mill that has done two orders of another job, which was ended."""
    other = tmp_path / "other.txt"
    other.write_text("up\ngo 9 9\ngo 8 8\ngo 7 7\n")
    mill.at = {2: lambda: signal.raise_signal(signal.SIGINT)}
    with monkeypatch.context() as patch:
        patch.setattr("sys.stdin", None)
        assert run(other, "--port", "mill") == 130
    capsys.readouterr()
    return mill


def run(*arguments: object) -> int:
    return send.main([str(argument) for argument in arguments])


class TestAnotherJob:
    def test_is_not_thrown_away_where_nobody_answers(self, half_done, job, monkeypatch, capsys):
        monkeypatch.setattr("sys.stdin", None)
        before, session = list(half_done.done), half_done.model.ledger.session
        assert run(job, "--port", "mill") == 2
        err = capsys.readouterr().err
        assert "has done another job up to its order" in err and "--force" in err
        assert err.count("error: ") == 1 and half_done.done == before
        assert half_done.model.ledger.session == session

    @pytest.mark.parametrize("answer", ["\n", "no\n", ""])
    def test_is_not_thrown_away_for_another_answer_than_yes(self, half_done, job, typed, answer):
        before = list(half_done.done)
        typed.put(answer)
        assert run(job, "--port", "mill") == 2
        assert half_done.done == before

    def test_is_thrown_away_for_yes(self, half_done, job, typed, capsys):
        before = len(half_done.done)
        typed.put("y\n")
        assert run(job, "--port", "mill") == 0
        assert half_done.done[before:] == TEXT.splitlines()
        assert "y and Return begin it all the same" in capsys.readouterr().err

    def test_is_thrown_away_by_force(self, half_done, job):
        before = len(half_done.done)
        assert run(job, "--port", "mill", "--force") == 0
        assert half_done.done[before:] == TEXT.splitlines()


class TestSend:
    def test_a_list_of_orders(self, mill, job, capsys):
        assert run(job, "--port", "mill") == 0
        assert mill.done == TEXT.splitlines()
        assert "done: 6 orders" in capsys.readouterr().out

    def test_a_picture(self, mill, tmp_path):
        pixels = np.zeros((5, 6), bool)
        pixels[1:3, 2:5] = True
        Image.fromarray(~pixels).save(tmp_path / "small.png")
        assert run(tmp_path / "small.png", "--port", "mill") == 0
        assert mill.done == list(map(str, picture_orders(pixels)))

    def test_a_port_that_is_none_is_told_before_the_picture_is_prepared(self, mill, tmp_path,
                                                                        capsys):
        Image.new("1", (6, 5)).save(tmp_path / "small.png")
        assert run(tmp_path / "small.png", "--port", "other") == 2
        printed = capsys.readouterr()
        assert printed.err == "error: other cannot be opened\n" and not printed.out

    def test_orders_are_written_instead(self, mill, job, tmp_path):
        out = tmp_path / "out.txt"
        assert run(job, "-o", out) == 0
        assert not mill.done
        assert read_orders(out) == read_orders(job)
        assert out.read_bytes() == write_orders(read_orders(job))

    def test_from_a_stroke(self, mill, job):
        assert run(job, "--port", "mill", "--from", 6) == 0
        assert mill.done == TEXT.splitlines()[4:]

    def test_unplugged_in_the_middle(self, mill, job, capsys):
        def unplug():
            raise LineLost("unplugged")

        mill.at = {2: unplug, 4: unplug}
        assert run(job, "--port", "mill") == 0
        assert mill.done == TEXT.splitlines()
        assert capsys.readouterr().err.count("waiting for it") == 2

    def test_without_a_keyboard_ctrl_c_ends_it(self, mill, job, monkeypatch, capsys):
        monkeypatch.setattr("sys.stdin", None)
        mill.at = {2: lambda: signal.raise_signal(signal.SIGINT)}
        assert run(job, "--port", "mill") == 130
        assert "the same command goes on" in capsys.readouterr().out
        assert run(job, "--port", "mill") == 0
        assert mill.done == TEXT.splitlines()

    def test_ctrl_c_pauses_and_ends_and_the_same_command_goes_on(self, mill, job, typed, capsys):
        def interrupt():
            signal.raise_signal(signal.SIGINT)
            mill.at = {n: lambda: signal.raise_signal(signal.SIGINT) for n in range(2, 7)}

        mill.at = {2: interrupt}
        before = signal.getsignal(signal.SIGINT)
        assert run(job, "--port", "mill") == 130
        assert signal.getsignal(signal.SIGINT) is before
        printed = capsys.readouterr()
        assert "paused, " in printed.err and "the same command goes on" in printed.out
        assert 2 <= len(mill.done) < 6

        mill.at = {}
        assert run(job, "--port", "mill") == 0
        assert mill.done == TEXT.splitlines()
        assert "going on behind order" in capsys.readouterr().err

    def test_p_pauses_and_return_goes_on(self, mill, job, typed, monkeypatch, capsys):
        listened = []
        listening = send.Keyboard.listening

        def keyboard(self):
            listened.append(self)
            return listening(self)

        def enter(line):
            listened[0]._lines.put(line)
            mill.at = {} if line == "" else {len(mill.done) + 1: lambda: enter("")}

        monkeypatch.setattr(send.Keyboard, "listening", keyboard)
        mill.at = {1: lambda: enter("p")}
        assert run(job, "--port", "mill") == 0
        assert mill.done == TEXT.splitlines()
        err = capsys.readouterr().err
        assert err.index("paused") < err.index("going on")

    def test_a_reset_ends_it_and_says_how_to_go_on(self, mill, job, capsys):
        mill.at = {2: mill.model.ledger.reset}
        assert run(job, "--port", "mill") == 1
        out = capsys.readouterr().out
        assert "was reset" in out and "2 of 6 orders" in out and "--from 3" in out

    @pytest.mark.parametrize("what", ["error", "stopped"])
    def test_what_the_mill_reports(self, mill, job, capsys, what):
        mill.at = {2: lambda: setattr(mill.model, what, 1)}
        assert run(job, "--port", "mill") == 1
        assert "reset it with BTN0" in capsys.readouterr().out

    def test_a_mill_that_never_answers(self, mill, job, monkeypatch, capsys):
        monkeypatch.setattr(send, "ANSWER_TIMEOUT_S", 0.05)
        monkeypatch.setattr(mill.model, "hear", lambda data: b"")
        assert run(job, "--port", "mill") == 2
        assert "does not answer" in capsys.readouterr().err

    @pytest.mark.parametrize(("arguments", "message"), [
        ([], "either --port"), (["--port", "mill", "-o", "x.txt"], "either --port"),
        (["--port", "other"], "cannot be opened"), (["--port", "mill", "--from", "7"], "--from 7"),
        (["--port", "mill", "--from", "0"], "whole number from 1"),
        (["-o", "/no/such/folder/x.txt"], "folder does not exist"),
        (["-o", "x.txt", "--from", "2"], "leave out --from, --again and --force"),
        (["-o", "x.txt", "--again"], "leave out --from, --again and --force"),
        (["-o", "x.txt", "--force"], "leave out --from, --again and --force"),
        (["--port", "mill", "--size", "9x9"], "is a list of orders: leave out"),
        (["--port", "mill", "--thin"], "is a list of orders: leave out"),
    ])
    def test_one_line_and_nothing_sent(self, mill, job, capsys, arguments, message):
        assert run(job, *arguments) == 2
        err = capsys.readouterr().err
        assert message in err and err.count("\n") == 1
        assert not mill.done

    def test_a_cut_that_would_be_refused_is_refused_before(self, mill, job, capsys):
        for text, message in [("go 1 1\ndown\ngo 3 4\n", "order 3, go 3 4"),
                           ("down\ngo 0 4\n", "order 1, down: the place is unknown")]:
            job.write_text(text)
            assert run(job, "--port", "mill") == 2
            assert message in capsys.readouterr().err
        assert not mill.done

    def test_a_list_that_does_not_raise_the_tool_is_made_to(self, mill, job, tmp_path):
        job.write_text("go 3 4\ndown\n")
        assert run(job, "--port", "mill") == 0
        assert mill.done == ["up", "go 3 4", "down"]
        assert run(job, "--port", "mill", "--again", "--from", 3) == 0
        assert mill.done[3:] == mill.done[:3]
        assert run(job, "-o", tmp_path / "out.txt") == 0
        assert (tmp_path / "out.txt").read_text() == "up\ngo 3 4\ndown\n"

    def test_what_goes_on_after_an_end_is_said(self, mill, job, typed, capsys):
        def interrupt():
            signal.raise_signal(signal.SIGINT)
            mill.at = {n: lambda: signal.raise_signal(signal.SIGINT) for n in range(3)}

        mill.at = {0: interrupt}
        assert run(job, "--port", "mill", "--from", 6, "--again") == 130
        assert "the same command without --from and --again goes on" in capsys.readouterr().out
        mill.at = {}
        assert run(job, "--port", "mill") == 0
        assert mill.done == TEXT.splitlines()[4:]

    def test_no_such_job(self, mill, tmp_path, capsys):
        for name in ("none.txt", "none.png"):
            assert run(tmp_path / name, "--port", "mill") == 2
        assert capsys.readouterr().err.count("error: ") == 2


def test_a_terminal_that_is_gone_is_not_opened_again(mill, job, monkeypatch, capsys):
    """It may be the window of anybody by then."""
    def end():
        raise LineLost("/dev/pts/7 is gone: Input/output error")

    opened = []
    monkeypatch.setattr("fresa_host.delivery.Port", lambda name: opened.append(name) or mill)
    mill.at = {2: end}
    assert run(job, "--port", "/dev/pts/7") == 1
    out = capsys.readouterr().out
    assert "/dev/pts/7 is gone, and comes back by another name: use the one that" in out
    assert opened == ["/dev/pts/7"]


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")
def test_by_pyserial_over_a_terminal(job, capsys):
    """The whole of it, with the model behind a real port, which only one can have open."""
    machine, port = os.openpty()
    tty.setraw(machine)
    model, done = OrdersModel(), []

    def serve() -> None:
        while len(done) < 6 or model.ledger.session:
            answer = model.hear(os.read(machine, 64))
            while model.ledger.waiting:
                done.append(model.ledger.carry_out())
            os.write(machine, answer)

    name = os.ttyname(port)
    other = Port(name)
    assert run(job, "--port", name) == 2
    assert f"{name} cannot be opened: this program has it open already" in capsys.readouterr().err
    other.close()
    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    assert run(job, "--port", name) == 0
    thread.join(10)
    os.close(port)
    os.close(machine)
    assert [kind for kind, _, _ in done] == [3, 2, 4, 2, 3, 2]
    assert done[1] == (2, 128, 128)
    assert "done: 6 orders" in capsys.readouterr().out
