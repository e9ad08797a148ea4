"""Page of a diagnosis: one self-contained HTML file, figures first, no script."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path
from typing import Any

from pam_envs.diagnosis.figures import Picture, draw
from pam_envs.diagnosis.figures.quantities import changed
from pam_envs.diagnosis.report.page_details import (
    DETAILS,
    held_out,
    provenance,
    structure_table,
    why,
)
from pam_envs.diagnosis.report.page_parts import DASH, TIMES, enumeration, interval, number, words

CSS = Path(__file__).with_name("page.css")
VERDICTS = {
    "named": "the cause is named",
    "ambiguous": "more than one cause fits",
    "adequate": "the plant is adequate",
    "unexplained": "no candidate explains the model error",
    "insufficient": "the recording cannot decide",
}
NOTHING = {
    "replay": "There are no traces to show.",
    "residual": "There are no traces to show.",
    "loops": "There is no loop to show: it needs an output and a pressure or its command.",
    "rivals": "No rival was fitted.",
    "kinds": "No kind of segment was held out.",
    "effects": "No cause was named, so there is no effect to show.",
    "isolability": "Fewer than two causes are testable on this recording.",
}
Report = Mapping[str, Any]


def page(report: Report, traces: Any) -> str:
    """Return ``report.html``.

    Parameters
    ----------
    report : mapping
        As in ``report.json``: display units, None for unknown values.
    traces : Traces or None
        Time series of the figures [SI].

    Raises
    ------
    ModuleNotFoundError
        Without matplotlib.
    """
    pictures = draw(report, traces)
    sections = [
        _section(i, name, title, body)
        for i, (name, title, body) in enumerate(_sections(report, pictures), start=1)
    ]
    links = "".join(
        f'<a href="#{name}">{i}&ensp;{escape(title)}</a>'
        for i, (name, title, _) in enumerate(_sections(report, {}), start=1)
    )
    title = escape(f"Diagnosis: {headline(report)}")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{title}</title>\n<style>\n{CSS.read_text(encoding='utf-8')}</style>\n"
        f"</head>\n<body>\n<header>\n{_head(report)}\n<nav>{links}</nav>\n</header>\n"
        f"<main>\n{chr(10).join(sections)}\n{_foot(report)}\n</main>\n</body>\n</html>\n"
    )


def headline(report: Report) -> str:
    """Return the verdict in a few words."""
    titles = {c["name"]: _title(c) for c in report.get("causes") or []}
    verdict = str(report["verdict"])
    text = VERDICTS.get(verdict, verdict)
    if verdict == "named" and titles:
        text = enumeration(list(titles.values()))
    elif verdict == "ambiguous" and titles:
        for rival in report.get("rivals") or []:
            if rival.get("why") == "not excluded":
                titles.setdefault(rival["name"], _title(rival))
        text = " or ".join(list(titles.values())[:3])
    return text[:1].upper() + text[1:]


def _title(cause: Report) -> str:
    """Return the title of a cause, or its name if the title is long."""
    name, title = str(cause["name"]).replace("_", " "), str(cause.get("title") or "")
    return title if title and len(title) <= 40 else name


def _head(report: Report) -> str:
    verdict = str(report["verdict"])
    source = (report.get("provenance") or {}).get("recording")
    text = str(report.get("text") or "")
    kind = "lead" if len(text) < 320 else "lead long"
    next_step = ""
    if report.get("experiment"):
        next_step = '<p><a href="#experiment">Next experiment</a></p>\n'
    return (
        f'<p class="over">Diagnosis of {escape(_name(source))}'
        f'<span class="verdict {escape(verdict)}">{escape(verdict)}</span></p>\n'
        f"<h1>{escape(headline(report))}</h1>\n"
        f'<p class="{kind}">{escape(text)}</p>\n'
        f"{next_step}{_numbers(report)}"
    )


def _name(recording: Any) -> str:
    if isinstance(recording, Mapping):
        recording = recording.get("source") or recording.get("name")
    return Path(str(recording)).name if recording else "a recording"


def _numbers(report: Report) -> str:
    both = changed(report)
    heads = (
        ("", "error before", "error after", "noise floor") if both else ("", "error", "noise floor")
    )
    cells = [f'<div class="head">{h}</div>' for h in heads]
    for channel in ("contraction", "pressure"):
        before = (report.get("error_before") or {}).get(channel)
        after = (report.get("error_after") or {}).get(channel)
        floor = (report.get("noise_floor") or {}).get(channel)
        if not before and not floor:
            continue
        cells.append(f'<div class="what">{channel}</div>')
        cells.append(_big("before", before, _times(before)))
        if both:
            cells.append(_big("after", after, _times(after)))
        cells.append(_big("noise", floor, f"from {floor['from']}" if floor else ""))
    note = f'<p class="over">Root mean square {escape(held_out(report))}.</p>'
    kind = "numbers" if both else "numbers two"
    return f'<div class="{kind}">{"".join(cells)}</div>\n{note}' if len(cells) > len(heads) else ""


def _times(error: Report | None) -> str:
    if not error or error.get("times_floor") is None:
        return ""
    return f"{number(error['times_floor'])} {TIMES} the noise floor"


def _big(kind: str, value: Report | None, note: str) -> str:
    if not value or value.get("value") is None:
        return f'<div class="{kind}"><b>{DASH}</b></div>'
    unit = escape(str(value.get("unit") or ""))
    spread = interval(value.get("interval"))
    small = "".join(f"<small>{escape(s)}</small>" for s in (note, spread) if s)
    return f'<div class="{kind}"><b>{number(value["value"])} <i>{unit}</i></b>{small}</div>'


def _section(i: int, name: str, title: str, body: str) -> str:
    return f'<section id="{name}">\n<h2><span>{i}</span>{escape(title)}</h2>\n{body}\n</section>'


def _sections(report: Report, pictures: Mapping[str, Picture]) -> Iterable[tuple[str, str, str]]:
    def shown(*names: str) -> str:
        found = [_figure(pictures[n]) for n in names if n in pictures]
        return "\n".join(found) or f'<p class="none">{NOTHING[names[0]]}</p>'

    yield "replay", "Replay", shown("replay", "zoom")
    left = shown("residual", "structure", "scatter") + structure_table(report)
    yield "residual", "Residual", left
    loops = shown("loops")
    if report.get("readings"):
        loops = '<p class="none">For settled readings see the replay.</p>'
    yield "loops", "Hysteresis loops", loops
    yield "rivals", "Rival causes", shown("rivals") + why(report)
    yield "kinds", "Held out", shown("kinds")
    yield "effects", "Effect of each cause", shown("effects")
    yield "isolability", "Isolability of causes in this recording", shown("isolability")
    yield "details", "Details", "\n".join(part(report) for part in DETAILS)
    yield "provenance", "Provenance", provenance(report)


def _figure(picture: Picture) -> str:
    return (
        f'<figure id="figure-{picture.name}">\n<div class="scroll">{picture.svg}</div>\n'
        f"<figcaption>{escape(picture.caption)}</figcaption>\n</figure>"
    )


def _foot(report: Report) -> str:
    package = words((report.get("provenance") or {}).get("package") or "pam-envs")
    return (
        f"<footer>Made by {escape(package)}. All numbers are in report.json, the extended plant is "
        "in plant.yaml.</footer>"
    )
