"""What is installed from a wheel is whole, declares what it imports, and works outside the checkout."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import venv
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path
from zipfile import ZipFile

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = {"mitsuba_scenes", "optimize", "relief", "retouch", "surrogate", "tactile", "visual"}
INSTALLED_BY = {"benchmarks": "dev", "tests": "dev"}
"""Folders outside the wheel, and the extra that brings what they import."""
BESIDE = {"CHANGELOG.md", "CITATION.cff", "LICENSE", "MANIFEST.in", "PKG-INFO", "README.md"}
BESIDE |= {"pyproject.toml", "setup.cfg"}
"""Files of the source archive beside those of the packages."""
COMPARED_WITH = {"bpy", "build123d", "mathutils", "tamaas"}
"""A solver, Blender and a CAD kernel, for benchmarks run by hand; they do not install everywhere."""


def checkout_files(package: str) -> set[str]:
    """Every file of a package, by its path from the root of the checkout."""
    files = (path for path in (ROOT / package).rglob("*") if path.is_file() and path.suffix != ".pyc")
    return {path.relative_to(ROOT).as_posix() for path in files}


def imports(folder: str) -> Iterator[str]:
    """Top-level names that the modules of a folder import from outside the checkout."""
    own = {path.name for path in ROOT.iterdir()} | sys.stdlib_module_names
    for path in (ROOT / folder).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module or ""]
            else:
                continue
            yield from {name.partition(".")[0] for name in names} - own - COMPARED_WITH


def requirements(*extras: str) -> set[str]:
    """Normalised names of the dependencies, of the extras, and of the extras that these name."""
    optional = PROJECT["project"]["optional-dependencies"]
    names = set()
    for line in [
        *PROJECT["project"]["dependencies"],
        *(line for extra in extras for line in optional[extra]),
    ]:
        own = re.match(r"retouch\[(.*)\]", line)
        names |= requirements(*own[1].split(",")) if own else {normalised(re.split(r"[^\w.-]", line)[0])}
    return names


def normalised(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


@pytest.mark.parametrize("folder", sorted(PACKAGES | INSTALLED_BY.keys()))
def test_what_is_imported_is_declared(folder: str) -> None:
    everything = PROJECT["project"]["optional-dependencies"].keys() - {"dev"}
    declared = requirements(*([INSTALLED_BY[folder]] if folder in INSTALLED_BY else everything))
    distributions = packages_distributions()
    for name in set(imports(folder)):
        assert declared & {normalised(found) for found in distributions.get(name, [name])}, name


def test_every_package_is_in_the_lock() -> None:
    lock = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    locked = {normalised(line.partition("==")[0]) for line in lock if not line.startswith("#")}
    assert requirements("dev") <= locked


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A repository whose only commit holds this checkout, changes that are not committed here included."""
    copy = tmp_path_factory.mktemp("build") / "checkout"
    copy.mkdir()
    for path in ROOT.iterdir():
        if path.is_file():
            shutil.copy(path, copy)
        elif path.name == "tests" or (path / "__init__.py").is_file():
            shutil.copytree(path, copy / path.name, ignore=shutil.ignore_patterns("__pycache__"))
    author = ["-c", "user.name=nobody", "-c", "user.email=nobody@example.org"]
    for command in (["init", "-q"], ["add", "--all"], [*author, "commit", "-q", "--message", "all"]):
        subprocess.run(["git", *command], cwd=copy, check=True)
    return copy


@pytest.fixture(scope="module")
def archives(copy: Path) -> tuple[Path, Path]:
    """The source archive and the wheel of `make dist`."""
    make_dist(copy)
    (sdist,), (wheel,) = (copy / "dist").glob("*.tar.gz"), (copy / "dist").glob("*.whl")
    return sdist, wheel


def make_dist(copy: Path) -> None:
    """Run `make dist` with the packages that are installed here."""
    own = ["--old-file", ".venv/.tests", f"BIN={Path(sys.executable).parent}"]
    subprocess.run(["make", "dist", *own], cwd=copy, capture_output=True, check=True)


@pytest.mark.slow
def test_archives_of_a_commit_have_the_same_bytes_each_time(
    copy: Path, archives: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whenever and in whatever folder they are made, by `make dist` or of the source archive alone."""
    first = [path.read_bytes() for path in archives]
    subprocess.run(["git", "clone", "-q", copy, copy.parent / "clone"], check=True)
    make_dist(copy.parent / "clone")
    assert [(copy.parent / "clone" / "dist" / path.name).read_bytes() for path in archives] == first

    unpacked = copy.parent / "unpacked"
    unpacked.mkdir()
    # Python 3.11.2, that of Debian 12, has no filters in tarfile.
    subprocess.run(["tar", "-xf", archives[0], "-C", unpacked], check=True)
    (source,) = unpacked.iterdir()
    time = subprocess.check_output(["git", "log", "-1", "--format=%ct"], cwd=copy, text=True)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", time.strip())
    script = "import sys; from setuptools.build_meta import build_wheel; build_wheel(sys.argv[1])"
    subprocess.run([sys.executable, "-c", script, unpacked], cwd=source, capture_output=True, check=True)
    assert (unpacked / archives[1].name).read_bytes() == first[1]


@pytest.fixture(scope="module")
def installed(archives: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """`bin` of a virtual environment with the wheel, and with the packages that it needs from this one."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, with_pip=False)
    python = folder / "bin" / "python"
    install = [sys.executable, "-m", "pip", "--python", str(python), "install", "--no-deps", "--no-index"]
    subprocess.run([*install, str(archives[1])], capture_output=True, check=True)
    # A folder named in a .pth file is searched, and its own .pth files (an editable checkout) are not read.
    (site,) = (folder / "lib").glob("python*/site-packages")
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    return folder / "bin"


def run(program: Path, *argv: str, cwd: Path, status: tuple[int, ...] = (0,)) -> str:
    """What a program prints, run as by a user whose environment knows nothing of the checkout."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    child = subprocess.run(
        [program, *argv], cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )
    assert child.returncode in status, child.stderr
    return child.stdout


@pytest.mark.slow
def test_the_archives_hold_every_file_of_the_packages_and_nothing_else(archives: tuple[Path, Path]) -> None:
    sdist, wheel = archives
    expected = set[str]().union(*map(checkout_files, PACKAGES))
    assert {"surrogate/weights/touch.safetensors", "mitsuba_scenes/textures/gravel.png"} <= expected
    assert {"retouch/pages/templates/report.html.j2", "retouch/py.typed"} <= expected
    with ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
    assert held == expected
    with tarfile.open(sdist) as archive:
        files = {member.name.partition("/")[2] for member in archive if member.isfile()}
    sources = {name for name in files if not name.startswith("retouch.egg-info/")}
    assert sources == expected | BESIDE


def test_texts_of_an_installed_package_name_pages_by_their_titles() -> None:
    """Paths of pages lead nowhere there. A name is the first words of one title of guide or evidence."""
    pages = [path.read_text(encoding="utf-8").partition("\n")[0] for path in (ROOT / "docs").rglob("*.md")]
    titles = [title.removeprefix("# ").removeprefix("Tutorial: ").lower() for title in pages]
    named = set()
    for file in sorted(set[str]().union(*map(checkout_files, PACKAGES))):
        for text in texts(ROOT / file):
            assert "docs/" not in text, file
            named |= set(re.findall(r"""(?:guide's page|evidence,)\s+"([^"]+)\"""", text))
    assert "Palettes" in named
    assert [name for name in named if sum(title.startswith(name.lower()) for title in titles) != 1] == []


def texts(path: Path) -> list[str]:
    """What users may see of a file: settings, scenes and templates whole, and the texts of modules."""
    if path.suffix not in (".py", ".toml", ".xml", ".j2"):
        return []
    whole = path.read_text(encoding="utf-8")
    # Most modules name no page; parsing all takes a second.
    if path.suffix != ".py" or not re.search("docs/|guide's page|evidence,", whole):
        return [whole]
    module = ast.parse(whole)
    nodes = [*ast.walk(module)]
    docstrings = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    if path.parent.name == "commands" and isinstance(module.body[0], ast.Expr):
        # The help of a verb.
        docstrings.discard(id(module.body[0].value))
    constants = [node for node in nodes if isinstance(node, ast.Constant) and id(node) not in docstrings]
    return [node.value for node in constants if isinstance(node.value, str)]


@pytest.mark.slow
def test_the_wheel_works_outside_the_checkout(installed: Path, tmp_path: Path) -> None:
    where = run(installed / "python", "-c", "import retouch; print(retouch.__file__)", cwd=tmp_path)
    assert Path(where.strip()).is_relative_to(installed.parent)

    findings = json.loads(run(installed / "retouch", "doctor", "--json", cwd=tmp_path))["findings"]
    assert {finding["name"] for finding in findings if finding["ok"]} >= {"packages", "Mitsuba", "weights"}

    folder = run(installed / "python", "-c", "import mitsuba_scenes as m; print(m.FOLDER)", cwd=tmp_path)
    pressed = ["evaluate", f"{folder.strip()}/textures/gravel.png", "--relief-mm", "1.2", "--json"]
    told = run(installed / "retouch", *pressed, cwd=tmp_path)
    # The paper's range of natural textures.
    assert 0.03 < json.loads(told)[0]["roughness"] < 0.12

    small = ["-D", "resolution=32", "--samples", "4"]
    scene = f"{folder.strip()}/studio.xml"
    run(installed / "retouch", "render", scene, "-o", "pictures", *small, cwd=tmp_path)
    assert len([*(tmp_path / "pictures").glob("*.exr")]) == 3
    script = (
        "import retouch, mitsuba_scenes; "
        "heights = retouch.load_heights(mitsuba_scenes.FOLDER / 'textures/gravel.png', relief_mm=1.2); "
        "touch = retouch.press(heights); print(float(retouch.roughness(touch.strain, touch.size_mm)))"
    )
    assert 0.03 < float(run(installed / "python", "-c", script, cwd=tmp_path)) < 0.12

    small = ["descent.steps=1", "verify.model=none", "verify.samples=4", "define.resolution=32"]
    settings = [part for setting in small for part in ("--set", setting)]
    run(installed / "retouch", "optimize", "gravel", *settings, cwd=tmp_path, status=(0, 3))
    assert (tmp_path / "runs" / "gravel" / "report.html").is_file()
    assert (tmp_path / "runs" / "gravel" / "plate.3mf").is_file()
