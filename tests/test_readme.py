"""Snippets of the README run in page order, and links of the pages resolve."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SNIPPET = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)#\s]+)")
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "SUPPORT.md",
    ROOT / "RELEASING.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]


def run_snippets(page: Path) -> dict[str, object]:
    """Run the snippets of a page one after the other; return the names that they made."""
    text = page.read_text()
    names: dict[str, object] = {"__name__": page.stem}
    for found in SNIPPET.finditer(text):
        line = text.count("\n", 0, found.start(1))
        exec(compile("\n" * line + found[1], page.name, "exec"), names)
    return names


def test_snippets_of_the_readme_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = run_snippets(ROOT / "README.md")
    assert names["rms"] < 0.5e-3  # m; what the page says of its controller
    assert (tmp_path / "slow.yaml").exists()


def test_snippets_with_other_libraries_run(tmp_path, monkeypatch):
    pytest.importorskip("stable_baselines3")
    monkeypatch.chdir(tmp_path)
    names = run_snippets(ROOT / "docs/other_libraries.md")
    assert names["cost"] >= 0.0
    assert names["first"].shape == (64, 10)
    assert (tmp_path / "rig.csv").read_text().startswith("time_s,segment,pressure_command_bar")


def test_snippets_of_the_page_on_data_sets_run(monkeypatch):
    pytest.importorskip("minari")
    monkeypatch.chdir(ROOT)
    names = run_snippets(ROOT / "docs/datasets.md")
    first = [float(column[0]) for column in names["episode"].observations.values()]
    assert names["observation"].tolist() == first
    assert names["transitions"].actions.shape[1] == 1


def test_snippets_of_the_start_page_run(capsys):
    names = run_snippets(ROOT / "docs/start.md")
    assert "mm, reference" in capsys.readouterr().out
    assert abs(names["info"]["output"] - names["info"]["reference"]) < 1e-3  # m, after 10 s


def test_snippets_of_the_orthosis_print_the_stated_output(capsys):
    pytest.importorskip("cvxpy")
    names = run_snippets(ROOT / "docs/knee_orthosis.md")
    said = capsys.readouterr().out
    assert "16 of 21 unknowns; k_1, k_2, k_3, k_4, k_6, k_7, k_8, k_9, k_10 stay open" in said
    assert any("stay open" in str(one.message) for one in names["caught"])
    assert names["worst"](names["few"], 3.3e5) > 1.0 > 0.1 > names["worst"](names["enough"], 3.3e5)
    assert 1.5 <= names["stiffness"]["knee_inverse"] <= 2.3
    assert 10.5 <= names["stiffness"]["knee_line"] <= 11.6
    assert names["kick"](names["plain"]) > 3.0 * names["kick"](names["tension"])
    assert names["found"].names[0] == "horizontal_force"
    assert "named ('horizontal_force', 'inertia') 1.03" in said
    assert "horizontal_force: 3.97" in said


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_local_links_resolve(page):
    links = [link for link in LINK.findall(page.read_text()) if "://" not in link]
    missing = [link for link in links if not (page.parent / link).exists()]
    assert not missing


def best_cells(kind: str) -> dict[str, list[str]]:
    """Return the cells of the first table of the board, by environment, for a kind of tracks."""
    text = (ROOT / "benchmarks/LEADERBOARD.md").read_text().partition("## Best controllers")[2]
    lines = re.findall(rf"^\| `(\w+)`<br>{kind}\w* \| (.*) \|$", text, re.MULTILINE)
    return {env: cells.split(" | ") for env, cells in lines}


def value(cell: str) -> str:
    """Return the RMS in a cell of the board."""
    return next((p.split(" ")[0] for p in cell.split("<br>") if not p.startswith("`")), "-")


def test_readme_table_equals_the_board():
    readme = (ROOT / "README.md").read_text()
    nominal, drawn = best_cells("nominal"), best_cells("random")
    assert len(nominal) == len(drawn) == 9
    for env, cells in nominal.items():
        (line,) = re.findall(rf"^\| `{env}` \| [^|]+ \| (.*) \|$", readme, re.MULTILINE)
        pairs = [[value(a), value(b)] for a, b in zip(cells, drawn[env], strict=True)]
        said = ["-" if pair == ["-", "-"] else " / ".join(pair) for pair in pairs]
        assert line.split(" | ") == said


def test_gaits_have_the_effort_beside_the_error():
    found = {env for env, cells in best_cells("nominal").items() if "<br>EMG effort" in cells[0]}
    assert found == {"KneeWalk", "KneeStairsUp", "KneeStairsDown"}
