"""Records on disk: compression, columns of episodes, full precision and equal bytes."""

import lzma
from typing import Any

import numpy as np
import pytest

from benchmarks.runs import store


def record(episodes: Any = None) -> dict[str, Any]:
    draws = np.random.default_rng(0)
    made = [
        {"seed": k, "failed": False, "scores": {"rms": float(draws.normal()), "max": None}}
        for k in range(50)
    ]
    return {"row": "a--b", "episodes": made if episodes is None else episodes}


def test_compressed_record_keeps_every_digit(tmp_path):
    given, path = record(), tmp_path / "a" / "b.json.xz"
    store.write_record(path, given)
    read = store.read_record(path)
    assert {key: read[key] for key in given} == given
    assert b'"rms":[0.1257302210933933,' in lzma.decompress(path.read_bytes())


def test_equal_records_give_equal_bytes(tmp_path):
    for name in ("a", "b"):
        store.write_record(tmp_path / f"{name}.json.xz", dict(reversed(record().items())))
    assert (tmp_path / "a.json.xz").read_bytes() == (tmp_path / "b.json.xz").read_bytes()


@pytest.mark.parametrize(
    "episodes",
    [
        [],
        [{"seed": 1, "scores": {"rms": 1.0}}, {"seed": 2, "scores": {"max": 1.0}}],
        [{"seed": 1, "scores": {"rms": 1.0}}, {"scores": {"rms": 1.0}}],
        [{"seed": 1}],
        [{"seed": 1, "scores": {}}],
    ],
)
def test_episodes_with_different_keys_are_kept(episodes, tmp_path):
    path = tmp_path / "a.json.xz"
    store.write_record(path, record(episodes))
    assert store.read_record(path)["episodes"] == episodes


HOSTILE = {
    "deep": b"[" * 40_000,
    "twice": b'{"row": 1, "episodes": [], "row": 2}',
    "not a number": b'{"row": NaN}',
    "digits": b"[" + b"9" * 5000 + b"]",
    "bomb": b" " * (store.MOST + 1),
    "bytes": b"\xff\xfe",
    "columns of text": b'{"episodes": {"scores": "abc"}}',
}


@pytest.mark.parametrize("what", HOSTILE)
@pytest.mark.parametrize("suffix", [".json", ".json.xz"])
def test_hostile_file_is_one_sentence_with_its_name(what, suffix, tmp_path):
    path = tmp_path / f"a{suffix}"
    content = HOSTILE[what]
    path.write_bytes(lzma.compress(content) if suffix.endswith("xz") else content)
    with pytest.raises(ValueError, match=r"a\.json(\.xz)?: (not JSON|no checksum)") as error:
        store.read_record(path)
    assert len(str(error.value)) < 400 + len(str(path))


@pytest.mark.parametrize("damage", ["cut", "text", "list", "columns", "no scores"])
def test_damaged_file_is_refused(damage, tmp_path):
    path = tmp_path / "a.json.xz"
    store.write_record(path, record())
    content = path.read_bytes()
    texts = {
        "text": "no row",
        "list": "[1]",
        "columns": '{"episodes": {"seed": [1], "scores": {"rms": [1.0, 2.0]}}}',
        "no scores": '{"episodes": {"seed": [1]}}',
    }
    path.write_bytes(content[:-40] if damage == "cut" else lzma.compress(texts[damage].encode()))
    with pytest.raises(ValueError, match=r"a\.json\.xz: not (JSON|a JSON object)"):
        store.read_record(path)
