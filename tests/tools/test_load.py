"""Loading a board, with what openFPGALoader prints."""

import json
from pathlib import Path

import pytest

from tools import load


@pytest.fixture
def built(tmp_path) -> Path:
    """Give a folder as a build leaves it."""
    return folder(tmp_path / "built", "icepi-zero", "single.bit")


def folder(path: Path, board: str, bitstream: str | None) -> Path:
    path.mkdir()
    (path / "report.json").write_text(json.dumps({"board": board, "bitstream": bitstream}))
    if bitstream:
        (path / bitstream).write_bytes(b"bits")
    return path


@pytest.fixture
def loader(monkeypatch):
    """Stand in for openFPGALoader; give what it is called with, and set what it answers."""
    calls: list[list[str]] = []
    answer = {"status": 0, "output": "Load SRAM: [====] 100.00%\nDone\n"}

    def run(command, where, on_line):
        calls.append(command)
        for line in answer["output"].splitlines(keepends=True):
            on_line(line)
        return answer["status"]

    monkeypatch.setattr(load, "run", run)
    monkeypatch.setattr(load, "installed", lambda program: True)
    return calls, answer


@pytest.mark.parametrize(("arguments", "words"), [
    ([], "openfpgaloader-cli -b icepi-zero -m single.bit"),
    (["--flash"], "openfpgaloader-cli -b icepi-zero -f single.bit"),
    (["--busdev-num", "1:7"], "openfpgaloader-cli --busdev-num 1:7 -b icepi-zero -m single.bit"),
])
def test_loads(built, loader, capsys, arguments, words):
    assert load.main([str(built), *arguments]) == 0
    assert loader[0] == [words.split()]
    assert ("for good" if "--flash" in arguments else "until its power goes"
            ) in capsys.readouterr().out


@pytest.mark.parametrize(("status", "output", "says"), [
    (1, "unable to open ftdi device: -3 (device not found)\nJTAG init failed\n",
     "no Icepi Zero 1.3 at USB: connect it with a cable that carries data (lsusb lists it as "
     "0403:6015)"),
    (1, "unable to open ftdi device: -4 (usb_open() failed)\n",
     'write the line ATTRS{idVendor}=="0403", ATTRS{idProduct}=="6015", MODE="664"'),
    (1, "unable to open ftdi device: -5 (unable to claim usb device)\n", "another program"),
    (127, "openFPGALoader: error while loading shared libraries: libftdi1.so.2: cannot open shared "
          "object file: No such file or directory\n",
     "openFPGALoader needs libftdi1.so.2: apt-get install libftdi1-2"),
    (1, "Error: wrong CRC\n", "openFPGALoader failed: Error: wrong CRC"),
    (1, "JTAG init failed with: no device found\n",
     "openFPGALoader failed: JTAG init failed with: no device found"),
    (3, "", "openFPGALoader failed: it says nothing"),
    (0, "Error: fail to erase SRAM\n", "openFPGALoader failed: Error: fail to erase SRAM"),
    (0, "Loading to CRAM: [====] 100.00%\nDone\nWait for CDONE\nFail\n",
     "openFPGALoader failed: Wait for CDONE Fail"),
    (0, "Done\nCRC check : FAIL\nRead: 0x00001234, checksum: 0x00004321\n",
     "openFPGALoader failed: Done CRC check : FAIL"),
    (0, "FAIL: unable to open 'x'\n", "openFPGALoader failed: FAIL: unable to open 'x'"),
])
def test_each_failure_says_what_to_do(built, loader, capsys, status, output, says):
    loader[1].update(status=status, output=output)
    assert load.main([str(built)]) == 2
    errors = capsys.readouterr().err
    assert says in errors and errors.count("\n") == 1


@pytest.mark.parametrize("line", [
    "Open file failsafe.bit DONE", "write to fail.bit", "cmsisDAP v2: try USB bulk init but failed",
    "Fail Flag No", "Error Code: 0"])
def test_the_exit_status_decides_what_a_word_alone_does_not(built, loader, capsys, line):
    loader[1].update(output=f"{line}\nDone\n")
    assert load.main([str(built)]) == 0
    assert capsys.readouterr().err == ""


def test_openfpgaloader_is_missing(built, monkeypatch, capsys):
    monkeypatch.setattr(load, "installed", lambda program: False)
    assert load.main([str(built)]) == 2
    assert "pip install -e '.[load]'" in capsys.readouterr().err


@pytest.mark.parametrize(("board", "bitstream", "arguments", "says"), [
    ("icebreaker", "single.bin", [], "loaded by its flash alone: add --flash"),
    ("nexys2-500", None, [], "see build.sh there"),
    ("lathe", "single.bin", [], "is for no board"),
    ("icepi-zero", None, [], "holds no bitstream: run python -m tools.build --board icepi-zero"),
])
def test_what_cannot_be_loaded(tmp_path, loader, capsys, board, bitstream, arguments, says):
    assert load.main([str(folder(tmp_path / "built", board, bitstream)), *arguments]) == 2
    assert says in capsys.readouterr().err and not loader[0]


@pytest.mark.parametrize("text", [None, "no json", "[]", "{}", '{"board": 3}',
                                  '{"board": "icepi-zero", "bitstream": "../x"}'])
def test_a_folder_of_something_else(tmp_path, loader, capsys, text):
    (tmp_path / "x").write_bytes(b"bits")
    path = tmp_path / "folder"
    path.mkdir()
    if text is not None:
        (path / "report.json").write_text(text)
    assert load.main([str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1 and not loader[0]
