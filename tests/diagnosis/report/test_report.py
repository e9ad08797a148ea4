"""Files of a diagnosis: schema, bytes, behaviour on failures."""

import json
import re
import sys
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
import yaml

from pam_envs.diagnosis.decide.rule import Rule
from pam_envs.diagnosis.report import page as page_module
from pam_envs.diagnosis.report.report import dumps, plain, report_json, write
from pam_envs.diagnosis.report.summary import sentence
from tests.diagnosis.report import report_fakes as fakes
from tests.diagnosis.report.page_reader import SECTIONS, Page

VERDICTS = ("named", "ambiguous", "adequate", "unexplained", "insufficient")
FILES = {"report.json", "report.html", "plant.yaml"}


def folder_of(tmp_path: Path, verdict: str = "named") -> Path:
    write(fakes.diagnosis(verdict), tmp_path)
    return tmp_path


@pytest.fixture
def plain_page(monkeypatch):
    """Spare the drawing where a test is about files."""
    monkeypatch.setattr(page_module, "draw", lambda *_: {})


@pytest.mark.parametrize("verdict", VERDICTS)
def test_each_verdict_gives_valid_report_and_page(tmp_path, verdict):
    folder = folder_of(tmp_path, verdict)
    found = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    jsonschema.validate(found, fakes.SCHEMA)
    assert found["verdict"] == verdict
    read = Page((folder / "report.html").read_text(encoding="utf-8"))
    assert found["text"] in read.text
    assert list(read.figures) == list(SECTIONS)
    fixed = verdict in ("named", "ambiguous")
    assert {p.name for p in folder.iterdir()} == FILES
    assert bool(read.figures["effects"]) == fixed
    assert bool(read.figures["rivals"]) == (verdict != "insufficient")


REFUSED = yaml.safe_load(Path(__file__).with_name("refused.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("path", "value"), REFUSED)
def test_schema_refuses_wrong_values(path, value):
    found = fakes.stored(fakes.report())
    place = found
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(found, fakes.SCHEMA)


def sentence_of(verdict: str, **changes: Any) -> str:
    return sentence(fakes.stored(fakes.report(verdict) | changes), Rule())


def test_sentence_names_held_out_data_and_open_rivals():
    text = sentence_of("ambiguous")
    assert "held-out experiments of the kinds steps_held and sine_held" in text
    assert "Not excluded: first_cycle_softening." in text
    assert "sensor_drift" not in text  # left out because it imitates the best
    assert "blocks of 4 s" in sentence_of(
        "adequate", held_out={"by": "blocks", "kinds": [], "share": 0.3}
    )


def test_insignificant_gain_of_a_cause_is_stated():
    weak = {"name": "leak", "title": "a leak", "gain": {"value": 0.03, "interval": [-0.01, 0.1]}}
    text = sentence_of("named", causes=[fakes.CREEP, fakes.CREEP | weak])
    assert "lacks creep of the muscle and a leak" in text
    assert "The gain of a leak is not significant" in text
    assert "gain of creep" not in text


def test_insufficient_extension_is_stated():
    report = fakes.report("unexplained")
    after = {"contraction": report["error_before"]["contraction"] | {"value": 0.18}}
    text = sentence_of("unexplained", causes=[fakes.CREEP], error_after=after)
    assert "Adding creep of the muscle reduces it to 0.18 mm" in text
    assert "not sufficient" in text
    assert "time since reversal" in text
    assert "Adding" not in sentence(report, Rule())


def test_each_key_is_in_schema_and_documentation():
    document = (Path(__file__).parents[3] / "docs/diagnosis_report.md").read_text(encoding="utf-8")
    parts = [fakes.SCHEMA, *fakes.SCHEMA["$defs"].values(), *fakes.SCHEMA["properties"].values()]
    keys = {key for part in parts for key in part.get("properties", {})}
    assert len(keys) > 60
    assert {key for key in keys if f"`{key}`" not in document} == set()


def test_same_diagnosis_gives_same_bytes(tmp_path):
    first, second = folder_of(tmp_path / "a"), folder_of(tmp_path / "b")
    for name in FILES:
        assert (first / name).read_bytes() == (second / name).read_bytes()


def test_keys_keep_the_order_of_the_report():
    report = fakes.report()
    assert list(json.loads(report_json(report))) == list({"schema": 1, **report})


def test_numbers_have_six_digits_and_infinite_ones_are_null():
    found = plain({"a": 1.23456789e-7, "b": np.float32(0.1), "c": np.array([np.nan, np.inf, -0.0])})
    assert found == {"a": 1.23457e-7, "b": 0.1, "c": [None, None, 0.0]}
    assert str(found["c"][2]) == "0.0"
    assert plain({"n": np.int64(3), "f": np.bool_(True), "t": (1, 2)}) == {
        "n": 3,
        "f": True,
        "t": [1, 2],
    }


def test_nan_in_a_report_becomes_null_and_a_dash(tmp_path):
    made = fakes.diagnosis("named")
    made.report["error_before"]["contraction"]["times_floor"] = np.nan
    made.report["rivals"][3]["gain"]["interval"] = [np.nan, np.nan]
    made.report["isolability"]["cosine"][2, :] = np.nan
    made.report["causes"] = [fakes.CREEP | {"size": np.inf}]
    made.traces.measured["contraction"][100:140] = np.nan
    write(made, tmp_path)
    text = (tmp_path / "report.json").read_text(encoding="utf-8")
    found = json.loads(text, parse_constant=pytest.fail)
    jsonschema.validate(found, fakes.SCHEMA)
    assert found["causes"][0]["size"] is None
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert set(Page(html).figures["rivals"]) == {"rivals"}
    assert not re.search(r"\bnan\b", html, re.IGNORECASE)


def test_value_without_json_type_is_refused():
    with pytest.raises(TypeError, match=r"text holds .* of type complex"):
        report_json({**fakes.report(), "text": 1j})


def test_short_objects_are_on_one_line():
    value = {"a": [1, 2], "b": ["x" * 60, "y" * 60]}
    text = dumps(value)
    assert json.loads(text) == value
    assert ' "a": [1, 2],' in text.splitlines()
    assert len(text.splitlines()) == 7


def test_failed_drawing_keeps_old_files(plain_page, tmp_path, monkeypatch):
    folder = folder_of(tmp_path)
    before = {p.name: p.read_bytes() for p in folder.iterdir()}

    def fail(*_):
        raise RuntimeError("no ink")

    monkeypatch.setattr(page_module, "draw", fail)
    with pytest.raises(RuntimeError, match="no ink"):
        write(fakes.diagnosis("ambiguous"), folder)
    assert {p.name: p.read_bytes() for p in folder.iterdir()} == before


def test_failed_write_keeps_old_file(plain_page, tmp_path, monkeypatch):
    folder = folder_of(tmp_path)
    before = (folder / "report.html").read_bytes()
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError(28, "disk is full")))
    with pytest.raises(OSError, match=r"disk is full.*report\.html"):
        write(fakes.diagnosis("ambiguous"), folder)
    assert {p.name for p in folder.iterdir()} == FILES
    assert (folder / "report.html").read_bytes() == before


def test_folder_contains_one_diagnosis(plain_page, tmp_path):
    folder = folder_of(tmp_path, "named")
    write(fakes.diagnosis("adequate", plant=False), folder)
    assert {p.name for p in folder.iterdir()} == FILES - {"plant.yaml"}


def test_without_matplotlib_numbers_are_written_with_a_remedy(tmp_path, monkeypatch):
    (tmp_path / "report.html").write_text("of an earlier diagnosis", encoding="utf-8")
    for name in [n for n in sys.modules if n.partition(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ImportError, match=re.escape("pip install 'pam-envs[plot]'")):
        write(fakes.diagnosis("named"), tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == FILES - {"report.html"}
    assert json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["verdict"] == "named"
