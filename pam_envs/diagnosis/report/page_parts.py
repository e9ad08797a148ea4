"""Tables and numbers of the page as HTML, with all text escaped."""

from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any

from pam_envs.diagnosis.figures.quantities import MINUS, changed
from pam_envs.wording import enumeration

DASH = "\N{EN DASH}"
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: Any) -> str:
    """Return a number with three significant digits, or a dash for None."""
    if value is None:
        return DASH
    if not isinstance(value, float):
        return str(value)
    if value == 0:
        return "0"
    if abs(value) < 1e-3 or abs(value) >= 1e6:
        mantissa, exponent = f"{value:.2e}".split("e")
        text = f"{mantissa}·10{str(int(exponent)).translate(RAISED)}"
    else:
        text = f"{value:.0f}" if abs(value) >= 1000 else f"{value:#.3g}".rstrip(".")
    return text.replace("-", MINUS)


def interval(bounds: Sequence[float | None] | None) -> str:
    """Return "[low, high]", or an empty string."""
    if not bounds or all(b is None for b in bounds):
        return ""
    return f"[{', '.join(number(b) for b in bounds)}]"


def at(report: Any, *keys: str) -> Any:
    """Return a nested value of a report, or None if a part of the path is missing."""
    for key in keys:
        report = (report or {}).get(key)
    return report


def spread(value: Any) -> str:
    """Return the interval of a value, or an empty string."""
    return interval(at(value, "interval"))


def quantity(value: Any) -> str:
    """Return a value with its unit, or a dash."""
    if not value or value.get("value") is None:
        return DASH
    unit = value.get("unit") or ""
    return f"{number(value['value'])} {'' if unit == '1' else unit}".strip()


def words(value: Any) -> str:
    """Return nested values in words."""
    if isinstance(value, Mapping):
        return ", ".join(f"{k} {words(v)}" for k, v in value.items())
    if isinstance(value, (list, tuple)):
        return " ".join(words(v) for v in value)
    if isinstance(value, float):
        return number(value)
    return str(value)


def paragraph(text: str) -> str:
    """Return a paragraph, or an empty string for an empty text."""
    return f"<p>{escape(text)}</p>" if text else ""


def bullets(items: Sequence[str]) -> str:
    """Return a list."""
    return "<ul>" + "".join(f"<li>{escape(i)}</li>" for i in items) + "</ul>"


def table(
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    numbers: Sequence[int] = (),
    codes: Sequence[int] = (),
    flags: int | None = None,
) -> str:
    """Return a table of plain text, or an empty string without rows.

    It has no head if all are empty; ``numbers`` and ``codes`` are columns of numbers and of names
    of the code, ``flags`` is one of warnings.
    """
    if not rows:
        return ""

    def kind(column: int) -> str:
        return ' class="number"' if column in numbers else ""

    def cell(column: int, text: str) -> str:
        inner = escape(str(text))
        if column in codes and inner:
            inner = f"<code>{inner}</code>"
        if column == flags and inner:
            inner = f'<span class="flag">{inner}</span>'
        return f"<td{kind(column)}>{inner}</td>"

    head = "".join(f"<th{kind(i)}>{escape(h)}</th>" for i, h in enumerate(heads))
    body = "\n".join(
        "<tr>" + "".join(cell(i, text) for i, text in enumerate(row)) + "</tr>" for row in rows
    )
    top = f"<thead><tr>{head}</tr></thead>\n" if any(heads) else ""
    return f'<div class="scroll"><table>\n{top}<tbody>\n{body}\n</tbody></table></div>'


Report = Mapping[str, Any]


def structure_table(report: Report) -> str:
    """Return the table of the structure of the residuals."""
    both, rows = changed(report), []
    for side in ("before", "after")[: 1 + both]:
        for channel, found in (at(report, "residual_structure", side) or {}).items():
            if not found:
                continue
            rows.append(
                (
                    f"{channel}, {side}" if both else channel,
                    number(found.get("ljung_box_p")),
                    number(found.get("flexible_r2")),
                    quantity({"value": at(found, "peak", "frequency_hz"), "unit": "Hz"}),
                    number(at(found, "peak", "ratio")),
                )
            )
    heads = ("residual", "whiteness p", "flexible model r²", "spectral peak", "over neighbours")
    return table(heads, rows, numbers=(1, 2, 3, 4))


def held_out(report: Report) -> str:
    """Return the held-out data in words."""
    found = report.get("held_out")
    if not found:
        return "on held-out data"
    share = f"{100.0 * (found.get('share') or 0.0):.0f} % of the recording"
    if found["by"] == "blocks":
        return f"on held-out blocks of a few seconds, {share}"
    kinds = enumeration([str(k) for k in found["kinds"]])
    return f"on held-out kinds of experiment ({kinds}), {share}"


def why(report: Report) -> str:
    """Return the table of rivals with the reason of each decision."""
    rows = [
        (
            _title(r),
            r.get("form") or "",
            _gain(r.get("gain")),
            _gain(r.get("behind")),
            str(r.get("held_out") or ""),
            str(r.get("why") or ""),
        )
        for r in report.get("rivals") or []
    ]
    return table(("rival", "form", "gain", "behind the best", "held out", ""), rows, (2, 3))


FLAGS = {
    "outside_tolerance": "outside its tolerance",
    "at_bound": "at its bound",
    "not_identified": "hardly identified",
}


def _flags(entry: Report) -> str:
    """Return the flags of a fitted parameter in words."""
    return ", ".join(text for key, text in FLAGS.items() if entry.get(key))


def _title(entry: Report) -> str:
    return str(entry.get("title") or entry["name"])


def parameters(report: Report) -> str:
    """Return the tables of the named causes."""
    rows = [
        (
            _title(c),
            p["name"],
            quantity(p),
            spread(p),
            number(p.get("neutral")),
            _flags(p),
        )
        for c in report.get("causes") or []
        for p in c.get("parameters") or []
    ]
    heads: tuple[str, ...] = ("cause", "parameter", "value", "95 % interval", "neutral", "")
    body = table(heads, rows, (2, 3, 4), (1,), flags=5)
    named = report.get("causes") or []
    channels = dict.fromkeys(n for c in named for n in c.get("effect") or {})
    sizes = [
        (
            _title(c),
            c.get("form") or "",
            _gain(c.get("gain")),
            *(quantity(at(c, "effect", channel)) for channel in channels),
            number(c.get("size")),
        )
        for c in named
    ]
    shown = [f"on {channel.replace('_', ' ')}" for channel in channels]
    heads = ("cause", "form", "gain", *shown, "over the noise")
    body += table(heads, sizes, range(2, len(heads)))
    return f"<h3>Named causes</h3>\n{body or paragraph('No cause was named.')}"


def _gain(gain: Report | None) -> str:
    return f"{number(at(gain, 'value'))} {spread(gain)}".strip()


def experiment(report: Report) -> str:
    """Return the proposed experiment, if any."""
    found = report.get("experiment")
    if not found:
        return ""
    lines = [paragraph(str(found.get("description") or found.get("name") or ""))]
    between = " and ".join(str(b) for b in found.get("between") or [])
    apart = number(found.get("separation"))
    text = f"It separates {between} by {apart} noise variances."
    if not found.get("enough"):
        text = (
            f"No experiment of the list is sufficient: it would separate {between} by only "
            f"{apart} noise variances. Sensor: {found.get('sensor') or 'none is known'}."
        )
    lines.append(paragraph(text))
    segments = found.get("segments") or []
    lines.append(pieces_table(segments))
    title = str(found.get("name") or "").replace("_", " ")
    heading = f'<h3 id="experiment">Next experiment: {escape(title)}</h3>'
    return f'{heading}\n<div class="box">{"".join(lines)}</div>'


def pieces_table(segments: Sequence[Report]) -> str:
    """Return the table of an experiment's pieces; channels with equal setpoints share a column."""
    columns: dict[tuple[str, ...], list[str]] = {}
    first = segments[0]["from_bar"] if segments else {}
    for name in first if isinstance(first, Mapping) else ("",):
        columns.setdefault(tuple(_setpoint(s, name) for s in segments), []).append(name)
    heads, cells = ["duration [s]"], [tuple(f"{s['seconds']:g}" for s in segments)]
    for texts, names in columns.items():
        which = ", ".join(name.removeprefix("set_point").strip("_") for name in names)
        heads.append(f"setpoint {which}".strip() + " [bar]")
        cells.append(texts)
    for key, head in EXTRAS.items():
        values = [s[key] for s in segments if key in s]
        if any(values) or (values and key != "warmer_by_K"):
            heads.append(head)
            cells.append(tuple(f"{value:.4g}" for value in values))
    rows = list(zip(*cells, strict=True))
    return table([*heads, ""], [(*row, text) for row, text in _folded(rows)])


EXTRAS = {"load_N": "load [N]", "payload_kg": "payload [kg]", "warmer_by_K": "warmer by [K]"}
"""Further inputs of an experiment, with their headings."""


def _setpoint(segment: Report, channel: str) -> str:
    """Return the setpoints of a piece in one channel, in words."""
    if segment["valve"] == "closed":
        return "valve closed"
    ends = segment["from_bar"], segment["to_bar"]
    low, high = (f"{e[channel] if isinstance(e, Mapping) else e:.3g}" for e in ends)
    if low == high:
        return low
    hertz = segment.get("swing_hz")
    return f"sine from {low} to {high}, {hertz:g} Hz" if hertz else f"{low} to {high}"


def _folded(rows: Sequence[tuple[str, ...]]) -> list[tuple[tuple[str, ...], str]]:
    """Return rows without repeats of a block, and beside its last row how often it comes."""
    made, at = [], 0
    while at < len(rows):
        sizes = range(1, (len(rows) - at) // 2 + 1)
        same = (n for n in sizes if rows[at : at + n] == rows[at + n : at + 2 * n])
        size, times = next(same, 1), 1
        block = rows[at : at + size]
        while rows[at + times * size : at + (times + 1) * size] == block:
            times += 1
        last = f"{times} times" if size == 1 else f"the last {size} rows {times} times"
        made += [(row, "") for row in block[:-1]]
        made.append((block[-1], last if times > 1 else ""))
        at += times * size
    return made


def closed_loop(report: Report) -> str:
    """Return the closed-loop comparison."""
    found = report.get("closed_loop")
    if not found:
        reason = report.get("closed_loop_reason")
        text = f"No controller was compared: {reason}." if reason else "No controller was compared."
        return "<h3>In closed loop</h3>\n" + paragraph(text)
    unit = found.get("unit") or "mm"
    labels = {
        "before": "designed on the plant before",
        "after": "designed on the extended plant",
        "oracle": "designed on the rig itself",
    }
    rows = [
        (label, quantity({**found[key], "unit": unit}), spread(found[key]))
        for key, label in labels.items()
        if found.get(key)
    ]
    better = found.get("better_percent") or {}
    if better.get("value") is not None:
        rows.append(("better by", quantity({**better, "unit": "%"}), spread(better)))
    if found.get("recovered") is not None:
        rows.append(("closed share of the gap", f"{number(100 * found['recovered'])} %", ""))
    who = f"{found.get('controller', 'controller')}, run on {found.get('where', 'the plant')}"
    body = table((who, "error", "95 % interval"), rows, (1, 2))
    return "<h3>In closed loop</h3>\n" + paragraph(str(found.get("text") or "")) + body


def calibration(report: Report) -> str:
    """Return the table of refitted parameters."""
    rows = [
        (
            entry["name"],
            entry.get("unit") or "",
            number(entry.get("before")),
            number(entry.get("after")),
            spread(entry),
            _flags(entry),
        )
        for entry in report.get("calibration") or []
    ]
    heads = ("parameter", "unit", "before", "after", "95 % interval", "")
    body = table(heads, rows, (2, 3, 4), (0,), flags=5)
    return "<h3>Calibration</h3>\n" + (body or paragraph("Nothing was refitted."))


def not_testable(report: Report) -> str:
    """Return the table of causes that are not testable, with the reason."""
    reasons: dict[str, list[str]] = {}
    for entry in report.get("not_testable") or []:
        reasons.setdefault(entry["reason"], []).append(entry["name"])
    rows = [(", ".join(names), reason) for reason, names in reasons.items()]
    body = table(("causes", "reason"), rows, codes=(0,))
    return "<h3>Not testable</h3>\n" + (body or paragraph("Every cause could be tested."))


def warnings(report: Report) -> str:
    """Return the warnings."""
    found = [str(w) for w in report.get("warnings") or []]
    return "<h3>Warnings</h3>\n" + (bullets(found) if found else paragraph("None."))


ERRORS = ("parameters", "cells_mm", "left_out_mm", "load_left_out_mm")


def readings(report: Report) -> str:
    """Return the models and load laws of settled readings."""
    found = report.get("readings")
    if not found:
        return ""
    rows = [
        (", ".join(step["model"]) or "load-blind", *(number(step.get(key)) for key in ERRORS))
        for step in found.get("ladder") or []
    ]
    heads = ("model", "parameters", "fitted [mm]", "held out [mm]", "held-out load [mm]")
    laws = [
        (
            law["law"],
            quantity(law),
            spread(law),
            number(law.get("load_left_out_mm")),
            law.get("status") or "",
        )
        for law in found.get("load_laws") or []
    ]
    body = table(heads, rows, (1, 2, 3, 4))
    left, cut = found.get("loads_left_out"), at(found, "loads_left_out", "cut_percent")
    if cut:
        body += paragraph(
            f"Error on a held-out load: {quantity(left['after'])} instead of "
            f"{quantity(left['before'])}, {number(cut['value'])} % less {spread(cut)}."
        )
    law_heads = ("load law", "value", "95 % interval", "held-out load [mm]", "")
    return f"<h3>Models in steps</h3>\n{body}{table(law_heads, laws, (1, 2, 3))}"


DETAILS: Sequence[Callable[[Report], str]] = (
    parameters,
    readings,
    calibration,
    closed_loop,
    experiment,
    not_testable,
    warnings,
)


def provenance(report: Report) -> str:
    """Return the table of inputs and versions."""
    rows = [(k.replace("_", " "), words(v)) for k, v in (report.get("provenance") or {}).items()]
    rows.append(("decision rule", f"version {report.get('rule_version')}"))
    rows.append(("report", f"schema {report.get('schema')}"))
    return table(("", ""), rows, codes=(1,))
