"""The command that prepares a picture: its files, its words, its refusals."""

import argparse
import json
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tools import image
from tools.console import Parser, UserError
from tools.machines.job import BOARDS
from tools.machines.mill import check_memory, largest_square
from tools.picture import prepare

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"


def read(path) -> np.ndarray:
    """What a one-bit picture tells the machine to mill."""
    with Image.open(path) as picture:
        assert picture.mode == "1"
        return ~np.asarray(picture)


def names(folder) -> set[str]:
    return {path.name for path in folder.iterdir()}


@pytest.fixture
def gradient(tmp_path):
    """A picture of 16 x 2 whose grey grows by 16 from column to column."""
    path = tmp_path / "gradient.png"
    Image.fromarray(np.tile(np.arange(16, dtype=np.uint8) * 16, (2, 1))).save(path)
    return path


class TestFiles:
    def test_beside_the_picture(self, gradient, tmp_path, capsys):
        assert image.main([str(gradient)]) == 0
        assert names(tmp_path) == {"gradient.png", "gradient-mill.png", "gradient-preview.png"}
        assert read(tmp_path / "gradient-mill.png").tolist() == [[True] * 8 + [False] * 8] * 2
        out, err = capsys.readouterr()
        assert out.splitlines() == [
            "16 x 2 pixels, 8.9 x 1.1 mm, 16 to mill (50.0%), threshold 119 (found), scale 1",
            f"wrote {tmp_path / 'gradient-mill.png'}",
            f"wrote {tmp_path / 'gradient-preview.png'}",
        ]
        assert err == ""

    def test_pictures_that_differ_in_their_ending_alone(self, tmp_path):
        for number, ending in enumerate(("png", "jpg", "gif", "PNG", "jpg.png")):
            grey = np.full((8, 8 * (number + 1)), 255, np.uint8)
            grey[:, :8] = 0
            Image.fromarray(grey).save(tmp_path / f"photo-{number}.{ending}")
            (tmp_path / f"photo-{number}.{ending}").rename(tmp_path / f"photo.{ending}")
        for ending in ("png", "jpg", "gif", "PNG"):
            assert image.main([str(tmp_path / f"photo.{ending}")]) == 0
        widths = [read(tmp_path / f"photo{ending}-mill.png").shape[1]
                  for ending in ("", ".jpg", ".gif", ".PNG")]
        assert widths == [8, 16, 24, 32] and len(names(tmp_path)) == 5 + 2 * 4

    def test_all_files(self, gradient, tmp_path):
        cut, look, facts = (tmp_path / name for name in ("cut.png", "look.png", "facts.json"))
        argv = [str(gradient), "-o", str(cut), "--preview", str(look), "--json", str(facts)]
        assert image.main(argv) == 0
        assert names(tmp_path) == {"gradient.png", "cut.png", "look.png", "facts.json"}
        assert json.loads(facts.read_text())["pixels"] == read(cut).sum() == 16
        with Image.open(look) as picture:
            assert min(picture.size) > 16

    def test_own_output_is_taken_as_it_is(self, gradient, tmp_path):
        once, twice = tmp_path / "once.png", tmp_path / "twice.png"
        assert image.main([str(gradient), "-o", str(once)]) == 0
        assert image.main([str(once), "-o", str(twice)]) == 0
        assert once.read_bytes() == twice.read_bytes()


class TestOptions:
    @pytest.mark.parametrize(
        ("argv", "options"),
        [
            ([], {}),
            (["--threshold", "otsu"], {}),
            (["--threshold", "40"], {"threshold": 40}),
            (["--size", "7x3"], {"width": 7, "height": 3}),
            (["--size", "40X20", "--enlarge"], {"width": 40, "height": 20, "enlarge": True}),
            (["--size", "7x3", "--keep-lines"], {"width": 7, "height": 3, "keep_lines": True}),
            (["--invert"], {"invert": True}),
            (["--outline"], {"outline": True}),
            (["--thin"], {"thin": True}),
            (["--turn", "90"], {"turn": 90}),
            (["--mirror", "horizontal"], {"mirror": "horizontal"}),
            (["--mirror", "vertical", "--turn", "270"], {"mirror": "vertical", "turn": 270}),
        ],
    )
    def test_reach_the_picture(self, argv, options, tmp_path):
        grey = np.random.default_rng(1).integers(0, 256, (9, 20), np.uint8)
        path = tmp_path / "noise.png"
        Image.fromarray(grey).save(path)
        parser = Parser()
        parser.add_argument("--image", type=Path)
        image.add_picture_arguments(parser)
        got = image.picture_from_arguments(parser.parse_args(["--image", str(path), *argv]))
        expected = prepare(Image.fromarray(grey), **options)
        assert got.facts() == expected.facts()
        assert (got.pixels == expected.pixels).all()

    def test_any_parser_will_do(self):
        parser = argparse.ArgumentParser()
        image.add_picture_arguments(parser)
        assert parser.parse_args(["--size", "512x1"]).size == (512, 1)

    def test_every_board_holds_its_default(self):
        """400 x 400 where it can, and as much as it can elsewhere."""
        sides = {name: largest_square(board.capacity) for name, board in BOARDS.items() if board}
        for name, side in sides.items():
            board = BOARDS[name]
            assert board is not None
            check_memory(prepare(Image.new("L", (side, side))), board.capacity, name)
            if side < 400:
                with pytest.raises(UserError, match=f"--size {side}x{side}"):
                    check_memory(prepare(Image.new("L", (side + 10, side + 10))), board.capacity,
                                 name)
        assert sides["nexys2-500"] == sides["tang-nano-9k"] == 400 and sides["icebreaker"] == 240

    @pytest.mark.parametrize(
        ("argv", "message"),
        [
            (["--size", "513x1"], "columns and rows from 1x1 to 512x512"),
            (["--size", "0x1"], "columns and rows from 1x1 to 512x512"),
            (["--size", "100"], "columns and rows from 1x1 to 512x512"),
            (["--size=-1x5"], "columns and rows from 1x1 to 512x512"),
            (["--size", "9" * 5000 + "x1"], "--size"),
            (["--threshold", "256"], "must be 'otsu' or 0 to 255, not '256'"),
            (["--threshold", "dark"], "must be 'otsu' or 0 to 255, not 'dark'"),
            (["--turn", "45"], "--turn"),
            (["--mirror", "up"], "--mirror"),
            (["--outline", "--thin"], "not allowed with"),
            (["--colour"], "unrecognized arguments: --colour"),
        ],
    )
    def test_refused(self, argv, message, gradient, tmp_path, capsys):
        assert image.main([str(gradient), *argv]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert err.startswith("error: ") and message in err and err.count("\n") == 1
        assert names(tmp_path) == {"gradient.png"}


class TestRefusals:
    def refused(self, argv, capsys) -> str:
        assert image.main([str(arg) for arg in argv]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert err.startswith("error: ") and err.endswith("\n") and err.count("\n") == 1
        return err

    @pytest.mark.parametrize(
        ("data", "message"),
        [
            (None, "there is no file"),
            (b"", "is empty"),
            (b"a letter, not a picture", "is not a picture"),
            ((EXAMPLES / "strawberry.png").read_bytes()[:200], "is damaged or cut short"),
        ],
        ids=["missing", "empty", "text", "truncated"],
    )
    def test_bad_picture(self, data, message, tmp_path, capsys):
        path = tmp_path / "picture.png"
        if data is not None:
            path.write_bytes(data)
        before = names(tmp_path)
        assert message in self.refused([path], capsys)
        assert names(tmp_path) == before

    @pytest.mark.parametrize("folder", ["", ".", "..", "/"])
    def test_folder(self, folder, tmp_path, monkeypatch, capsys):
        monkeypatch.chdir(tmp_path)
        assert "is a folder" in self.refused([folder], capsys)
        assert names(tmp_path) == set()

    def test_nothing_to_mill(self, tmp_path, capsys):
        Image.new("L", (1, 1), 255).save(tmp_path / "white.png")
        error = self.refused([tmp_path / "white.png", "--json", tmp_path / "facts"], capsys)
        assert "nothing to mill: the picture is one grey all over" in error
        assert names(tmp_path) == {"white.png"}

    def test_the_picture_is_never_overwritten(self, gradient, tmp_path, monkeypatch, capsys):
        before = gradient.read_bytes()
        (tmp_path / "soft.png").symlink_to(gradient)
        (tmp_path / "hard.png").hardlink_to(gradient)
        monkeypatch.chdir(tmp_path)
        ways = ("gradient.png", f"../{tmp_path.name}/gradient.png", "soft.png", "hard.png")
        for option in ("-o", "--preview", "--json"):
            for name in ways:
                assert "is what is read" in self.refused([gradient, option, name], capsys)
        assert gradient.read_bytes() == before
        assert names(tmp_path) == {"gradient.png", "soft.png", "hard.png"}

    def test_two_things_to_one_place(self, gradient, tmp_path, capsys):
        same = tmp_path / "same.png"
        assert "used twice" in self.refused([gradient, "-o", same, "--preview", same], capsys)
        assert "used twice" in self.refused([gradient, "-o", same, "--json", same], capsys)
        assert names(tmp_path) == {"gradient.png"}

    @pytest.mark.parametrize("option", ["-o", "--preview"])
    def test_name_of_another_kind(self, option, gradient, tmp_path, capsys):
        error = self.refused([gradient, option, tmp_path / "cut.jpg"], capsys)
        assert "ends in .png" in error
        assert names(tmp_path) == {"gradient.png"}

    @pytest.mark.parametrize("option", ["-o", "--preview", "--json"])
    @pytest.mark.parametrize(
        ("place", "message"),
        [("gradient.png/x.png", "a file is where its folder should be"),
         ("none/x.png", "its folder does not exist"),
         ("folder.png", "it is a folder")],
    )  # fmt: skip
    def test_cannot_write(self, option, place, message, gradient, tmp_path, capsys):
        """Not one of the three files is there when one of them cannot be written."""
        (tmp_path / "folder.png").mkdir()
        files = {"-o": "a.png", "--preview": "b.png", "--json": "c.json"} | {option: place}
        argv = [gradient, *(arg for key, name in files.items() for arg in (key, tmp_path / name))]
        assert message in self.refused(argv, capsys)
        assert names(tmp_path) == {"gradient.png", "folder.png"}
        assert names(tmp_path / "folder.png") == set()


class TestCommandLine:
    def test_runs_as_a_module(self, gradient, tmp_path):
        argv = [sys.executable, "-m", "tools.image", str(gradient), "--turn", "5"]
        run = subprocess.run(argv, cwd=ROOT, capture_output=True, text=True)
        assert (run.returncode, run.stdout) == (2, "")
        assert run.stderr.startswith("error: argument --turn")

    def test_help_teaches(self, capsys):
        with pytest.raises(SystemExit) as done:
            image.main(["--help"])
        assert done.value.code == 0
        out, _ = capsys.readouterr()
        assert "examples:\n  python -m tools.image photo.jpg\n" in out

    def test_examples_in_the_help_run(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        lines = [line.split() for line in image.EXAMPLES.splitlines() if " -m " in line]
        assert len(lines) >= 5
        with Image.open(EXAMPLES / "photo.png") as photo:
            for line in lines:
                photo.save(line[3])
                assert image.main(line[3:]) == 0


class TestExamples:
    def test_are_what_the_script_draws(self, tmp_path, monkeypatch):
        monkeypatch.setattr(sys, "argv", ["draw.py", str(tmp_path)])
        runpy.run_path(str(EXAMPLES / "draw.py"), run_name="__main__")
        assert names(tmp_path) == {path.name for path in EXAMPLES.glob("*.png")}
        for path in tmp_path.iterdir():
            with Image.open(path) as drawn, Image.open(EXAMPLES / path.name) as kept:
                assert np.array_equal(np.asarray(drawn), np.asarray(kept)), path.name

    @pytest.mark.parametrize("name", ["strawberry", "geometry", "photo"])
    def test_can_be_milled(self, name, tmp_path):
        path = EXAMPLES / f"{name}.png"
        assert path.stat().st_size < 100_000
        assert image.main([str(path), "-o", str(tmp_path / "cut.png")]) == 0

    def test_strawberry_is_drawn_in_lines(self):
        pixels = read(EXAMPLES / "strawberry.png")
        assert pixels.shape == (64, 64)
        assert 300 <= pixels.sum() <= 450
