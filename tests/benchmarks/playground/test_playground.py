"""Playground: the page in a browser, bit by bit as in Python."""

import base64
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import value_of

from benchmarks.exported import differing
from benchmarks.playground import page
from benchmarks.playground.replay import replay, sweep
from benchmarks.playground.scenes import SCENES
from pam_envs.kernels.build import COMPILED

pytest.importorskip("ziglang")
pytestmark = [
    pytest.mark.skipif(not COMPILED, reason="the kernels are compiled"),
    pytest.mark.xdist_group("playground"),
]
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
BROWSER = next((path for path in map(shutil.which, BROWSERS) if path), None)
needs_browser = pytest.mark.skipif(
    BROWSER is None, reason=f"no browser here; install one of {', '.join(BROWSERS)}"
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
def seen(built: str, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return what the driver saw in the browser, which has no way out of this machine."""
    folder = tmp_path_factory.mktemp("playground")
    jobs = [[name, settings(*case), STEPS] for name, case in CASES.items()]
    inside = json.dumps(built).replace("</", "<\\/")
    driver = f"const JOBS = {json.dumps(jobs)};\nconst PAGE = {inside};\n{DRIVER.read_text()}"
    path = folder / "index.html"
    path.write_text(built.replace("</body>", f"<script>{driver}</script></body>"))
    text = value_of(
        str(BROWSER), path.as_uri(), "document.getElementById('seen')?.textContent",
        folder / "profile", 400.0,
    )  # fmt: skip
    return json.loads(text)


def outputs_of(run: Any) -> np.ndarray[Any, Any]:
    return np.frombuffer(base64.b64decode(run["outputs"]), np.float64)


@needs_browser
def test_nothing_fails_and_nothing_is_loaded_from_elsewhere(seen: Any) -> None:
    assert seen["faults"] == []
    assert seen["loadedFiles"] == []


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
    assert seen["loaded"] == 4.5
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
def test_page_is_as_wide_as_a_phone(seen: Any) -> None:
    assert [tuple(pair) for pair in seen["widths"]] == [(390, 390), (1280, 1280)]


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
