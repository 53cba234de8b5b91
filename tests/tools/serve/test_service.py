# amaranth: UnusedElaboratable=no

"""A machine's serial line on a pseudo-terminal and by TCP: who talks, who hears, who is too much.

The machine is an echo, so that all who are connected hear what it was told.
"""

import asyncio
import os
import socket
import termios
import tty
from contextlib import asynccontextmanager, suppress

import pytest

from tb.boards import component
from tb.engines import AmaranthEngine
from tests.echo import Echo
from tests.tools.process import PATIENCE
from tools.console import UserError
from tools.serve import Service, running, service
from tools.serve.terminal import Terminal

BIT = 16


@asynccontextmanager
async def echo(speed=None, **options):
    engine = AmaranthEngine(component("echo", Echo(period=BIT)))
    async with asyncio.timeout(PATIENCE), Service(engine, BIT, speed=speed, **options) as served:
        try:
            yield served
        finally:
            while opened:
                (writer := opened.pop()).close()
                with suppress(ConnectionError):
                    await writer.wait_closed()


opened: list[asyncio.StreamWriter] = []


async def connect(served: Service) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Connect, until the machine is switched off."""
    reader, writer = await asyncio.open_connection("127.0.0.1", served.port)
    opened.append(writer)
    return reader, writer


class Program:
    """A program that has the pseudo-terminal open."""

    def __init__(self, path: str) -> None:
        self.file = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def close(self) -> None:
        os.close(self.file)

    async def hear(self, count: int) -> bytes:
        received = b""
        while len(received) < count:
            await asyncio.sleep(0.005)
            try:
                received += os.read(self.file, count - len(received))
            except BlockingIOError:
                pass
        return received


def test_a_program_on_the_terminal_talks_to_the_machine_byte_by_byte():
    async def session():
        async with echo() as served:
            program = Program(served.path)
            data = bytes(range(32))  # nothing is a command of the terminal, not even Ctrl-C
            os.write(program.file, data)
            assert await program.hear(len(data)) == data
            program.close()

    asyncio.run(session())


def test_who_comes_later_finds_nothing_of_who_was_there_before(monkeypatch):
    renew = Terminal._renew

    async def session():
        renewed = asyncio.Event()
        monkeypatch.setattr(Terminal, "_renew", lambda self: (renew(self), renewed.set()))
        async with echo(port=0) as served:
            first = Program(served.path)
            attributes = termios.tcgetattr(first.file)
            attributes[3] |= termios.ECHO | termios.ICANON
            termios.tcsetattr(first.file, termios.TCSANOW, attributes)
            reader, writer = await connect(served)
            os.write(first.file, b"secret\n")
            assert await reader.readline() == b"secret\n"
            renewed.clear()
            first.close()  # and has not read it
            writer.write(b"nobody has it open\n")
            assert (await reader.readuntil(b"open\n")).endswith(b"nobody has it open\n")
            await renewed.wait()
            writer.write(b"all is said\n")
            assert (await reader.readuntil(b"said\n")).endswith(b"all is said\n")
            second = Program(served.path)
            assert not termios.tcgetattr(second.file)[3] & (termios.ECHO | termios.ICANON)
            os.write(second.file, b"new\n")
            assert await second.hear(4) == b"new\n"
            second.close()

    asyncio.run(session())


def test_who_writes_and_closes_at_once_is_heard():
    async def session():
        async with echo(port=0) as served:
            reader, _ = await connect(served)
            for number in range(20):
                with open(served.path, "wb", buffering=0) as file:
                    file.write(b"%d\n" % number)
                assert await reader.readline() == b"%d\n" % number

    asyncio.run(session())


def test_lines_of_several_never_mix():
    async def session():
        async with echo(port=0) as served:
            everybody = [await connect(served) for _ in range(3)]

            async def speak(letter: str, writer) -> None:
                for _ in range(4):
                    for byte in f"{letter * 5}\n".encode():
                        writer.write(bytes([byte]))
                        await writer.drain()
                        await asyncio.sleep(0.001)

            letters = "abc"
            speaking = [asyncio.create_task(speak(letter, writer))
                        for letter, (_, writer) in zip(letters, everybody, strict=True)]
            lines = [[await reader.readline() for _ in range(12)] for reader, _ in everybody]
            await asyncio.gather(*speaking)
            assert lines[0] == lines[1] == lines[2]
            assert sorted(lines[0]) == sorted(f"{letter * 5}\n".encode()
                                              for letter in letters for _ in range(4))

    asyncio.run(session())


def test_who_does_not_end_a_line_loses_the_turn(monkeypatch):
    monkeypatch.setattr(service, "LINE_TIMEOUT_S", 0.05)
    monkeypatch.setattr(service, "LONGEST_LINE", 16)

    async def session():
        async with echo(port=0) as served:
            _, slow = await connect(served)
            reader, quick = await connect(served)
            slow.write(b"I think that")
            assert await reader.readexactly(12) == b"I think that"
            quick.write(b" yes\n")
            assert await reader.readline() == b" yes\n"
            # Nor can somebody talk for ever.
            slow.write(b"x" * 500)
            assert await reader.readexactly(1) == b"x"
            quick.write(b"stop\n")
            line = await reader.readuntil(b"stop\n")
            assert len(line) < 500

    asyncio.run(session())


def test_who_says_many_lines_at_once_takes_turns_at_their_ends(monkeypatch):
    """Of lengths that end nowhere near what is read at once."""
    monkeypatch.setattr(service, "LONGEST_LINE", 80)

    async def session():
        async with echo(port=0) as served:
            reader, one = await connect(served)
            _, two = await connect(served)
            sent = {writer: [f"{letter * 37}{n:02}\n".encode() for n in range(6)]
                    for letter, writer in (("a", one), ("b", two))}
            for writer, lines in sent.items():
                writer.write(b"".join(lines))
            received = [await reader.readline() for _ in range(12)]
            for lines in sent.values():
                assert [line for line in received if line in lines] == lines
            first = [line[:1] for line in received]
            assert len(set(first[:6])) == len(set(first[6:])) == 2  # neither had to wait for all

    asyncio.run(session())


def test_what_comes_too_fast_waits_and_is_not_lost(monkeypatch):
    monkeypatch.setattr(running, "MOST_WAITING", 16)

    async def session():
        async with echo(port=0) as served:
            reader, writer = await connect(served)
            data = b"".join(b"%05d\n" % n for n in range(20))
            writer.write(data)
            received = await reader.readexactly(len(data))
            assert received == data

    asyncio.run(session())


def test_who_does_not_read_is_cut_off_and_holds_nobody_up(monkeypatch):
    monkeypatch.setattr(service, "MOST_UNREAD", 100)

    async def session():
        async with echo(port=0) as served:
            deaf = socket.create_connection(("127.0.0.1", served.port))
            deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)
            while not served._clients:
                await asyncio.sleep(0.005)
            writer, = served._clients
            writer.transport.pause_reading()
            full = writer.transport.get_extra_info("socket")
            full.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1)
            for _ in range(1000):
                served._on_data(b"x" * 10_000, 1)
                await asyncio.sleep(0)
                if writer.is_closing():
                    break
            assert writer.is_closing()
            reader, writer = await connect(served)
            writer.write(b"me\n")
            assert await reader.readline() == b"me\n"
            deaf.close()

    asyncio.run(session())


def test_there_are_only_so_many_connections(monkeypatch):
    monkeypatch.setattr(service, "MOST_CLIENTS", 1)

    async def session():
        async with echo(port=0) as served:
            one, _ = await connect(served)
            two, _ = await connect(served)
            assert await two.read() == b"! too many connections\r\n"
            assert not one.at_eof()

    asyncio.run(session())


def test_a_port_that_is_taken_is_said_so():
    async def session():
        with socket.create_server(("127.0.0.1", 0)) as taken:
            with pytest.raises(UserError, match="is not available: choose another with --tcp"):
                async with echo(port=taken.getsockname()[1]):
                    pass

    asyncio.run(session())


def test_a_machine_that_fails_says_why(monkeypatch):
    async def session():
        async with echo() as served:
            def fail(clocks):
                raise RuntimeError("out of steam")

            monkeypatch.setattr(served._running._line, "run", fail)
            assert await served.ended == "the machine has ended: RuntimeError: out of steam"

    asyncio.run(session())


@pytest.mark.parametrize(("speed", "said"), [(1e12, 1), (10, 0)])
def test_time_that_falls_behind_is_said_once(monkeypatch, capsys, speed, said):
    monkeypatch.setattr(running, "LATE_S", 0.25)

    async def session():
        async with echo(speed=speed):
            await asyncio.sleep(1)

    asyncio.run(session())
    assert capsys.readouterr().err.count("simulated time has fallen seconds behind") == said


def test_the_terminal_hears_the_end():
    async def session():
        async with echo() as served:
            program = Program(served.path)
            tty.setraw(program.file)
        with pytest.raises(OSError):
            os.write(program.file, b"hello?")
        program.close()
        served._on_data(b"its last words", 1)  # were on their way through the loop

    asyncio.run(session())
