import runpy
from pathlib import Path

import pytest

import tcs.files.paths
from tcs.errors import DataFileError, OutputError, UnknownNameError
from tcs.files.paths import DataFiles, cache_folder, data_folder

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
    # Folders of the same names that belong to another package.
    make_data(tmp_path / "site-packages")
    monkeypatch.setattr(tcs.files.paths, "_PACKAGE", package)
    assert data_folder() == own


@pytest.mark.parametrize("present", [[], ["models"], ["tasks"]], ids=str)
def test_missing_data_is_one_line(tmp_path, monkeypatch, present):
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


def test_relative_xdg_folder_is_ignored_as_specified(home, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", "xdg")
    assert cache_folder() == home / ".cache" / "tcs"


def test_own_variable_comes_first(home, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(home / "xdg"))
    monkeypatch.setenv("TCS_CACHE_DIR", "~/mine")
    assert cache_folder() == home / "mine"
    assert not (home / "xdg").exists()


def test_a_cache_that_cannot_be_created_is_one_line(home, monkeypatch):
    blocked = home / "file"
    blocked.write_text("")
    monkeypatch.setenv("TCS_CACHE_DIR", str(blocked / "cache"))
    with pytest.raises(OutputError, match=r"cache folder .* cannot be created.*TCS_CACHE_DIR"):
        cache_folder()


def test_importing_touches_no_folder(home, monkeypatch):
    monkeypatch.setenv("TCS_CACHE_DIR", str(home / "untouched"))
    runpy.run_path(str(tcs.files.paths.__file__))
    assert not (home / "untouched").exists()


def test_shipped_files_are_found_by_name():
    files = DataFiles("robot", "models/robots/*.yaml").shipped()
    assert files["pr2"] == CHECKOUT / "models" / "robots" / "pr2.yaml"
    assert list(files) == sorted(files)


@pytest.fixture
def beds(tmp_path, monkeypatch):
    """Data files of one type, of which `bed` ships."""
    data = make_data(tmp_path / "tcs" / "_data")
    (data / "models" / "bed.yaml").write_text("")
    monkeypatch.setattr(tcs.files.paths, "_PACKAGE", tmp_path / "tcs")
    return DataFiles("environment", "models/*.yaml")


@pytest.mark.parametrize(
    ("given", "path"),
    [
        ("bed.yaml", "bed.yaml"),
        ("./bed", "bed"),
        ("C:\\scenes\\bed", "C:\\scenes\\bed"),
        ("/scenes/bed.yaml", "/scenes/bed.yaml"),
        (Path("bed"), "bed"),
        ("~/bed.yaml", "/home/of/user/bed.yaml"),
    ],
)
def test_a_path_needs_a_separator_or_the_suffix(beds, given, path, monkeypatch):
    monkeypatch.setenv("HOME", "/home/of/user")
    assert beds.path(given) == Path(path)


def test_a_name_is_that_of_a_shipped_file(beds):
    assert beds.names() == ("bed",)
    assert beds.path("bed") == data_folder() / "models" / "bed.yaml"


def test_a_relative_path_may_start_beside_another_file(beds):
    assert beds.path("a.yaml", beside=Path("/b")) == Path("/b/a.yaml")
    assert beds.path("/a.yaml", beside=Path("/b")) == Path("/a.yaml")
    assert beds.path("bed", beside=Path("/b")) == beds.path("bed")


def test_an_unknown_name_is_reported_with_its_location(beds):
    message = r"^here: unknown environment 'bad'.*Did you mean 'bed'\?"
    with pytest.raises(UnknownNameError, match=message):
        beds.path("bad", where="here")


def test_the_home_folder_of_an_unknown_user_is_one_line(beds, home, monkeypatch):
    with pytest.raises(
        DataFileError, match=r"^environment file '~nouser/a\.yaml': the home folder"
    ):
        beds.path("~nouser/a.yaml")
    monkeypatch.setenv("TCS_CACHE_DIR", "~nouser/x")
    with pytest.raises(OutputError, match=r"^TCS_CACHE_DIR '~nouser/x': the home folder '~nouser'"):
        cache_folder()


def test_a_folder_inside_the_cache_is_made(tmp_path, monkeypatch):
    monkeypatch.setenv("TCS_CACHE_DIR", str(tmp_path))
    assert cache_folder("a", "b") == tmp_path / "a" / "b"
    assert (tmp_path / "a" / "b").is_dir()
