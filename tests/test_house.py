"""The house stands as planned: floors, files, studies, front page."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

from magbear_cli.spec import read_study

ROOT = Path(__file__).parent.parent
PLANNED = {"pyproject.toml", "magbear_cli", "configs", "studies", "tests", "README.md", "LICENSE", "CHANGELOG.md"}
MODULES = sorted((ROOT / "magbear_cli").rglob("*.py"))


def test_imports_only_go_down() -> None:
    """Every import contract is kept."""
    command = [str(Path(sys.executable).with_name("lint-imports")), "--no-cache"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_top_level_is_as_planned() -> None:
    """Besides dot-folders there are only the files and folders of the plan."""
    try:
        listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout")
    top = {name.split("/")[0] for name in listed.splitlines()}
    assert {name for name in top if not name.startswith(".")} == PLANNED


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_module_answers_one_question(path: Path) -> None:
    """Each module has a docstring whose first line is a sentence, a name that is no drawer, and a bearable length."""
    text = path.read_text("utf-8")
    first = (ast.get_docstring(ast.parse(text)) or "").splitlines()[:1]
    assert first
    assert first[0].endswith((".", "?"))
    assert path.stem not in {"utils", "util", "helpers", "common", "misc"}
    assert text.count("\n") <= 400


@pytest.mark.parametrize("path", sorted((ROOT / "studies").rglob("*.yaml")), ids=lambda path: path.stem)
def test_every_study_is_legal(path: Path) -> None:
    """Each study that comes with the project can be read."""
    assert read_study(path).case_count >= 1


@pytest.mark.parametrize("arguments", [["--help"], ["check", str(ROOT / "studies" / "quickstart.yaml")]])
def test_light_commands_load_no_numerics(arguments: list[str]) -> None:
    """Help and checks do not import numpy."""
    script = (
        "import sys\nfrom magbear_cli.cli.main import main\n"
        f"try:\n    main({arguments!r})\nexcept SystemExit as end:\n    assert not end.code, end.code\n"
        "assert 'numpy' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_front_page_names_what_exists() -> None:
    """The README's commands, studies and methods are those of the code, and the gate runs its test command."""
    from magbear_cli.cli.main import COMMANDS
    from magbear_cli.spec.methods import METHODS

    page = (ROOT / "README.md").read_text("utf-8")
    for command in COMMANDS:
        assert f"`magbear {command}" in page
    for method in METHODS:
        name = method.model_fields["method"].annotation.__args__[0]  # type: ignore[union-attr]
        assert f"`{name}`" in page
    for study in re.findall(r"studies/\w+\.yaml", page):
        assert (ROOT / study).is_file()
    gate = (ROOT / ".ci" / "run").read_text("utf-8")
    assert 'install -q -e ".[test]"' in page
    assert 'install -q -e ".[test]"' in gate
    assert "pytest -n 2" in page
    assert 'pytest" -n 2' in gate
