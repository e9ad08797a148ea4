"""Page of a diagnosis and its figures."""

import re

import jsonschema
import numpy as np
import pytest

from pam_envs.diagnosis.figures import draw
from pam_envs.diagnosis.figures.of_report import alike
from pam_envs.diagnosis.figures.quantities import View, elapsed, envelope, worst_window
from pam_envs.diagnosis.report import page as page_module
from pam_envs.diagnosis.report.page import headline, page
from pam_envs.diagnosis.report.page_parts import number
from tests.diagnosis.report import report_fakes as fakes
from tests.diagnosis.report.page_reader import SECTIONS, Page


@pytest.fixture(scope="module")
def html():
    made = fakes.diagnosis("named")
    return page(fakes.stored(made.report), made.traces)


def test_page_does_not_show_the_runtime(monkeypatch):
    monkeypatch.setattr(page_module, "draw", lambda *_: {})
    made = fakes.diagnosis("named")
    quick, slow = (fakes.stored(made.report | {"runtime_s": seconds}) for seconds in (0.5, 99.0))
    assert page(slow, made.traces) == page(quick, made.traces)


def test_each_section_has_its_figures_with_caption_and_alternative(html):
    read = Page(html)
    assert read.figures == SECTIONS
    shown = sum(len(names) for names in SECTIONS.values())
    assert read.captions == shown
    assert len(read.labels) == shown
    assert all(len(label) > 20 for label in read.labels)


def test_page_is_self_contained(html):
    read = Page(html)
    assert "http" not in html
    assert "@import" not in html
    assert not read.tags & {"script", "link", "iframe", "object", "img"}
    assert all(a.startswith("#") for a in read.addresses)
    assert not re.findall(r"url\((?!#)", html)


def test_ids_are_unique_and_every_reference_has_its_target(html):
    read = Page(html)
    assert len(read.ids) == len(set(read.ids))
    targets = {a[1:] for a in read.addresses} | set(re.findall(r"url\(#([^)]+)\)", html))
    assert targets <= set(read.ids)
    assert len(targets) > 20


def test_figures_use_colours_of_the_page(html):
    used = set(re.findall(r"var\(--([a-z]+)\)", html))
    assert used <= set(re.findall(r"--([a-z]+):", html))
    drawn = "".join(re.findall(r"<svg.*?</svg>", html, re.DOTALL))
    assert not re.findall(r"#(?:[0-9a-f]{6})\b(?=[;\"])", drawn)
    assert "prefers-color-scheme: dark" in html


def test_text_from_users_is_escaped():
    made = fakes.diagnosis("named")
    evil = '<script>alert("x")</script> & $\\frac{$ <b onload=1>'
    made.report["text"] = evil
    made.report["warnings"] = [evil]
    made.report["causes"] = [fakes.CREEP | {"title": evil, "form": evil}]
    made.report["provenance"]["rig"]["source"] = evil
    made.report["not_testable"] = [{"name": evil, "reason": evil}]
    made.report["isolability"]["names"][0] = evil
    made.report["rivals"][2]["name"] = made.report["rivals"][2]["title"] = evil
    made.traces.segments = (evil, "階段", *made.traces.segments[2:-1], evil)
    read = Page(page(fakes.stored(made.report), made.traces))
    assert "script" not in read.tags
    assert "onload" not in read.attributes
    assert read.text.count(evil) >= 6
    assert "階段" in read.text  # no font that text is measured with has these


def without(*names):
    made = fakes.diagnosis("named")
    for name in names:
        setattr(made.traces, name, None)
    return made


@pytest.mark.parametrize("channel", ["contraction", "pressure"])
def test_page_of_a_single_output(channel):
    made = fakes.diagnosis("named")
    other = "pressure" if channel == "contraction" else "contraction"
    for outputs in (made.traces.measured, made.traces.base, made.traces.extended):
        outputs[other] = None
    for key in ("noise_floor", "error_before", "error_after"):
        made.report[key][other] = None
    made.report["residual_structure"]["before"][other] = None
    made.report["residual_structure"]["after"][other] = None
    found = fakes.checked(made.report)
    read = Page(page(found, made.traces))
    assert {"replay", "residual", "loops", "kinds"} <= set().union(*read.figures.values())
    assert any(label.startswith(f"residual of {channel} over") for label in read.labels)


def test_missing_channels_are_left_out_of_the_page():
    made = without("temperature", "load", "command")
    made.report |= {"closed_loop": None, "isolability": None, "rivals": [], "calibration": []}
    made.report["closed_loop_reason"] = "a controller cannot compensate creep"
    made.report["noise_floor"] = {"contraction": None, "pressure": None}
    found = fakes.checked(made.report)
    read = Page(page(found, made.traces))
    assert "No controller was compared: a controller cannot compensate creep." in read.text
    assert "Nothing was refitted." in read.text
    assert read.figures["rivals"] == read.figures["isolability"] == set()
    assert read.figures["loops"] == {"loops"}


def test_without_traces_the_figures_of_the_report_remain():
    found = fakes.stored(fakes.report())
    assert set(draw(found, None)) == {"structure", "rivals", "kinds", "isolability"}


def test_page_without_held_out_data_has_no_close_up():
    made = fakes.diagnosis("named")
    made.traces.held_out[:] = False
    names = set(draw(fakes.stored(made.report), made.traces))
    assert "zoom" not in names
    assert {"replay", "residual"} <= names


def test_settled_readings_are_drawn_by_load():
    cells = 2 * 9
    pressure = [*range(5), *range(3, -1, -1)] * 2
    curves = {
        "load_kg": [0.0] * 9 + [2.5] * 9,
        "pressure_bar": pressure,
        "deflating": ([False] * 5 + [True] * 4) * 2,
        "used": [True] * cells,
        "path": [0] * 9 + [1] * 9,
        "measured_mm": [2.0 * p for p in pressure],
        "readings_mm": [[2.0 * p + d for p in pressure] for d in (-0.1, 0.1)],
        "base_mm": [1.9 * p for p in pressure],
        "extended_mm": [2.01 * p for p in pressure],
        "effects_mm": {"creep": [0.1 * p for p in pressure]},
    }
    found = fakes.stored(fakes.report())
    found["readings"] = {
        "ladder": [
            {
                "model": [],
                "parameters": 9,
                "cells_mm": 0.5,
                "left_out_mm": 0.6,
                "load_left_out_mm": 0.7,
                "chosen": None,
                "tried": [],
            }
        ],
        "curves": curves,
    }
    jsonschema.validate(found, fakes.SCHEMA)
    read = Page(page(found, None))
    assert read.figures["replay"] == {"replay"}
    assert {"residual", "structure"} <= read.figures["residual"]
    assert read.figures["effects"] == {"effects"}
    assert "2.5 kg" in read.text
    assert "load-blind" in read.text


def test_ambiguous_headline_names_each_rival_once():
    assert headline(fakes.report("ambiguous")) == "Creep of the muscle or first cycle softening"


def test_numbers_are_written_with_three_digits():
    given = (0.0, 0.05, 123.4, -0.5, 12345.6, 8.83e-4, None, 3, True)
    written = [number(v) for v in given]
    minus, dash = "\N{MINUS SIGN}", "\N{EN DASH}"
    exponent = "\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT FOUR}"
    assert written == [
        "0",
        "0.0500",
        "123",
        f"{minus}0.500",
        "12346",
        f"8.83·10{exponent}",
        dash,
        "3",
        "True",
    ]


def test_thinned_line_keeps_extremes():
    rng = np.random.default_rng(0)
    x, y = np.arange(30_000.0), rng.normal(size=30_000)
    y[12_345], y[20_001] = 50.0, -50.0
    y[100:400] = np.nan
    u, v = envelope(x, y, 2400)
    assert len(v) <= 2400
    assert np.nanmax(v) == 50.0 and np.nanmin(v) == -50.0
    assert np.all(np.diff(u) >= 0)
    assert np.isnan(v).any()
    assert np.array_equal(np.interp(u, x, np.nan_to_num(y)), np.nan_to_num(v))


def test_page_of_long_recording_is_small():
    made = fakes.diagnosis("named", rows=30_000, period=0.02)
    html = page(fakes.stored(made.report), made.traces)
    assert len(html.encode()) < 3e6


def test_time_axis_continues_when_a_recording_restarts():
    time = np.array([0.0, 0.1, 0.2, 0.0, 0.1, 50.0, 50.1])
    assert elapsed(time) == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6])


def test_close_up_shows_the_largest_error():
    view = View.of(fakes.traces())
    span = view.spans[4]
    error = np.zeros(len(view.clock))
    error[span.start + 120] = 1.0
    rows = worst_window(view.clock, error, span, 5.0)
    assert rows.start <= span.start + 120 < rows.stop
    assert rows.stop - rows.start == 50
    assert span.start <= rows.start and rows.stop <= span.stop


def test_confusable_causes_are_drawn_side_by_side():
    cosine = np.eye(6)
    for a, b in ((0, 3), (1, 4), (2, 5)):
        cosine[a, b] = cosine[b, a] = 0.95
    cosine += 0.05
    order = alike(cosine)
    assert sorted(order) == list(range(6))
    assert all(abs(order.index(a) - order.index(b)) == 1 for a, b in ((0, 3), (1, 4), (2, 5)))


def test_extension_without_effect_is_not_drawn():
    made = fakes.traces()
    made.extended = {channel: values.copy() for channel, values in made.base.items()}
    assert View.of(made).extended == {}
