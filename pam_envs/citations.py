"""Sources by key: the entries of ``references.bib`` that docstrings and catalogues name.

A key is the first author's name with the year, for example ``yeh2010``; a docstring writes
``yeh2010, Eq. 10``.
"""

import re
import unicodedata
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path

FILE = Path(__file__).parent / "references.bib"
_HEAD = re.compile(r"^@(\w+)\{([^,\s]+),$", re.MULTILINE)
_FIELD = re.compile(r"^  (\w+) = \{(.*)\},$", re.MULTILINE)
_ACCENT = re.compile(r"\{\\(['\"])(\w)\}")
_MARKS = {"'": "\N{COMBINING ACUTE ACCENT}", '"': "\N{COMBINING DIAERESIS}"}
_KEY_LIKE = re.compile(r"(?<![\w.])[a-z]{3,}(?:19|20)\d\d[a-z]?(?!\w)")


@lru_cache(maxsize=1)
def entries() -> dict[str, str]:
    """Return the BibTeX entry of each key, as the file holds it (see :func:`parse`)."""
    return parse(FILE.read_text(encoding="utf-8"))


def parse(text: str) -> dict[str, str]:
    """Return the entries of a BibTeX text by key.

    Each entry begins with ``@type{key,``, has one ``  name = {value},`` a line and ends with a line
    ``}``; the lines between entries are comments. Raises ValueError if a key occurs twice, or an
    entry has another form.
    """
    found: dict[str, str] = {}
    for head in _HEAD.finditer(text):
        end = text.find("\n}\n", head.start())
        entry = text[head.start() : end + 3]
        lines = entry.splitlines()[1:-1]
        wrong = [
            line
            for line in lines
            if not _FIELD.fullmatch(line) or line.count("{") != line.count("}")
        ]
        if end < 0 or wrong or head[2] in found:
            raise ValueError(
                f"entry {head[2]!r} is repeated or malformed{f' at {wrong[0]!r}' if wrong else ''}"
                "; write one '  name = {value},' a line and end it with '}'"
            )
        found[head[2]] = entry
    return found


def fields(key: str) -> dict[str, str]:
    """Return the fields of an entry by name, without the braces around their values."""
    (entry,) = entry_texts([key])
    # a second pair of braces keeps capital letters
    return {
        name: value[1:-1] if value.startswith("{") and value.endswith("}") else value
        for name, value in _FIELD.findall(entry)
    }


def in_words(key: str) -> str:
    """Return authors, title, publication and year of a source in one line."""
    held = fields(key)
    authors = held.get("author", "").replace(" and others", " et al.").replace(" and ", "; ")
    place = held.get("journal") or held.get("booktitle") or held.get("publisher", "")
    if "eprint" in held and not place:
        place = f"arXiv:{held['eprint']}"
    where = " ".join(filter(None, (place, held.get("volume"))))
    words = ", ".join(filter(None, (authors, held["title"], where, held.get("year"))))
    return _ACCENT.sub(
        lambda found: unicodedata.normalize("NFC", found[2] + _MARKS[found[1]]),
        words.replace(r"{\AA}", "Å"),
    )


def bibtex(keys: Iterable[str]) -> str:
    """Return the BibTeX entries of keys, in their order, each once (see :func:`entry_texts`)."""
    return "\n".join(entry_texts(keys))


def entry_texts(keys: Iterable[str]) -> list[str]:
    """Return the BibTeX entry of each key, in their order, each once; raise ValueError if none."""
    chosen = list(dict.fromkeys(keys))
    unknown = [key for key in chosen if key not in entries()]
    if unknown:
        raise ValueError(f"{', '.join(unknown)} has no entry in {FILE.name}; add one there")
    return [entries()[key] for key in chosen]


def named_in(text: str) -> list[str]:
    """Return the keys that a text names, in its order, each once; also those without an entry."""
    known = "|".join(map(re.escape, entries()))
    pattern = re.compile(rf"{_KEY_LIKE.pattern}|(?<!\w)(?:{known})(?!\w)")
    return list(dict.fromkeys(found[0] for found in pattern.finditer(text)))
