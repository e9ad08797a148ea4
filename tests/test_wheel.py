"""Wheel and source distribution are complete and small; the pages' snippets run from the wheel."""

import ast
import os
import re
import runpy
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = {"baselines", "agents", "sweeps"}
RUN_START = """
import re, sys
wheel, page = sys.argv[1:]
sys.path.insert(0, wheel)
names = {"__name__": "start"}
with open(page) as file:
    for snippet in re.findall(r"^```python\\n(.*?)^```$", file.read(), re.M | re.S):
        exec(snippet, names)
print("error", abs(names["info"]["output"] - names["info"]["reference"]))
"""
RUN_README = """
import re, sys
wheel, page = sys.argv[1:]
sys.path.insert(0, wheel)
names = {"__name__": "readme"}
for snippet in re.findall(r"^```python\\n(.*?)^```$", open(page).read(), re.M | re.S):
    exec(snippet, names)
import pam_envs
assert pam_envs.__file__.startswith(wheel), pam_envs.__file__
assert "pam_envs.baselines.core.catalogue" in sys.modules
assert not {"baselines", "agents", "sweeps"} & set(sys.modules)
print("rms", names["rms"])
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    builders = pytest.importorskip("hatchling.builders.wheel")
    folder = tmp_path_factory.mktemp("wheel")
    (made,) = builders.WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    return Path(made)


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("installed")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


def run(installed: Path, *arguments: str, where: Path) -> str:
    made = subprocess.run(
        [sys.executable, "-P", *arguments],
        cwd=where,
        env={**os.environ, "PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    return made.stdout


def test_wheel_has_one_package_and_at_most_2_MB_beside_object_code(wheel):
    with zipfile.ZipFile(wheel) as archive:
        sizes = {file.filename: file.compress_size for file in archive.infolist()}
    assert sum(size for name, size in sizes.items() if not name.endswith(".o")) <= 2_000_000
    assert wheel.stat().st_size <= 3_500_000
    tops = {name.partition("/")[0] for name in sizes}
    assert tops == {"pam_envs", "pam_envs-0.1.0.dist-info"}


def test_wheel_has_the_sources_of_its_object_code(installed, tmp_path):
    code = (
        "import gymnasium as gym, pam_envs\n"
        "from pam_envs.kernels import shipped\n"
        "for name in ('PAM/ElbowOrthosis-v0', 'PAM/RedundantManipulator-v0'):\n"
        "    print(shipped.located(gym.make(name).unwrapped.setup.kernels.by_address))\n"
        "print(shipped.sources(), pam_envs.__file__)"
    )
    said = run(installed, "-c", code, where=tmp_path)
    here = run(ROOT, "-c", code, where=tmp_path)
    assert said.split()[:-1] == here.split()[:-1]
    assert said.split()[-1] != here.split()[-1]


def test_wheel_has_every_module_and_settings_file(installed):
    for folder in FOLDERS:
        for file in (ROOT / folder).rglob("*"):
            if file.suffix in (".py", ".yaml"):
                assert (installed / "pam_envs" / file.relative_to(ROOT)).is_file(), file
    for file in (ROOT / "pam_envs").rglob("*"):
        if file.is_file() and file.suffix != ".pyc":
            assert (installed / file.relative_to(ROOT)).is_file(), file


def test_modules_of_the_wheel_import_no_name_of_the_checkout(installed):
    for file in installed.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and not node.level:
                names = [node.module or ""]
            assert not {name.partition(".")[0] for name in names} & FOLDERS, file


def test_commands_in_the_wheel_name_its_modules(installed):
    command = re.compile(rf"python -m ({'|'.join(FOLDERS)})\b")
    texts = {file: file.read_text(encoding="utf-8") for file in installed.rglob("*.py")}
    assert [file for file, text in texts.items() if command.search(text)] == []
    assert "python -m pam_envs.agents" in texts[installed / "pam_envs/agents/__main__.py"]


def test_snippets_of_the_readme_run_from_the_wheel(installed, tmp_path):
    page = str(ROOT / "README.md")
    said = run(installed, "-W", "error", "-c", RUN_README, str(installed), page, where=tmp_path)
    assert 0.0 < float(said.rpartition("rms")[2]) < 0.5e-3  # m


def test_snippets_of_the_start_page_run_from_the_wheel(installed, tmp_path):
    page = str(ROOT / "docs/start.md")
    said = run(installed, "-W", "error", "-c", RUN_START, str(installed), page, where=tmp_path)
    assert float(said.rpartition("error")[2]) < 1e-3  # m, after 10 s


def test_source_distribution_is_small_and_gives_the_same_wheel(wheel, tmp_path):
    sdist = pytest.importorskip("hatchling.builders.sdist").SdistBuilder(str(ROOT))
    (made,) = map(Path, sdist.build(directory=str(tmp_path), versions=["standard"]))
    assert made.stat().st_size <= 2_000_000
    with tarfile.open(made) as archive:
        archive.extractall(tmp_path, filter="data")
    source = tmp_path / "pam_envs-0.1.0"
    builders = pytest.importorskip("hatchling.builders.wheel")
    (again,) = builders.WheelBuilder(str(source)).build(
        directory=str(tmp_path / "again"), versions=["standard"]
    )
    first, second = (
        {entry.filename: entry.CRC for entry in zipfile.ZipFile(path).infolist()}
        for path in (wheel, again)
    )
    made_here = {name for name in first if "/kernels/objects/" in name}  # by `make wheel`
    if made_here:
        made_here |= {name for name in first if name.endswith("/RECORD")}
    assert first.keys() - made_here == second.keys() - made_here
    assert all(first[name] == second[name] for name in first.keys() - made_here)


def test_links_of_the_readme_are_absolute_with_a_repository():
    pytest.importorskip("hatchling")
    absolute = runpy.run_path(str(ROOT / "hatch_build.py"))["absolute"]
    page = (ROOT / "README.md").read_text()
    assert absolute(page, "") == page
    made = absolute(page, "https://example.org/lab/pam-envs")
    assert "(https://example.org/lab/pam-envs/blob/main/docs/identification.md)" in made
    assert "(https://example.org/lab/pam-envs/raw/main/docs/images/knee_stride.png)" in made
    links = re.findall(r"\]\(([^)\s]+)\)", made)
    assert all(link.startswith(("https://", "#")) for link in links)


def test_wheel_has_the_readme_and_the_versions_of_python(installed):
    text = next(installed.glob("*.dist-info/METADATA")).read_text()
    assert "Description-Content-Type: text/markdown" in text
    assert "# pam-envs" in text
    for minor in (11, 12, 13, 14):
        assert f"Classifier: Programming Language :: Python :: 3.{minor}" in text


def test_agents_run_from_the_wheel(installed, tmp_path):
    pytest.importorskip("stable_baselines3")
    said = run(installed, "-m", "pam_envs.agents", "presets", where=tmp_path)
    assert "PAM/KneeWalk-v0  ppo  " in said


WITHOUT_EXTRAS = """
import sys
wheel, *command = sys.argv[1:]
sys.path.insert(0, wheel)
for name in ("filelock", "joblib", "minari", "onnx", "onnxruntime", "rich", "ruamel", "torch"):
    sys.modules[name] = None
from pam_envs.agents.__main__ import main
assert sys.modules["pam_envs"].__file__.startswith(wheel)
print("status", main(command))
"""


@pytest.mark.parametrize(
    "command", ["train KneeTension-v0", "evaluate policy.onnx", "watch policy.onnx"]
)
def test_agents_without_their_extra_name_it(command, installed, tmp_path):
    arguments = [sys.executable, "-P", "-c", WITHOUT_EXTRAS, str(installed), *command.split()]
    made = subprocess.run(arguments, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert made.stdout == "status 2\n"
    (line,) = made.stderr.splitlines()
    assert line.startswith("error: this command needs ")
    assert line.endswith('which is not installed: pip install "pam-envs[agents]"')


def test_names_of_the_wheel_are_the_same_modules_in_the_checkout():
    from pam_envs.baselines.core import catalogue

    import baselines.core.catalogue as own

    assert catalogue is own
    assert catalogue.__spec__.name == "baselines.core.catalogue"
    with pytest.raises(ModuleNotFoundError, match=r"pam_envs\.baselines\.nothing"):
        __import__("pam_envs.baselines.nothing")
