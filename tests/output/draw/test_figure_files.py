from pathlib import Path

import pytest
from matplotlib.figure import Figure

from tcs.errors import OutputError
from tcs.output.draw import check_format, save_figure


@pytest.mark.parametrize("name", ["map", "map.gif", "map.png.txt", ".png"])
def test_only_known_endings(name):
    with pytest.raises(OutputError, match=r"must end in one of \.png, \.pdf, \.svg"):
        check_format(Path(name))


def test_ending_may_be_upper_case():
    assert check_format(Path("MAP.PNG")) == "png"


def test_missing_folder(tmp_path):
    with pytest.raises(OutputError, match=r"No such file or directory.*writable folder"):
        save_figure(tmp_path / "none" / "map.png", Figure())


@pytest.mark.parametrize("error", [KeyboardInterrupt(), OSError(28, "No space left on device")])
def test_old_picture_stays_when_the_new_one_fails(tmp_path, monkeypatch, error):
    path = tmp_path / "map.png"
    path.write_bytes(b"old")

    def fail(_figure, stream, **_options):
        stream.write(b"half")
        raise error

    monkeypatch.setattr(Figure, "savefig", fail)
    with pytest.raises((KeyboardInterrupt, OutputError)):
        save_figure(path, Figure())
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
