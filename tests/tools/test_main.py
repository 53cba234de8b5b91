"""The list of commands, and both ways to call one: `python -m tools.NAME` and `fresa NAME`."""

import ast
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from tools.__main__ import commands, main

ROOT = Path(__file__).parents[2]
LAUNCHER = ROOT / "launcher" / "fresa_launcher.py"


def fresa(*arguments: object, cwd: Path, launcher: Path = LAUNCHER) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, launcher, *map(str, arguments)], cwd=cwd, text=True,
                          capture_output=True)


def lists_all(text: str) -> bool:
    for name, about in commands().items():
        line, = (line for line in text.splitlines() if line.startswith(f"  {name} "))
        assert line.endswith(about) and len(line) <= 100
    return True


@pytest.mark.parametrize("arguments", [[], ["--help"]])
def test_every_module_that_is_a_command_is_listed(arguments, capsys, tmp_path):
    assert {"bench", "build", "image", "simulate"} <= set(commands())
    assert not {"console", "picture", "__main__", "__init__"} & set(commands())
    assert all(about.endswith(".") for about in commands().values())
    if arguments:
        with pytest.raises(SystemExit, match="^0$"):
            main(arguments)
    else:
        assert main(arguments) == 0
    out = capsys.readouterr().out
    assert lists_all(out) and "\npython -m tools.NAME runs one" in out
    by_launcher = fresa(*arguments, cwd=tmp_path)
    assert by_launcher.returncode == 0 and not by_launcher.stderr
    assert lists_all(by_launcher.stdout) and "\nfresa NAME runs one" in by_launcher.stdout
    assert "python -m" not in by_launcher.stdout


def test_a_new_command_is_found_by_itself(tmp_path):
    guard = 'if __name__ == "__main__":\n    pass\n'
    (tmp_path / "new.py").write_text(f'"""Do something new.\n\nAnd more.\n"""\n\n{guard}')
    (tmp_path / "plain.py").write_text(guard)
    (tmp_path / "library.py").write_text('"""What commands share."""\n')
    assert commands(tmp_path) == {"new": "Do something new.", "plain": ""}


def test_every_command_has_a_main_that_takes_arguments():
    """The launcher imports a command and calls this."""
    for name in commands():
        path = ROOT / "tools" / name
        path = path / "__main__.py" if path.is_dir() else path.with_suffix(".py")
        made = [node for node in ast.parse(path.read_text("utf-8")).body
                if isinstance(node, ast.FunctionDef) and node.name == "main"]
        assert [[argument.arg for argument in node.args.args] for node in made] == [["argv"]], name


@pytest.mark.parametrize(("name", "advice"), [
    ("bild", "there is no command 'bild'; did you mean build?"),
    ("zzz", f"there is no command 'zzz'; there are {', '.join(commands())}"),
])
def test_unknown_command(name, advice, capsys):
    assert main([name, "--png", "x.png"]) == 2
    out, err = capsys.readouterr()
    assert not out and err == f"error: {advice}\n"


def test_listing_imports_nothing_heavy():
    code = ("import sys, tools.__main__ as m; m.main([])\n"
            "sys.exit(bool({'amaranth', 'numpy', 'PIL', 'tb'} & set(sys.modules)))")
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, check=True)


@pytest.mark.parametrize(("name", "module"), [
    ("wave find", "tools.wave"),
    *(pytest.param(name, f"tools.{name}", marks=pytest.mark.long) for name in ("build", "bench"))])
def test_help_and_errors_name_the_command_as_it_was_typed(name, module, tmp_path):
    name, *subcommand = name.split()
    help_, wrong = [*subcommand, "--help"], [*subcommand, "--no-such-option"]
    for run, typed in [(lambda *a: fresa(name, *a, cwd=tmp_path), f"fresa {name}"),
                       (lambda *a: subprocess.run([sys.executable, "-m", module, *a], cwd=ROOT,
                                                  text=True, capture_output=True),
                        f"python -m {module}")]:
        prog = " ".join([typed, *subcommand])
        shown, failed = run(*help_), run(*wrong)
        assert shown.returncode == 0 and shown.stdout.startswith(f"usage: {prog} ")
        assert f"\n  {prog}" in shown.stdout.partition("\nexamples:\n")[2]
        called = set(re.findall(r"python\s+-m\s+t(?:b|ools)\b", shown.stdout))
        assert bool(called) == typed.startswith("python")
        assert failed.returncode == 2 and f"(see {typed} " in failed.stderr


def test_launcher_works_in_the_folder_of_the_caller(tmp_path):
    Image.linear_gradient("L").resize((9, 9)).save(tmp_path / "grey.png")
    done = fresa("image", "grey.png", "-o", "mill.png", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert {path.name for path in tmp_path.iterdir()} == {
        "grey.png", "mill.png", "mill-preview.png"}
    assert fresa("image", "none.png", cwd=tmp_path).returncode == 2


def test_launcher_passes_control_c_on(tmp_path):
    code = ("import runpy, sys\nsys.path.insert(0, sys.argv[1])\nimport tools.image\n"
            "def interrupted(argv): raise KeyboardInterrupt\n"
            "tools.image.main = interrupted\n"
            "launcher = sys.argv[2]; sys.argv[1:] = ['image']\n"
            "sys.exit(runpy.run_path(launcher)['main']())")
    done = subprocess.run([sys.executable, "-c", code, ROOT, LAUNCHER], cwd=tmp_path, text=True,
                          capture_output=True)
    assert (done.returncode, done.stderr) == (130, "error: interrupted\n")


def test_launcher_without_a_checkout_says_what_it_needs(tmp_path):
    (tmp_path / "site-packages").mkdir()
    alone = shutil.copy(LAUNCHER, tmp_path / "site-packages")
    done = fresa("build", cwd=ROOT, launcher=Path(alone))
    assert done.returncode == 2 and not done.stdout
    assert done.stderr == ("error: the commands need a checkout of Fresa: "
                           "run  pip install -e .  in one\n")
