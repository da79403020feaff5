import runpy
from pathlib import Path

import pytest

import tcs.files.paths
from tcs.errors import DataFileError, OutputError, UnknownNameError
from tcs.files.paths import cache_folder, data_folder, named_file, shipped_files

CHECKOUT = Path(__file__).resolve().parents[2]


def make_data(folder: Path) -> Path:
    for part in ("models", "tasks"):
        (folder / part).mkdir(parents=True)
    return folder


def test_data_of_a_checkout_is_the_checkout():
    assert data_folder() == CHECKOUT


def test_data_of_an_installed_package_is_inside_it(tmp_path, monkeypatch):
    package = tmp_path / "site-packages" / "tcs"
    own = make_data(package / "_data")
    # Some other package's folders of the same names lie beside it.
    make_data(tmp_path / "site-packages")
    monkeypatch.setattr(tcs.files.paths, "_PACKAGE", package)
    assert data_folder() == own


@pytest.mark.parametrize("present", [[], ["models"], ["tasks"]], ids=str)
def test_missing_data_is_said_in_one_line(tmp_path, monkeypatch, present):
    for part in present:
        (tmp_path / part).mkdir()
    monkeypatch.setattr(tcs.files.paths, "_PACKAGE", tmp_path / "tcs")
    with pytest.raises(DataFileError) as caught:
        data_folder()
    message = str(caught.value)
    assert str(tmp_path / "tcs" / "_data") in message
    assert "\n" not in message


@pytest.fixture
def home(tmp_path, monkeypatch):
    for name in ("TCS_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    return tmp_path


def test_cache_is_in_the_home_folder_by_default(home):
    assert cache_folder() == home / ".cache" / "tcs"
    assert cache_folder().is_dir()


def test_cache_follows_xdg(home, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(home / "xdg"))
    assert cache_folder() == home / "xdg" / "tcs"


def test_relative_xdg_folder_is_ignored_as_its_specification_says(home, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", "xdg")
    assert cache_folder() == home / ".cache" / "tcs"


def test_own_variable_comes_first(home, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(home / "xdg"))
    monkeypatch.setenv("TCS_CACHE_DIR", "~/mine")
    assert cache_folder() == home / "mine"
    assert not (home / "xdg").exists()


def test_cache_that_cannot_be_made_is_said_in_one_line(home, monkeypatch):
    blocked = home / "file"
    blocked.write_text("")
    monkeypatch.setenv("TCS_CACHE_DIR", str(blocked / "cache"))
    with pytest.raises(OutputError, match=r"cache folder .* cannot be made.*TCS_CACHE_DIR"):
        cache_folder()


def test_importing_touches_no_folder(home, monkeypatch):
    monkeypatch.setenv("TCS_CACHE_DIR", str(home / "untouched"))
    runpy.run_path(str(tcs.files.paths.__file__))
    assert not (home / "untouched").exists()


def test_shipped_files_are_found_by_name():
    files = shipped_files("models/robots/*.yaml")
    assert files["pr2"] == CHECKOUT / "models" / "robots" / "pr2.yaml"
    assert list(files) == sorted(files)


SHIPPED = {"bed": Path("/data/bed.yaml")}


@pytest.mark.parametrize(
    ("given", "path"),
    [
        ("bed", "/data/bed.yaml"),
        ("bed.yaml", "bed.yaml"),
        ("./bed", "bed"),
        ("C:\\rooms\\bed", "C:\\rooms\\bed"),
        ("/rooms/bed.yaml", "/rooms/bed.yaml"),
        (Path("bed"), "bed"),
        ("~/bed.yaml", "/home/of/user/bed.yaml"),
    ],
)
def test_a_file_is_named_or_is_a_path(given, path, monkeypatch):
    monkeypatch.setenv("HOME", "/home/of/user")
    assert named_file("room", given, SHIPPED) == Path(path)


def test_a_relative_path_may_start_beside_another_file():
    assert named_file("room", "a.yaml", SHIPPED, beside=Path("/b")) == Path("/b/a.yaml")
    assert named_file("room", "/a.yaml", SHIPPED, beside=Path("/b")) == Path("/a.yaml")
    assert named_file("room", "bed", SHIPPED, beside=Path("/b")) == Path("/data/bed.yaml")


def test_a_name_that_nothing_has_is_told_with_its_place():
    with pytest.raises(UnknownNameError, match=r"^here: unknown room 'bad'.*Did you mean 'bed'\?"):
        named_file("room", "bad", SHIPPED, where="here")


def test_a_folder_inside_the_cache_is_made(tmp_path, monkeypatch):
    monkeypatch.setenv("TCS_CACHE_DIR", str(tmp_path))
    assert cache_folder("a", "b") == tmp_path / "a" / "b"
    assert (tmp_path / "a" / "b").is_dir()
