"""BibTeX of rows: every method of every controller has its entry."""

import json
import re

import bench_fakes
import board_fakes as fakes
import pytest
import yaml

from baselines.core.entry import Entry
from baselines.trivial import make_constant
from benchmarks.__main__ import main
from benchmarks.board import cite
from benchmarks.runs import rows
from benchmarks.runs.controllers import available
from benchmarks.runs.provenance import ROOT
from benchmarks.runs.store import write_record
from pam_envs import citations
from tests.benchmarks.runs.test_harness import options, score

SIMC = "S. Skogestad, Simple analytic rules for model reduction and PID controller tuning, 2003"
PPO = "Schulman et al., Proximal policy optimization algorithms, arXiv:1707.06347, 2017"


def parsed(text: str) -> dict[str, dict[str, str]]:
    """Return BibTeX entries by key; anything but entries of braced fields is an error."""
    found: dict[str, dict[str, str]] = {}
    for head, fields in re.findall(ENTRY, text):
        kind, key = re.fullmatch(r"@([a-z]+)\{([A-Za-z0-9_-]+),\n", head).groups()
        assert key not in found
        found[key] = {"type": kind, **dict(re.findall(FIELD, fields))}
        assert all(value.count("{") == value.count("}") for value in found[key].values())
    assert not re.sub(ENTRY, "", text).strip()
    return found


FIELD = r"  ([a-z]+) = \{(.*)\},\n"
ENTRY = r"(@.*\n)((?:  [a-z]+ = \{.*\},\n)+)\}\n"


@pytest.mark.parametrize("name", sorted(available()))
def test_every_method_of_every_controller_has_its_entry(name):
    citation = available()[name].citation
    found = cite.methods(citation)
    assert bool(found) == bool(citation)


def test_entries_are_bibtex():
    for key, entry in citations.entries().items():
        (found,) = parsed(entry).values()
        assert set(found) - {"type"} == set(citations.fields(key))
        assert found["type"] in ("article", "inproceedings", "book", "misc")


def test_method_without_an_entry_is_refused():
    assert cite.methods(f"{SIMC}; {PPO}; {SIMC}") == ["skogestad2003", "schulman2017"]
    assert cite.methods("") == []
    assert cite.methods("skogestad2003; schulman2017") == ["skogestad2003", "schulman2017"]
    with pytest.raises(ValueError, match=r"N\. N\., A method has no entry in references\.bib"):
        cite.methods(f"{SIMC}; N. N., A method")


def test_special_letters_are_escaped():
    entry = cite.entry("key", {"type": "misc", "title": "50 % of A_b & C"})
    assert r"title = {{50 \% of A\_b \& C}}" in entry


def test_package_is_cited_by_its_own_file():
    about = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    (entry,) = parsed(cite.package()).values()
    assert entry["type"] == "software"
    assert entry["version"] == str(about["version"])
    assert entry["title"] == f"{{{about['title']}}}"


def test_row_is_cited_with_its_identity_and_command(track, folder, capsys):
    (path,) = score(track, folder, "integral").rows
    row = rows.load(path)
    row["controller"]["citation"] = f"{PPO}; {SIMC}"
    write_record(path, row)
    row = rows.load(path)
    assert main(["cite", str(path)]) == 0
    entries = parsed(capsys.readouterr().out)
    key = f"short--integral-{row['controller']['artefact']['digest'][:8]}"
    assert list(entries) == [key, "pam_envs", "schulman2017", "skogestad2003"]
    said = entries[key]
    assert "PAM/MusclePositioning-v0" in said["note"]
    assert row["task"][:16] in said["note"]
    assert row["controller"]["artefact"]["digest"][:16] in said["note"]
    assert row["checksum"] in said["note"]
    assert "not audited" in said["note"]
    assert said["howpublished"] == "python -m benchmarks verify short--integral"
    assert rows.path_of("short--integral", options(folder).out) == path


def test_author_is_that_of_the_catalogue(track, folder, capsys, monkeypatch):
    people = "Doe, J. and Roe, R."
    entry = Entry("with an integrator", "nominal model", make_constant, author=people)
    monkeypatch.setitem(bench_fakes.CONTROLLERS, "integral", entry)
    (path,) = score(track, folder, "integral").rows
    assert main(["cite", str(path)]) == 0
    first, *_ = parsed(capsys.readouterr().out).values()
    assert first["author"] == "{Doe, J. and Roe, R.}"


def test_row_is_cited_with_score_round_and_author():
    row = fakes.row("pid", 2e-3, audit=2.6e-3)
    said = parsed(cite.bibtex(row | {"controller": row["controller"] | {"citation": ""}}))
    entry = said["short_nominal--pid-aaaaaaaa"]
    assert entry["author"] == f"{{{cite.AUTHORS}}}"
    assert entry["year"] == "2026"
    assert (
        r"RMS 2.60 [2.58, 2.62] mm (mean and 95 \% interval over audit episodes)" in entry["note"]
    )
    assert "audit round 2, salt 5a17" in entry["note"]


def test_braces_in_a_text_do_not_leave_their_field():
    row = fakes.row("pid", 2e-3)
    row["controller"]["author"] = r"A. B}}, note = {won} \input{x}"
    row["controller"]["citation"] = ""
    entry = parsed(cite.bibtex(row))["short_nominal--pid-aaaaaaaa"]
    assert entry["author"] == "{A. B, note = won inputx}"
    assert entry["note"].startswith("RMS")


def test_show_row_prints_scores_and_every_digit(track, folder, capsys):
    (path,) = score(track, folder, "integral").rows
    assert main(["show-row", str(path)]) == 0
    text = capsys.readouterr().out
    assert text.startswith("short--integral\n")
    assert "public RMS: " in text
    assert "of 6 episodes failed" in text
    assert main(["show-row", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == rows.load(path)
    assert main(["show-row", "short--nobody"]) == 2
