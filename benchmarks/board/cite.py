"""BibTeX of a row: the row itself, this package, and the methods of the controller."""

from collections.abc import Mapping
from typing import Any

import yaml

from benchmarks.board import accessors as views
from benchmarks.board.format import bounded
from benchmarks.runs.provenance import ROOT
from benchmarks.runs.store import CHECKSUM
from pam_envs import citations

SEPARATOR = "; "  # separator between the parts of a citation

Fields = Mapping[str, Any]


def bibtex(row: Mapping[str, Any]) -> str:
    """Return the BibTeX of a row; raise ValueError if a method is not in ``references.bib``."""
    sources = citations.entry_texts(methods_of(row["controller"]))
    parts = [_row_entry(row), package(), *sources]
    return "\n".join(parts)


def methods_of(controller: Mapping[str, Any]) -> list[str]:
    """Return the keys that a row's controller cites; a ValueError names the controller."""
    try:
        return methods(str(controller["citation"]))
    except ValueError as error:
        raise ValueError(f"citation of {controller['name']}: {error}") from error


def methods(citation: str) -> list[str]:
    """Return the keys of the methods in a citation; ValueError if one has no BibTeX entry."""
    keys = []
    for part in filter(None, citation.split(SEPARATOR)):
        found = [
            key
            for key in citations.entries()
            if citations.fields(key)["title"].casefold() in part.casefold()
        ]
        keys += found or citations.named_in(part) or [part]
    citations.entry_texts(keys)
    return list(dict.fromkeys(keys))


def entry(key: str, fields: Fields) -> str:
    """Return one BibTeX entry, capital letters of its title kept; ``fields`` has its ``type``."""
    lines = [f"@{fields['type']}{{{key},"]
    for name, value in fields.items():
        if name != "type":
            text = str(value).translate(_SPECIAL)
            lines.append(f"  {name} = {{{f'{{{text}}}' if name == 'title' else text}}},")
    return "\n".join([*lines, "}"]) + "\n"


_SPECIAL = str.maketrans({letter: f"\\{letter}" for letter in "&%#_$"})
_UNBRACED = str.maketrans("", "", "{}\\")  # without the characters that BibTeX interprets


def package() -> str:
    """Return the entry of this package, from CITATION.cff."""
    about = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    names = [
        author.get("name") or f"{author['family-names']}, {author['given-names']}"
        for author in about["authors"]
    ]
    fields: dict[str, Any] = {
        "type": "software",
        "author": " and ".join(f"{{{name}}}" for name in names),
        "title": about["title"],
        "version": about["version"],
    }
    optional = {"year": str(about.get("date-released", ""))[:4]}
    optional |= {name: about.get(key) for name, key in (("url", "repository-code"), ("doi", "doi"))}
    return entry("pam_envs", fields | {name: text for name, text in optional.items() if text})


AUTHORS = "The pam-envs authors"  # author of a row whose controller names none


def _row_entry(row: Mapping[str, Any]) -> str:
    """Return the entry of the row: its score, identity and the command that reproduces it."""
    env, about, found = row["env"], row["controller"], row["audit"]
    unit, factor = views.unit_of(row)
    score = bounded(views.interval(row), factor)
    split = views.published_split(row)
    note = [
        f"RMS {score} {unit} (mean and 95 % interval over {split} episodes)",
        f"audit round {found['round']}, salt {found['salt']}" if found else "not audited",
        f"environment {env['id']}",
        f"scenarios {row['scenarios']['name']} version {row['scenarios']['version']}",
        f"task {row['task'][:16]}",
        f"artefact {row['controller']['artefact']['digest'][:16]}",
        f"commit {row['made_with']['commit']}",
        f"SHA-256 of the row {row[CHECKSUM]}",
    ]
    title = f"{about['name']} in {row['scenarios']['content']['title']}"
    fields = {
        "type": "misc",
        "author": f"{{{(about.get('author') or AUTHORS).translate(_UNBRACED)}}}",
        "title": f"Leaderboard row {row['row']}: {title}",
        "year": (found["drawn"] if found else str(row["volatile"]["date"]))[:4],
        "note": ", ".join(note).translate(_UNBRACED),
        "howpublished": f"python -m benchmarks verify {row['row']}",
    }
    return entry(f"{row['row']}-{row['controller']['artefact']['digest'][:8]}", fields)
