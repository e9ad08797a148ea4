"""Crafted and mutilated files: a value or one ValueError that names the file, in bounded time."""

import contextlib
import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from pam_envs import yaml_file
from pam_envs.data.recording.recording import read_input
from pam_envs.data.rig_file import Rig
from pam_envs.plants.single_muscle.plant import SingleMuscle
from tests.mutation import mutated

PLANT = "schema: 1\nfamily: single_muscle\nparameters: {mass.load: 2.5}\n"
RIG = "plant: single_muscle\nmuscle: {rest_length_mm: 200}\nrepeats: [[a, b]]\n"
HEAD = "time_s,segment,pressure_command_bar,pressure_bar,contraction_mm\n"
RECORDING = HEAD + "".join(f"{0.02 * i:.2f},a,{0.1 * i:.1f},{0.1 * i:.1f},{i}\n" for i in range(24))
TABLE = "load_kg,pressure_bar,direction,contraction_mm\n1,0,up,0\n1,1,up,2\n1,0,down,1\n"
READERS = {".plant": SingleMuscle.from_yaml, ".rig": Rig.from_yaml, ".csv": read_input}
SEEDS = {".plant": (PLANT,), ".rig": (RIG,), ".csv": (RECORDING, TABLE)}

BOMB = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 10)
)
YAML_VALUES = (
    "[" * 100_000,
    "{a: " * 100_000,
    "- " * 60_000,
    "!!bool x",
    "!!timestamp x",
    "!!int x",
    "!!float x",
    "!!binary x",
    "!!python/object/apply:os.system [true]",
    "1" * 400,
    "1" * 5000,
    "1:" * 9000 + "1",
    "x" * 30_000,
    "{[1]: 2}",
    "{? {a: 1} : 2}",
    ".nan",
    "-.inf",
    "2000-01-01",
    '"\\e[31m\\a"',
    "'\x00'",
    "*missing",
    "[" + ", ".join(f"l{i}" for i in range(60_000)) + "]",
)


def crafted_yaml() -> Iterator[str]:
    """Yield values that broke a reader, in every place of a plant and a rig file."""
    yield from ("", "{", "\t", "- a", "just text", "\ufeff" + PLANT, BOMB, "x: " + "y" * 1_100_000)
    for value in YAML_VALUES:
        yield value
        for key in ("schema", "family", "parameters", "hysteresis", "ensemble", "substeps"):
            yield PLANT.replace(f"{key}:", "notes:") + f"{key}: {value}\n"
        for key in ("plant", "muscle", "load", "repeats", "tolerance", "history", "valve_closed"):
            yield RIG.replace(f"{key}:", "clock:") + f"{key}: {value}\n"


def crafted_csv() -> Iterator[str]:
    """Yield tables whose size or numbers broke a reader."""
    row = "{},a,1,1,1\n"
    yield HEAD + "".join(row.format(t) for t in [i * 1e-6 for i in range(12)] + [599.0] * 12)
    yield HEAD + "".join(row.format(i * 1e-6 + 599.0 * (i > 11)) for i in range(24))
    yield RECORDING.replace("5.0", "1.7e308")
    yield RECORDING.replace(",a,", f",{'a' * 140_000},", 1)
    yield RECORDING.replace(",a,", ',"a,', 1)
    yield "".join(f"c{i}," for i in range(200_000)) + "\n1\n"
    yield HEAD + "".join(f"{0.02 * i},s{i // 2},1,1,1\n" for i in range(40_000))
    yield TABLE + "".join(f"{i},1,up,1\n" for i in range(2, 21_000))
    for cell in ("nan", "inf", "1e999", "0x10", "1_0", "\x00", "\x1b[31m", "1" * 5000, '"', "''"):
        yield RECORDING.replace("1.0", cell)
        yield TABLE.replace("2", cell)
        yield RECORDING.replace("time_s", cell)


def check(path: Path, content: bytes) -> None:
    """Assert that a reader returns, or raises one short ValueError with the file's name."""
    path.write_bytes(content)
    try:
        READERS[path.suffix](path)
    except ValueError as error:
        text = str(error)
        assert path.name in text
        assert len(text) < 3000 + 300 * text.count("\n- ")
        assert "\x1b" not in text and "\0" not in text


@pytest.mark.parametrize("kind", [".plant", ".rig"])
def test_crafted_yaml_is_refused_by_name(kind: str, tmp_path: Path) -> None:
    files = list(crafted_yaml())
    assert len(files) > 200
    for content in files:
        check(tmp_path / f"file{kind}", content.encode())


def test_crafted_tables_are_refused_by_name(tmp_path: Path) -> None:
    for content in crafted_csv():
        check(tmp_path / "file.csv", content.encode())


@pytest.mark.parametrize("kind", READERS)
def test_mutated_files_are_read_or_refused_by_name(kind: str, tmp_path: Path) -> None:
    draws = random.Random(0)
    for _ in range(150):
        check(tmp_path / f"file{kind}", mutated(draws.choice(SEEDS[kind]).encode(), draws))


def test_aliases_depth_and_size_are_bounded() -> None:
    for text, said in (
        (BOMB, "alias"),
        ("[" * 60 + "]" * 60, "more than 50 levels"),
        ("x" * 20_001, "more than 20,000 characters"),
    ):
        with pytest.raises(ValueError, match=f"^place is not YAML: it has .*{said}"):
            yaml_file.parse(text, "place")
    assert yaml_file.parse("[" * 50 + "]" * 50, "place")
    with contextlib.suppress(ValueError):
        yaml_file.parse("a: !!timestamp x", "place")
