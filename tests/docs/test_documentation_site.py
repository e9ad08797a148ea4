"""Documentation site, built without executing notebooks and without the API reference."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.browser import NAMES, find
from tests.docs.site_checks import (
    API,
    axe_script,
    broken_links,
    faults_in_browser,
    for_browser,
    pages,
)

pytest.importorskip("furo")
pytest.importorskip("myst_nb")
pytestmark = pytest.mark.xdist_group("site")
ROOT = Path(__file__).parents[2]
PROGRAM = find()
SKIPPED = ("genindex.html", "search.html", "py-modindex.html")
LEAFLET = '<!doctype html><html lang="en"><title>x</title><main><h1>Placeholder</h1></main></html>'


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """Build the site; the board and the playground, which have tests of their own, are blank."""
    folder = tmp_path_factory.mktemp("site")
    for name in ("board", "playground"):
        (folder / "extra" / name).mkdir(parents=True)
        (folder / "extra" / name / "index.html").write_text(LEAFLET)
    command = [
        *(sys.executable, "-m", "sphinx", "--quiet", "--fail-on-warning", "--keep-going"),
        *("--conf-dir", "docs", "--doctree-dir", str(folder / "doctrees")),
        *("--define", f"html_extra_path={folder / 'extra'}", ".", str(folder / "html")),
    ]
    env = {**os.environ, "PAM_ENVS_DOCS_EXECUTE": "off", "PAM_ENVS_DOCS_API": "off"}
    done = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "html"


def test_every_page_of_the_documentation_is_on_the_site(site):
    written = {path.relative_to(ROOT).with_suffix(".html") for path in ROOT.glob("docs/**/*.md")}
    built = {path.relative_to(site) for path in pages(site)}
    assert written - built == set()
    assert {Path("README.html"), Path("CONTRIBUTING.html"), Path("CHANGELOG.html")} <= built


def test_links_resolve_and_nothing_is_loaded_from_the_network(site):
    assert list(broken_links(site)) == []


@pytest.mark.skipif(PROGRAM is None, reason=f"no browser here; install one of {', '.join(NAMES)}")
def test_pages_have_no_console_error_are_accessible_and_fit_a_phone(site):
    shown = [page for page in pages(site) if page.name not in SKIPPED]
    assert list(faults_in_browser(shown, PROGRAM)) == []


def test_browser_loads_all_written_pages_and_a_tenth_of_the_api(tmp_path):
    (tmp_path / API).mkdir(parents=True)
    written = [tmp_path / f"page_{k}.html" for k in range(25)]
    api = [tmp_path / API / f"module_{k:02}.html" for k in range(25)]
    for path in (*written, *api):
        path.write_text(LEAFLET)
    chosen = for_browser(tmp_path)
    assert set(written) <= set(chosen)
    assert set(chosen) & set(api) == {api[0], api[10], api[20]}


@pytest.mark.skipif(PROGRAM is None, reason=f"no browser here; install one of {', '.join(NAMES)}")
def test_faults_of_a_page_are_found(tmp_path):
    wide, broken = tmp_path / "wide.html", tmp_path / "broken.html"
    phone = '<meta name="viewport" content="width=device-width">'
    start = f'<!doctype html><html lang="en"><title>x</title>{phone}<main><h1>x</h1>'
    wide.write_text(f'{start}<article><div style="width: 900px">x</div></article>')
    broken.write_text(f'{start}<a href="none.html">x</a><script>console.error("amiss")</script>')
    found = list(faults_in_browser([wide, broken], PROGRAM))
    assert ["pixels wide instead of 390" in found[0], "amiss" in found[1]] == [True, True]
    assert list(broken_links(tmp_path)) == [
        "broken.html links to none.html, which does not exist",
    ]


@pytest.mark.skipif(PROGRAM is None, reason=f"no browser here; install one of {', '.join(NAMES)}")
@pytest.mark.skipif(axe_script() is None, reason="axe-playwright-python is not installed")
def test_violations_of_accessibility_are_found(tmp_path):
    page = tmp_path / "page.html"
    text = '<!doctype html><html lang="en"><title>x</title><main><h1>x</h1>{}</main></html>'
    page.write_text(text.format('<img src="data:," alt="a line">'))
    assert list(faults_in_browser([page], PROGRAM)) == []
    page.write_text(text.format('<img src="data:,">'))
    (fault,) = faults_in_browser([page], PROGRAM)
    assert "image-alt (1)" in fault
