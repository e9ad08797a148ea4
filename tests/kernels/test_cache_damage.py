"""Damage to the cache of compiled code costs a compilation and a line, never wrong code."""

import random
from pathlib import Path

import pytest

from pam_envs.kernels import cache


@pytest.fixture(autouse=True)
def fresh():
    cache.complain.cache_clear()
    yield
    cache.complain.cache_clear()


def test_file_comes_back_whole(tmp_path):
    path = tmp_path / "new" / "code.o"
    cache.write_whole(path, b"code" * 100)
    assert cache.read_whole(path) == b"code" * 100
    assert [file.name for file in path.parent.iterdir()] == ["code.o"]
    assert path.parent.stat().st_mode & 0o077 == 0


def test_truncated_files_and_flipped_bits_are_found_with_one_warning(tmp_path, capsys):
    path = tmp_path / "code.o"
    cache.write_whole(path, bytes(range(256)) * 8)
    good, draws = path.read_bytes(), random.Random(0)
    for _ in range(1000):
        bit = draws.randrange(8 * len(good))
        bad = bytearray(good)
        bad[bit // 8] ^= 1 << bit % 8
        path.write_bytes(bad)
        assert cache.read_whole(path) is None
    for length in (0, 5, 32, len(good) - 1):
        path.write_bytes(good[:length])
        assert cache.read_whole(path) is None
    assert capsys.readouterr().err.count("code is compiled again") == 1


def test_folder_of_others_is_neither_read_nor_written(tmp_path, monkeypatch, capsys):
    path = tmp_path / "code.o"
    cache.write_whole(path, b"code")
    tmp_path.chmod(0o777)
    assert cache.read_whole(path) is None
    with pytest.raises(PermissionError, match="everyone may write"):
        cache.write_whole(path, b"other")
    tmp_path.chmod(0o700)
    assert cache.read_whole(path) == b"code"
    monkeypatch.setattr(cache.os, "getuid", lambda: tmp_path.stat().st_uid + 1)
    assert cache.read_whole(path) is None
    assert capsys.readouterr().err.count("belongs to another user") == 1


def test_missing_file_is_no_damage(tmp_path, capsys):
    assert cache.read_whole(tmp_path / "none.o") is None
    assert cache.read_whole(Path("/nowhere/none.o")) is None
    assert capsys.readouterr().err == ""
