"""The house stands as planned: floors, files, studies, front page."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, get_args, get_origin

import pytest

from magbear_cli.spec import read_study

ROOT = Path(__file__).parent.parent
PLANNED = {"pyproject.toml", "magbear_cli", "configs", "studies", "tests", "README.md", "LICENSE", "CHANGELOG.md"}
MODULES = sorted((ROOT / "magbear_cli").rglob("*.py"))
TESTS = sorted((ROOT / "tests").rglob("test_*.py"))
DRAWERS = {"utils", "util", "helpers", "helper", "common", "misc"}


def test_imports_only_go_down() -> None:
    """Every import contract is kept."""
    command = [str(Path(sys.executable).with_name("lint-imports")), "--no-cache"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_top_level_is_as_planned() -> None:
    """Besides dot-folders there are only the files and folders of the plan."""
    top = {name.split("/")[0] for name in _kept_files()}
    assert {name for name in top if not name.startswith(".")} == PLANNED


def test_no_file_knows_the_machine_it_was_written_on() -> None:
    """No kept text holds a path into someone's home or a scratch folder."""
    place = re.compile(r"/(?:tmp|home|root|work|Users)/")
    found = {name for name in _kept_files() if place.search((ROOT / name).read_text("utf-8"))}
    assert not found


def _kept_files() -> list[str]:
    """The names of the files that git keeps and that are still there."""
    try:
        listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout")
    return [name for name in listed.splitlines() if (ROOT / name).is_file()]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_module_answers_one_question(path: Path) -> None:
    """Each module has a docstring whose first line is a sentence, a name that is no drawer, and a bearable length."""
    text = path.read_text("utf-8")
    first = (ast.get_docstring(ast.parse(text)) or "").splitlines()[:1]
    assert first
    assert first[0].endswith((".", "?"))
    assert not DRAWERS & {path.stem, *path.relative_to(ROOT).parts}
    assert text.count("\n") <= 400


@pytest.mark.parametrize("path", TESTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_test_says_what_must_be_true(path: Path) -> None:
    """Each test has a docstring whose first line is a sentence, and lives in a folder named after a room."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            assert (ast.get_docstring(node) or "").splitlines()[:1][0].endswith((".", "?")), node.name
    room = path.relative_to(ROOT / "tests").parts[0]
    assert room in {path.name, "campaigns"} or (ROOT / "magbear_cli" / room).is_dir()


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
    for file in re.findall(r"`([.\w/-]+\.(?:md|py))`", page):
        assert (ROOT / file).is_file() or file == "errors.py", file


def test_the_front_page_explains_every_key() -> None:
    """The README lists each key of a study file with its default and its meaning, as the types have them."""
    page = (ROOT / "README.md").read_text("utf-8")
    rows = "\n".join(_key_rows())
    assert rows in page, f"the table of keys should be\n{rows}"


def test_the_front_page_names_every_json_key() -> None:
    """Each key that a document of a case, of a step or of a limit may hold is in the README."""
    from magbear_cli.errors import Status
    from magbear_cli.study.limit_curves import curve_document
    from magbear_cli.study.outcome import CaseOutcome, StepOutcome
    from magbear_cli.study.summary import case_document, step_document

    step = StepOutcome(3.0, 1e-5, "linear", "hinf", {}, "finished", "", *[None] * 5, *[None] * 6)  # type: ignore[arg-type]
    inputs = {"controller": {"method": "hinf"}, "mass_kg": 3.0}
    case = CaseOutcome("0", 0, inputs, Status.FAILED)
    documents = case_document(case), step_document(step), curve_document(case, {})
    page = (ROOT / "README.md").read_text("utf-8")
    for key in {key for document in documents for key in document}:
        assert f"`{key}`" in page, key


def _key_rows() -> Iterator[str]:
    """The README's table of keys: dotted key, method that it belongs to, default, meaning and choice."""
    from magbear_cli.spec.models import SECTIONS

    for path, kinds in SECTIONS.items():
        for kind in kinds:
            fields = dict(kind.model_fields)
            method = get_args(fields.pop("method").annotation)[0] if path == ("controller",) else ""
            for name, field in fields.items():
                key = f"`{'.'.join((*path, name)).replace('*', '0')}`" + (f" of `{method}`" if method else "")
                default = "required" if field.is_required() else f"`{json.dumps(field.default)}`"
                choice = get_args(field.annotation) if get_origin(field.annotation) is Literal else ()
                meaning = (field.description or "").replace("|", "\\|")
                told = f" One of {', '.join(f'`{value}`' for value in choice)}." if len(choice) > 1 else ""
                yield f"| {key} | {default} | {meaning}{told} |"
