"""Sources by key: every key in the code has an entry in references.bib."""

from pathlib import Path

import pytest

from pam_envs import citations

ROOT = Path(__file__).parents[1]
PACKAGES = ("pam_envs", "baselines", "agents", "benchmarks", "docs")
SOURCES = sorted(
    path
    for package in PACKAGES
    for pattern in ("*.py", "*.md", "*.yaml")
    for path in (ROOT / package).rglob(pattern)
)


def test_entries_are_sorted_and_complete() -> None:
    entries = citations.entries()
    assert list(entries) == sorted(entries)
    needs = {"article": {"journal", "year"}, "inproceedings": {"booktitle", "year"}}
    needs["book"] = {"publisher", "year"}
    for key, entry in entries.items():
        kind = entry[1 : entry.index("{")]
        assert {"title"} | needs.get(kind, set()) <= set(citations.fields(key)), key
        assert key == "fluidic_muscles" or key[-4:] == citations.fields(key)["year"], key


def test_every_key_in_code_and_docs_has_an_entry() -> None:
    named = {
        (path.relative_to(ROOT), key)
        for path in SOURCES
        for key in citations.named_in(path.read_text(encoding="utf-8"))
    }
    assert len({key for _, key in named}) >= 4
    assert not [place for place in named if place[1] not in citations.entries()]


def test_unknown_key_is_refused() -> None:
    assert citations.named_in("yeh2010, Eq. 10; as fluidic_muscles and nobody1999a say") == [
        *("yeh2010", "fluidic_muscles", "nobody1999a")
    ]
    with pytest.raises(ValueError, match=r"nobody1999a has no entry in references\.bib"):
        citations.bibtex(["yeh2010", "nobody1999a"])


def test_bibtex_prints_each_entry_once() -> None:
    text = citations.bibtex(["yeh2010", "krejci2001", "yeh2010"])
    assert list(citations.parse(text)) == ["yeh2010", "krejci2001"]
    assert citations.in_words("everett1955") == (
        "Everett, D. H., A general approach to hysteresis. Part 4, "
        "Transactions of the Faraday Society 51, 1955"
    )
    assert citations.in_words("astrom2006").startswith("Åström, Karl J.; Hägglund, Tore, ")


@pytest.mark.parametrize(
    "text",
    [
        "@book{a2000,\n  title = {A},\n}\n\n@book{a2000,\n  title = {B},\n}\n",
        "@book{a2000,\n  title = {A{},\n}\n",
        "@book{a2000,\n  title = A,\n}\n",
        "@book{a2000,\n  title = {A},\n",
    ],
)
def test_malformed_or_repeated_entry_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="entry 'a2000' is repeated or malformed"):
        citations.parse(text)
