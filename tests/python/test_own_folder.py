"""A command that fills a folder replaces only what it wrote itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from lostmotion.cli import main
from lostmotion.errors import InputError
from lostmotion.own_folder import LIST, claim, release


def test_what_was_there_before_is_refused_and_kept(tmp_path: Path) -> None:
    (tmp_path / "report.html").write_text("mine")
    with pytest.raises(InputError, match=r"report\.html: found a file that this command did not"):
        claim(tmp_path, ["report.html"])
    assert (tmp_path / "report.html").read_text() == "mine"
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_what_was_written_is_replaced_and_what_was_changed_since_is_not(tmp_path: Path) -> None:
    claim(tmp_path / "out", ["a.toml", "in/b.csv"])
    (tmp_path / "out" / "a.toml").write_text("made")
    claim(tmp_path / "out", ["a.toml"])  # one that was killed begins again
    release(tmp_path / "out")
    claim(tmp_path / "out", ["a.toml"])
    release(tmp_path / "out")
    (tmp_path / "out" / "a.toml").write_text("changed")
    (tmp_path / "out" / "notes.txt").write_text("beside")
    with pytest.raises(InputError, match=r"a\.toml: found a file"):
        claim(tmp_path / "out", ["a.toml"])
    claim(tmp_path / "out", ["in/b.csv"])


def test_a_link_in_the_place_of_a_result_is_refused(tmp_path: Path) -> None:
    claim(tmp_path, ["a.toml"])
    release(tmp_path)
    (tmp_path / "precious").write_text("mine")
    (tmp_path / "a.toml").symlink_to("precious")
    with pytest.raises(InputError, match=r"a\.toml"):
        claim(tmp_path, ["a.toml"])


def test_an_empty_list_contains_nothing(tmp_path: Path) -> None:
    (tmp_path / LIST).write_bytes(b"\xff\n\nx")
    (tmp_path / "a.toml").write_text("mine")
    with pytest.raises(InputError, match=r"a\.toml"):
        claim(tmp_path, ["a.toml"])


def test_the_demonstration_keeps_the_files_of_a_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "base.toml").write_text("mine")
    assert main(["demo", "-o", str(tmp_path), "--quiet"]) == 2
    assert "base.toml: found a file that this command did not write" in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ["base.toml"]
