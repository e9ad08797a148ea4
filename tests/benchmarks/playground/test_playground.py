"""Playground: the page in a browser, bit by bit as in Python."""

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.exported import differing
from benchmarks.playground import page
from benchmarks.playground.replay import replay, sweep
from benchmarks.playground.scenes import SCENES
from pam_envs.kernels.build import COMPILED
from tests.browser import NAMES, Browser, PageError, find

pytest.importorskip("ziglang")
pytestmark = [
    pytest.mark.skipif(not COMPILED, reason="the kernels are compiled"),
    pytest.mark.xdist_group("playground"),
]
PROGRAM = find()
needs_browser = pytest.mark.skipif(
    PROGRAM is None, reason=f"no browser here; install one of {', '.join(NAMES)}"
)
DRIVER = Path(__file__).with_name("playground_driver.js")
STEPS = 1000
MOST = 1_500_000
"""Bytes of the page."""
MUSCLE = {"load": 2.55, "friction": 1.0, "creep": 0.0, "dead_time": 45.0}
OTHER = {"load": 4.1, "friction": 0.65, "creep": 12.0, "dead_time": 80.0}
KNEE = {"load": 90.0, "friction": 0.8, "creep": 5.0, "dead_time": 60.0}
EXACT = {
    "usual": ("muscle", "maxwell_slip", "inverse_pid", 1, MUSCLE),
    "changed": ("muscle", "maxwell_slip", "pid", 7, OTHER),
    "curves": ("muscle", "preisach", "inverse", 3, OTHER),
    "ideal": ("muscle", "none", "pid", 4, MUSCLE),
    "swept": ("muscle", "preisach", "sweep", 5, OTHER),
    "walk": ("knee", "maxwell_slip", "knee_inverse_ahead_ltr", 1, KNEE),
    "walk_preisach": ("knee", "preisach", "knee_inverse", 2, KNEE),
    "walk_ideal": ("knee", "none", "knee_pid", 2, KNEE),
}
POLICIES = {
    "policy": ("muscle", "maxwell_slip", "ppo", 1, MUSCLE),
    "walk_policy": ("knee", "maxwell_slip", "ppo_knee_walk", 1, KNEE),
}
CASES = {**EXACT, **POLICIES}
COMPARED = """new Promise((done) => {
  const look = () => {
    if (document.body.dataset.compared) done(document.getElementById("score").innerText);
    else setTimeout(look, 20);
  };
  look();
})"""
"""Scores on the page, once all controllers are compared."""


def settings(scene: str, hysteresis: str, controller: str, seed: int, values: Any) -> Any:
    return {
        "scene": scene,
        "hysteresis": hysteresis,
        "controller": controller,
        "seed": seed,
        "values": values,
    }


@pytest.fixture(scope="module")
def built() -> str:
    """Return the page."""
    return page.build()


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Return a browser, which has no way out of this machine."""
    with Browser(str(PROGRAM), tmp_path_factory.mktemp("browser") / "profile") as found:
        yield found


@pytest.fixture(scope="module")
def address(built: str, tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the address of the page."""
    path = tmp_path_factory.mktemp("playground") / "index.html"
    path.write_text(built, encoding="utf-8")
    return path.as_uri()


@pytest.fixture(scope="module")
def seen(browser: Browser, address: str) -> Any:
    """Return what the page shows while the driver operates it."""
    jobs = json.dumps([[name, settings(*case), STEPS] for name, case in CASES.items()])
    with browser.page(address) as page:
        return page.evaluate(f"(async (JOBS) => {{\n{DRIVER.read_text()}}})({jobs})")


def outputs_of(run: Any) -> np.ndarray[Any, Any]:
    return np.frombuffer(base64.b64decode(run["outputs"]), np.float64)


@needs_browser
def test_page_loads_no_further_file(seen: Any) -> None:
    assert seen["files"] == []


@needs_browser
@pytest.mark.parametrize("name", EXACT)
def test_thousand_steps_in_the_browser_have_the_bits_of_python(seen: Any, name: str) -> None:
    scene, hysteresis, controller, seed, values = EXACT[name]
    run = replay(scene, hysteresis, controller, seed, STEPS, **values)
    assert len(run.outputs) == STEPS + 1
    assert differing(outputs_of(seen["runs"][name]), run.outputs.ravel()) == 0
    assert seen["runs"][name]["rms"] == pytest.approx(run.rms, rel=1e-9)


@needs_browser
@pytest.mark.parametrize("name", POLICIES)
def test_policies_agree_within_the_rounding_of_float32(seen: Any, name: str) -> None:
    scene, hysteresis, controller, seed, values = POLICIES[name]
    run = replay(scene, hysteresis, controller, seed, STEPS, **values)
    found = outputs_of(seen["runs"][name]).reshape(run.outputs.shape)
    at = run.names.index("info.state/pressure")
    assert np.abs(found[:, at] - run["info.state/pressure"]).max() < 50.0  # Pa
    assert seen["runs"][name]["rms"] == pytest.approx(run.rms, rel=1e-3)


@needs_browser
def test_program_on_the_page_computes_the_same_run(
    seen: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    program = seen["heavy"]["python"]
    assert "load=4.5" in program
    found: dict[str, Any] = {}
    exec(compile(program, "program", "exec"), found)
    rms, unit = capsys.readouterr().out.split()
    assert f"{float(rms):.3g}" in seen["heavy"]["score"].replace("\n", " ")
    assert unit == "mm"


@needs_browser
def test_sliders_change_the_run_and_the_link(seen: Any) -> None:
    assert seen["load"] == 4.5
    assert seen["heavy"]["score"] != seen["usual"]
    assert "load=4.5" in seen["heavy"]["address"]
    assert seen["parsed"] == seen["heavy"]["address"]
    assert seen["idle"] is True  # friction of a muscle without hysteresis


@needs_browser
def test_link_with_wrong_values_shows_the_usual_state(seen: Any) -> None:
    usual = settings("muscle", "maxwell_slip", "inverse_pid", 1, {})
    words = {key: str(value) for key, value in usual.items() if key != "values"}
    found = dict(pair.split("=") for pair in seen["wrong"].removeprefix("#").split("&"))
    assert words.items() <= found.items()
    assert float(found["load"]) == 2.55


@needs_browser
def test_controllers_are_ranked_and_charts_are_drawn(seen: Any) -> None:
    assert set(seen["ranks"]) == set(SCENES["knee"].controllers)
    assert seen["rms"] == sorted(seen["rms"])
    assert min(seen["pixels"]) > 20  # colours, of lines and their edges


@needs_browser
@pytest.mark.parametrize("width", [320, 390, 768, 1280])
def test_page_fits_the_width_of_the_screen(browser: Browser, address: str, width: int) -> None:
    with browser.page(address) as page:
        page.resize(width, 800)
        page.evaluate(COMPARED)
        assert page.evaluate("document.documentElement.scrollWidth") == width


@needs_browser
def test_page_works_in_a_frame_without_an_address(browser: Browser, built: str) -> None:
    with browser.page("about:blank") as page:
        page.evaluate(f"""
          globalThis.frame = Object.assign(document.createElement("iframe"), {{
            srcdoc: {json.dumps(built)}
          }});
          new Promise((done) => {{
            frame.onload = done;
            document.body.append(frame);
          }})""")
        score = page.evaluate(COMPARED.replace("document", "frame.contentDocument"))
        assert "RMS error" in score


@needs_browser
def test_failure_of_the_simulation_is_shown_and_ends_with_valid_settings(
    browser: Browser, address: str
) -> None:
    with browser.page(address) as page:
        page.evaluate(COMPARED)
        with pytest.raises(PageError, match="no such module"):
            page.evaluate("""
              globalThis.usualInstance = engine.instance;
              engine.instance = () => { throw new RangeError("no such module"); };
              change({ ...page.settings, seed: 2 });
              new Promise(() => {})""")
        assert "no such module" in page.evaluate("one('fault').innerText")
        page.evaluate("engine.instance = usualInstance; change({ ...page.settings, seed: 3 })")
        page.evaluate(COMPARED)
        assert page.evaluate("one('fault').hidden") is True


@needs_browser
@pytest.mark.parametrize(
    ("script", "message"),
    [
        ("undefinedName()", "undefinedName is not defined"),
        ("Promise.reject(new Error('late'))", "late"),
        ("eval('1')", "Content Security Policy"),
    ],
)
def test_browser_reports_what_a_page_throws(
    browser: Browser, tmp_path: Path, script: str, message: str
) -> None:
    policy = "default-src 'none'; script-src 'unsafe-inline'"
    path = tmp_path / "page.html"
    path.write_text(
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        f"<script>setTimeout(() => {{ {script} }}, 50)</script>"
    )
    with pytest.raises(PageError, match=message), browser.page(path.as_uri()) as page:
        page.evaluate("new Promise(() => {})")


@needs_browser
def test_browser_ends_a_wait_at_its_limit(
    browser: Browser, monkeypatch: pytest.MonkeyPatch
) -> None:
    with browser.page("about:blank") as page:
        monkeypatch.setattr(browser, "limit", 0.2)
        with pytest.raises(TimeoutError, match=r"no answer after 0\.2 s"):
            page.evaluate("new Promise(() => {})")
        monkeypatch.undo()


@needs_browser
def test_browser_that_cannot_start_is_reported(tmp_path: Path) -> None:
    broken = tmp_path / "broken"
    broken.write_text("#!/bin/sh\necho no display >&2\n")
    broken.chmod(0o755)
    with (
        Browser(str(broken), tmp_path / "profile") as found,
        pytest.raises(OSError, match="no display"),
        found.page("about:blank"),
    ):
        pass


def test_page_is_one_small_file_without_addresses(built: str) -> None:
    assert len(built.encode()) <= MOST
    assert "http://" not in built and "https://" not in built
    assert "{{" not in built


def test_sweep_rises_and_falls() -> None:
    values = [sweep(k) for k in range(801)]
    assert values[0] == values[800] == -1.0
    assert values[400] == max(values) == 0.75


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scene": "nowhere"}, "no scene named 'nowhere'; there are: muscle, knee"),
        ({"scene": "muscle", "controller": "knee_pid"}, "no controller named 'knee_pid' in muscle"),
        ({"scene": "muscle", "hysteresis": "none_"}, "no hysteresis named"),
        ({"scene": "muscle", "load": 6.0}, "load = 6.0 must be from 0 to 5 kg"),
        ({"scene": "muscle", "mass": 1.0}, "no slider named 'mass'"),
    ],
)
def test_wrong_arguments_of_a_replay_are_named(arguments: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replay(**arguments)
