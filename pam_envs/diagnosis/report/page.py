"""Page of a diagnosis: one self-contained HTML file, figures first, no script."""

from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path
from typing import Any

from pam_envs.diagnosis.figures import Picture, draw
from pam_envs.diagnosis.figures.quantities import TIMES, changed
from pam_envs.diagnosis.report import page_parts as pp
from pam_envs.wording import enumeration

CSS = Path(__file__).with_name("page.css")
VERDICTS = {
    "named": "the cause is named",
    "ambiguous": "more than one cause fits",
    "adequate": "the plant is adequate",
    "unexplained": "no candidate explains the model error",
    "insufficient": "the recording cannot decide",
}
NOTHING = dict.fromkeys(("replay", "residual"), "There are no traces to show.") | {
    "loops": "There is no loop to show: it needs an output and a pressure or its command.",
    "rivals": "No rival was fitted.",
    "kinds": "No kind of segment was held out.",
    "effects": "No cause was named, so there is no effect to show.",
    "isolability": "Fewer than two causes are testable on this recording.",
}
Report = Mapping[str, Any]


def page(report: Report, traces: Any) -> str:
    """Return ``report.html`` of a report and its traces; ModuleNotFoundError without matplotlib."""
    pictures = draw(report, traces)
    parts = list(enumerate(_sections(report, pictures), start=1))
    sections = [
        f'<section id="{name}">\n<h2><span>{i}</span>{escape(title)}</h2>\n{body}\n</section>'
        for i, (name, title, body) in parts
    ]
    links = "".join(
        f'<a href="#{name}">{i}&ensp;{escape(title)}</a>' for i, (name, title, _) in parts
    )
    package = pp.words(pp.at(report, "provenance", "package") or "pam-envs")
    title = escape(f"Diagnosis: {headline(report)}")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{title}</title>\n<style>\n{CSS.read_text(encoding='utf-8')}</style>\n"
        f"</head>\n<body>\n<header>\n{_head(report)}\n<nav>{links}</nav>\n</header>\n"
        f"<main>\n{chr(10).join(sections)}\n<footer>Made by {escape(package)}. All numbers are in "
        "report.json, the extended plant is in plant.yaml.</footer>\n</main>\n</body>\n</html>\n"
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
    source = pp.at(report, "provenance", "recording")
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
    heads = ["", "error before", "error after"] if both else ["", "error"]
    cells = [f'<div class="head">{head}</div>' for head in (*heads, "noise floor")]
    for channel in report.get("noise_floor") or report.get("error_before") or {}:
        keys = ("error_before", "error_after", "noise_floor")
        before, after, floor = (pp.at(report, key, channel) for key in keys)
        if not before and not floor:
            continue
        cells.append(f'<div class="what">{escape(channel.replace("_", " "))}</div>')
        for kind, error in (("before", before), ("after", after))[: 1 + both]:
            times = pp.at(error, "times_floor")
            note = "" if times is None else f"{pp.number(times)} {TIMES} the noise floor"
            cells.append(_big(kind, error, note))
        cells.append(_big("noise", floor, f"from {floor['from']}" if floor else ""))
    if len(cells) <= len(heads) + 1:
        return ""
    note = f'<p class="over">Root mean square {escape(pp.held_out(report))}.</p>'
    return f'<div class="numbers{"" if both else " two"}">{"".join(cells)}</div>\n{note}'


def _big(kind: str, value: Report | None, note: str) -> str:
    if not value or value.get("value") is None:
        return f'<div class="{kind}"><b>{pp.DASH}</b></div>'
    unit = escape(str(value.get("unit") or ""))
    small = "".join(f"<small>{escape(s)}</small>" for s in (note, pp.spread(value)) if s)
    return f'<div class="{kind}"><b>{pp.number(value["value"])} <i>{unit}</i></b>{small}</div>'


def _sections(report: Report, pictures: Mapping[str, Picture]) -> Iterable[tuple[str, str, str]]:
    def shown(*names: str) -> str:
        found = [
            f'<figure id="figure-{p.name}">\n<div class="scroll">{p.svg}</div>\n'
            f"<figcaption>{escape(p.caption)}</figcaption>\n</figure>"
            for p in (pictures[n] for n in names if n in pictures)
        ]
        return "\n".join(found) or f'<p class="none">{NOTHING[names[0]]}</p>'

    yield "replay", "Replay", shown("replay", "zoom")
    left = shown("residual", "structure", "scatter") + pp.structure_table(report)
    yield "residual", "Residual", left
    loops = shown("loops")
    if report.get("readings"):
        loops = '<p class="none">For settled readings see the replay.</p>'
    yield "loops", "Hysteresis loops", loops
    yield "rivals", "Rival causes", shown("rivals") + pp.why(report)
    yield "kinds", "Held out", shown("kinds")
    yield "effects", "Effect of each cause", shown("effects")
    yield "isolability", "Isolability of causes in this recording", shown("isolability")
    yield "details", "Details", "\n".join(part(report) for part in pp.DETAILS)
    yield "provenance", "Provenance", pp.provenance(report)
