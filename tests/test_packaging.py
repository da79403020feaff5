import ast
import re
import runpy
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tcs.model.tasks import task_names

CHECKOUT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
DATA_PARTS = ("models", "tasks")
VERSIONS = runpy.run_path(str(CHECKOUT / "scripts" / "versions.py"))

# Distributions whose module is called otherwise; one that is found by its files alone, and those
# that trimesh and uvicorn import for us.
MODULE_OF = {
    "drake": "pydrake",
    "pillow": "PIL",
    "pyyaml": "yaml",
    "scikit-learn": "sklearn",
    "eclipse-zenoh": "zenoh",
}
WITHOUT_MODULE = {"example-robot-data", "pycollada", "httptools", "uvloop"}


def dependencies() -> set[str]:
    return {re.split(r"[^\w-]", line)[0] for line in PROJECT["dependencies"]}


def of_extras() -> set[str]:
    """Modules of the extras that the package itself imports where they are installed."""
    extras = PROJECT["optional-dependencies"]
    lines = [
        line
        for name in ("arplace", "bags", "dask", "distances", "mcp", "ros2", "service")
        for line in extras[name]
    ]
    names = {re.split(r"[^\w-]", line)[0] for line in lines}
    return {MODULE_OF.get(name, name) for name in names - WITHOUT_MODULE}


def modules() -> list[Path]:
    """Modules of the packages that the wheel carries."""
    return [path for top in ("tcs", "shapes", "studies") for path in (CHECKOUT / top).rglob("*.py")]


def imported_modules() -> set[str]:
    """Top-level names of everything the package imports, lazily or not."""
    found = set()
    for path in modules():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found.add(node.module.split(".")[0])
    return found


def test_what_is_imported_is_what_is_depended_on():
    ours = {"tcs", "tcs_shapes", "tcs_studies"}
    foreign = imported_modules() - set(sys.stdlib_module_names) - ours
    modules = {MODULE_OF.get(name, name) for name in dependencies() - WITHOUT_MODULE}
    # These come with pydantic, numba and fastapi, in the versions those need.
    assert foreign - {"anyio", "llvmlite", "pydantic_core"} == modules | of_extras()


def test_every_package_has_its_licence_told():
    page = (CHECKOUT / "THIRD_PARTY.md").read_text(encoding="utf-8").split("## Packages")[1]
    told = dict(re.findall(r"^\| ([\w-]+) \| (.+) \|$", page, flags=re.MULTILINE))
    del told["package"]
    script = runpy.run_path(str(CHECKOUT / "scripts" / "licences.py"))
    installed = script["licences"]()
    assert installed.keys() <= told.keys(), "run `python scripts/licences.py`"
    if f"{sys.version_info.major}.{sys.version_info.minor}" == VERSIONS["PYTHONS"][0]:
        # Newer Pythons need fewer packages, and take newer ones, which may word a licence anew.
        assert told == installed, "run `python scripts/licences.py`"
    assert all(
        f"| {file} | {source} |" in script["PAGE"].read_text(encoding="utf-8")
        for file, source in script["sources_of_data"]()
    )


def test_page_tells_oldest_and_newest_versions():
    page = VERSIONS["PAGE"].read_text(encoding="utf-8")
    assert VERSIONS["BLOCK"].findall(page) == [VERSIONS["table"]()], (
        "run `python scripts/versions.py`"
    )
    described = {
        name for name, (_, purposes) in VERSIONS["dependencies"]().items() if "all" in purposes
    }
    assert described == dependencies()


def test_lower_bounds_are_of_series_that_are_tested():
    locked = VERSIONS["versions_with"](VERSIONS["PYTHONS"][0])
    for name, (least, _) in VERSIONS["dependencies"]().items():
        assert f"{locked[name]}.".startswith(f"{least}."), name


def test_every_tested_python_is_declared_and_locked():
    declared = [
        line.rpartition(" :: ")[2]
        for line in PROJECT["classifiers"]
        if line.startswith("Programming Language :: Python :: 3.")
    ]
    assert declared == list(VERSIONS["PYTHONS"])
    assert PROJECT["requires-python"] == f">={VERSIONS['PYTHONS'][0]}"
    extras = PROJECT["optional-dependencies"]
    for python in VERSIONS["PYTHONS"]:
        locked = VERSIONS["versions_with"](python)
        for wanted in map(Requirement, [*PROJECT["dependencies"], *extras["dev"]]):
            assert locked[canonicalize_name(wanted.name)] in wanted.specifier, python


def test_readme_gives_a_reason_for_each_dependency():
    readme = (CHECKOUT / "README.md").read_text(encoding="utf-8").lower()
    assert [name for name in sorted(dependencies()) if name not in readme] == []


def data_files() -> set[str]:
    return {
        str(path.relative_to(CHECKOUT))
        for part in DATA_PARTS
        for path in (CHECKOUT / part).rglob("*")
        if path.is_file()
    }


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    run("-m", "hatchling", "build", "--target", "wheel", "--directory", folder, cwd=CHECKOUT)
    (built,) = folder.glob("tcs-*.whl")
    return built


def run(*arguments: str | Path, cwd: Path | None = None, path: Path | None = None) -> str:
    done = subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=cwd,
        env=None if path is None else {"PYTHONPATH": str(path), "HOME": str(path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_wheel_carries_every_data_file_and_module(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    assert data_files()
    assert {f"tcs/_data/{name}" for name in data_files()} <= names
    carried = {
        re.sub("^(shapes|studies)/", "", str(path.relative_to(CHECKOUT))) for path in modules()
    }
    typed = {"tcs/py.typed", "tcs_shapes/py.typed", "tcs_studies/py.typed"}
    data = {
        "tcs/output/report/page.css",
        "tcs_studies/output/report/robustness/paper.yaml",
        "tcs_studies/output/study/form.css",
    }
    assert carried | typed | data <= names


def test_wheel_carries_nothing_else(wheel):
    allowed = re.compile(r"tcs/|tcs_shapes/|tcs_studies/|tcs-[^/]*\.dist-info/")
    names = zipfile.ZipFile(wheel).namelist()
    assert [name for name in names if not allowed.match(name) or "__pycache__" in name] == []


def test_wheel_works_away_from_the_checkout(wheel, tmp_path):
    # A pure wheel is installed by unpacking it; `make wheel` does it with pip.
    site = tmp_path / "site"
    zipfile.ZipFile(wheel).extractall(site)
    code = (
        "from tcs.files.paths import data_folder\n"
        "from tcs.model.tasks import load_task, task_names\n"
        "import tcs_shapes.draft, tcs_studies.study.study_file\n"
        "print(data_folder()); print(*task_names()); print(len(load_task('shaving').goals))"
    )
    lines = run("-c", code, cwd=tmp_path, path=site).splitlines()
    assert lines == [str(site / "tcs" / "_data"), " ".join(task_names()), "8"]


def test_source_archive_carries_what_make_and_the_licence_need(tmp_path):
    run("-m", "hatchling", "build", "--target", "sdist", "--directory", tmp_path, cwd=CHECKOUT)
    (built,) = tmp_path.glob("tcs-*.tar.gz")
    with tarfile.open(built) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    makefile = (CHECKOUT / "Makefile").read_text(encoding="utf-8")
    scripts = set(re.findall(r"\b(?:scripts|benchmarks)/\w+\.py", makefile))
    assert {"Makefile", "pyproject.toml", "requirements.lock", "tcs/__init__.py"} <= names
    assert "shapes/tcs_shapes/__init__.py" in names
    assert "studies/tcs_studies/__init__.py" in names
    assert {"LICENSE", "THIRD_PARTY.md", *scripts} <= names
