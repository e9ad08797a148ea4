"""Site: equal bytes for equal rows, and interaction in a real browser."""

import html
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import board_fakes as fakes
import pytest

from benchmarks.__main__ import main
from benchmarks.board import leaderboard, site
from benchmarks.runs import rows, traces
from benchmarks.runs.controllers import find
from benchmarks.runs.runner import Options, run
from benchmarks.runs.store import write_json
from sweeps.limits import scaled

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
BROWSER = next((path for path in map(shutil.which, BROWSERS) if path), None)
pytestmark = pytest.mark.xdist_group("site")
needs_browser = pytest.mark.skipif(
    BROWSER is None, reason=f"no browser here; install one of {', '.join(BROWSERS)}"
)
HOSTILE = "<img src=x onerror=\"document.title='taken'\"></script><b id=taken>bold</b>"

DRIVER = Path(__file__).with_name("site_driver.js")


def page_rows() -> list[dict[str, Any]]:
    made = fakes.board()
    made[0]["controller"]["summary"] = HOSTILE
    made[1]["verified"] = {"date": "2026-01-03", "mode": "bits"}
    for episode in made[3]["episodes"]:
        episode["scores"]["rms_error"] = None  # a row without a score breaks no table
    return made


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Folder with the page of the fakes."""
    out = tmp_path_factory.mktemp("page")
    for name, text in site.page(page_rows()).items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text)
    return out


def browse(address: str, folder: Path) -> str:
    """Return the page after its scripts have run, without any way out of this machine."""
    command = [
        *(str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--disable-extensions"),
        *("--proxy-server=127.0.0.1:9", f"--user-data-dir={folder / 'profile'}"),
        *("--virtual-time-budget=20000", "--dump-dom", address),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=scaled(120), check=True)
    return done.stdout


@pytest.fixture(scope="module")
def seen(built, tmp_path_factory):
    """Observations of the browser's driver after each click on the page."""
    copy = tmp_path_factory.mktemp("driven")
    shutil.copytree(built, copy, dirs_exist_ok=True)
    (copy / "data/traces/short_nominal--zero.js").unlink()
    shutil.copy(DRIVER, copy / "driver.js")
    index = (copy / "index.html").read_text()
    (copy / "index.html").write_text(
        index.replace("</body>", '<script src="driver.js"></script></body>')
    )
    shown = browse((copy / "index.html").as_uri(), copy)
    found = re.search(r'<pre id="result">(.*?)</pre>', shown, re.DOTALL)
    assert found, shown[-2000:]
    result: dict[str, Any] = json.loads(html.unescape(found[1]))
    return result


ORDER = ["ppo", "inverse", "pid", "zero", "young", "outside"]


@needs_browser
def test_page_is_valid_and_loads_only_local_files(seen):
    assert seen["faults"] == []
    assert {"page.css", "board.js", "page.js"} <= {Path(name).name for name in seen["loaded"]}
    assert all(name.startswith("file:") for name in seen["loaded"])


@needs_browser
def test_verdicts_and_rank_changes_are_shown(seen):
    assert "inverse" in seen["winners"]
    assert seen["winners"].endswith("better (settings tried: 40, 0 for inverse)")
    assert "inverse 2 → 3" in seen["changes"]
    assert seen["places"] == 4


@needs_browser
def test_rows_are_in_their_groups_with_intervals(seen):
    assert seen["first"] == ORDER
    named = site.GROUPS.items()  # no row is of a controller with the plant of each episode
    assert seen["groups"] == [title for name, title in named if title and name != "informed"]
    assert seen["intervals"] == len(ORDER) - 1
    assert seen["round"].startswith("Audit round 2, drawn 2026-01-02: 6 episodes")


@needs_browser
def test_headings_name_episodes_and_unverified_columns(seen):
    expected = ["audit RMS [mm] [95 %]", "IQM [mm]", "public RMS [mm]", "audit - public [mm]"]
    expected += ["P(improvement), audit episodes", "step [µs] *", "trained [steps] *"]
    assert set(expected) <= set(seen["headings"])


@needs_browser
def test_heading_click_sorts_within_groups_up_down_and_resets(seen):
    assert seen["up"] == ["inverse", "pid", "ppo", "zero", "young", "outside"]
    assert seen["down"] == ["zero", "ppo", "pid", "inverse", "young", "outside"]
    assert seen["none"] == ORDER
    assert seen["sorted"].startswith("audit - public")


@needs_browser
def test_filters_keep_matching_rows(seen):
    assert seen["kinds"] == ["inverse", "pid", "zero", "ppo", "young", "outside"]
    assert seen["nothing"] == ["zero"]
    assert seen["reported"] == ["outside"]
    assert seen["query"] == ["pid"]
    assert seen["other"] == ["ppo", "pid", "inverse", "zero"]
    assert seen["figure"] == "figures/short_wrong_model.svg"


@needs_browser
def test_click_opens_trajectories_loop_and_commands(seen):
    assert "row=short_nominal--pid" in seen["address"]
    assert seen["charts"] == 4
    # two errors, two loops, one pressure; reference, output, and the best classical one's output
    assert len(seen["lines"]) == 8
    assert all(line.count("L") > 200 and "NaN" not in line for line in seen["lines"])
    assert "the plant's loop" in seen["words"]
    assert "inverse" in seen["words"]
    assert "python -m benchmarks verify short_nominal--pid" in seen["again"]
    assert seen["bibtex"].startswith("@")
    assert "round 2, drawn 2026-01-02, salt 5a17; artefact number 1" in seen["detail"]
    assert "verified 2026-01-03" in seen["detail"]
    assert seen["raw"] == "rows/short_nominal--pid.json"
    assert seen["closed"] == 0


@needs_browser
def test_learned_row_shows_every_training_seed(seen):
    assert "RMS [mm] by training seed, audit episodes" in seen["learned"]
    assert "seed 00.400" in seen["learned"]
    assert "seed 90.600" in seen["learned"]
    assert "As stated by its maker, not verified" in seen["learned"]


@needs_browser
def test_missing_trajectories_are_reported(seen):
    assert seen["missing"].startswith("data/traces/short_nominal--zero.js cannot be read")


@needs_browser
def test_texts_of_rows_are_shown_and_never_run(seen):
    assert HOSTILE in seen["hostile"]
    assert not seen["taken"]


@needs_browser
def test_address_opens_a_row(built):
    address = f"{(built / 'index.html').as_uri()}#row=short_wrong_model--ppo"
    shown = browse(address, built)
    assert 'class="pictures"' in shown
    assert "python -m agents train X --seed 0" in html.unescape(shown)


@needs_browser
def test_page_without_rows_has_a_message(tmp_path):
    site.build(tmp_path, tmp_path / "out")
    shown = browse((tmp_path / "out" / "index.html").as_uri(), tmp_path)
    assert "There are no rows yet" in shown


def test_equal_rows_give_an_equal_page(tmp_path, monkeypatch):
    made = {"rows": page_rows()}
    monkeypatch.setattr(leaderboard, "load", lambda folder: made["rows"])
    for row in made["rows"]:
        write_json(rows.path_of(row["row"], tmp_path), {"the row": row["row"]})
    written = site.build(tmp_path, tmp_path / "out")
    assert written[0].name == "index.html"
    raw = tmp_path / "out" / "rows" / "short_nominal--pid.json"
    assert json.loads(raw.read_text()) == {"the row": "short_nominal--pid"}
    before = {path: path.read_bytes() for path in (tmp_path / "out").rglob("*.*")}
    made["rows"] = page_rows()[::-1]
    site.build(tmp_path, tmp_path / "out")
    after = {path: path.read_bytes() for path in (tmp_path / "out").rglob("*.*")}
    assert after == before
    made["rows"] = page_rows()[:4]
    site.build(tmp_path, tmp_path / "out")
    for folder, end in (("data/traces", "js"), ("rows", "json")):
        left = {path.name for path in (tmp_path / "out" / folder).iterdir()}
        assert left == {f"short_nominal--{n}.{end}" for n in ("inverse", "pid", "zero", "outside")}


def test_declared_headline_has_columns_with_intervals() -> None:
    made = site.board(fakes.board() + fakes.gait())
    tracks = {track["name"]: track for track in made["tracks"]}
    plain, walk = tracks["short_nominal"], tracks["walk_nominal"]
    assert plain["headlines"] == []
    assert {len(row["headlines"]) for row in plain["rows"]} == {0}
    assert walk["headlines"] == ["EMG effort"]
    assert "EMG effort" not in [walk["columns"][k] for k in walk["costs"]]
    for row in walk["rows"]:
        ((value, low, high),) = row["headlines"]
        assert value == pytest.approx({"pid": 0.96, "ppo": 0.92}[row["controller"]])
        assert low < value < high
    winner = next(entry for entry in made["winners"] if entry["track"] == "walk_nominal")
    assert list(winner["rival_scores"]) == list(winner["learned_scores"]) == ["RMS", "EMG effort"]
    assert winner["learned_scores"]["EMG effort"].startswith("0.920 [0.9")


def test_page_loads_nothing_from_the_network():
    for path in site.ASSETS.iterdir():
        links = re.findall(r"https?://[^\s\"']+", path.read_text())
        assert set(links) <= {"http://www.w3.org/2000/svg"}, path.name  # a name, not an address
    index = (site.ASSETS / "index.html").read_text()
    assert "default-src 'none'" in index


def test_rows_of_a_run_make_a_board_and_a_page_with_their_trajectories(track, folder):
    out = folder / "out"
    pairs = [(find(name), track) for name in ("low", "integral")]
    run(pairs, Options(jobs=1, out=out, cells=folder / "cells"))
    written = leaderboard.write(out, folder / "LEADERBOARD.md")
    assert "`integral`" in written[1].read_text()
    assert main(["site", "--results", str(out), "--out", str(folder / "site")]) == 0
    assert main(["site", "--results", str(folder / "nowhere")]) == 2
    text = (folder / "site/data/traces/short--integral.js").read_text()
    call, _, held = text.partition(",")
    assert call == 'loadTraces("short--integral"'
    drawn = json.loads(held.rpartition(")")[0])
    assert [trace["scenario"] for trace in drawn] == ["maxwell_slip_steps", "maxwell_slip_sines"]
    output = traces.unpack(drawn[0]["signals"]["output"])
    pressure = traces.unpack(drawn[0]["signals"]["state/pressure"])
    assert len(output) == len(pressure) > 90
    assert 0.0 < output.max() < 0.05  # m
    assert 1e4 < pressure.max() < 1e6  # Pa
    totals, done = [], []

    def start(total: int):
        totals.append(total)
        return lambda count=1, note="": done.append(count)

    site.build(out, folder / "again", start)
    assert sum(done) == totals[0] == 2  # the track's table and its figure
