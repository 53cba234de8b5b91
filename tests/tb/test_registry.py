"""The registry of machines: those of a folder are known to every command, and to nothing before."""

import os
from pathlib import Path

import pytest

from tb.machines import VARIABLE, added, machines, split_option


def declare(folder: Path, name: str, text: str) -> Path:
    """Write the declaration of a machine; give the folder."""
    (folder / name).mkdir()
    (folder / name / "__init__.py").write_text(text)
    return folder


class TestFolders:
    @pytest.mark.parametrize(("text", "message"), [
        ("", "{file} has no MACHINE, a value of tb.machine.Machine"),
        ("import nothing_of_that_name", "{file}: ModuleNotFoundError: No module named "),
        ("from tb.machines.mill import MACHINE", "{file}: the machine is named mill, its folder m"),
    ])
    def test_a_wrong_declaration_is_named(self, tmp_path, text, message):
        file = declare(tmp_path, "m", text) / "m" / "__init__.py"
        before = machines()
        with pytest.raises(ValueError) as raised, added([tmp_path]):
            pass
        assert str(raised.value).startswith(message.format(file=file))
        assert list(machines()) == list(before)
        assert VARIABLE not in os.environ

    def test_a_name_is_given_once(self, tmp_path):
        declare(tmp_path, "mill", "from tb.machines.mill import MACHINE")
        with pytest.raises(ValueError, match="there is a machine mill already"), added([tmp_path]):
            pass

    @pytest.mark.parametrize(("folder", "message"), [
        ("nowhere", "is no folder of machines"), (".", "holds no machine")])
    def test_a_folder_without_machines(self, tmp_path, folder, message):
        with pytest.raises(ValueError, match=message), added([tmp_path / folder]):
            pass

    def test_the_option_is_taken_out(self):
        words = ["--machines", "a", "lines", "--machines=b", "--seed", "3", "--", "--machines"]
        assert split_option(words) == (["a", "b"], ["lines", "--seed", "3", "--", "--machines"])
        with pytest.raises(ValueError, match="--machines wants a folder"):
            split_option(["lines", "--machines"])
