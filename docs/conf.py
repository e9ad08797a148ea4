"""Settings of the documentation site (``make docs``).

The source folder is the root of the repository, so that the pages keep the relative links that also
work on the repository's web page. Nothing is loaded from the network.
"""

import os
import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

# Kernels stay plain functions with docstrings in this process. The processes that execute the
# notebooks compile them as usual.
_compile = os.environ.get("PAM_ENVS_COMPILE")
os.environ["PAM_ENVS_COMPILE"] = "0"
from docutils.parsers.rst import Directive  # noqa: E402

import pam_envs.kernels.build  # noqa: E402

del os.environ["PAM_ENVS_COMPILE"]
os.environ.pop("MPLBACKEND", None)  # notebooks draw inline
if _compile is not None:
    os.environ["PAM_ENVS_COMPILE"] = _compile

project = "pam-envs"
author = copyright = "The pam-envs authors"
version = release = pam_envs.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
]
root_doc = "docs/index"
templates_path = ["_templates"]
include_patterns = [
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "SECURITY.md",
    "CODE_OF_CONDUCT.md",
    "SUPPORT.md",
    "RELEASING.md",
    "docs/**.md",
    "docs/api/generated/**.rst",
    "agents/pretrained/*.md",
    "benchmarks/LEADERBOARD.md",
    "benchmarks/leaderboard/*.md",
    "benchmarks/results/diagnosis.md",
    "pam_envs/data/PROVENANCE.md",
]
exclude_patterns = [".*", "build", "dist", "runs", "tests", "**/__pycache__"]

API = os.environ.get("PAM_ENVS_DOCS_API") != "off"  # off: a build in seconds, for tests
if not API:
    exclude_patterns.append("docs/api/generated")
    extensions.remove("sphinx.ext.autosummary")

# address of the public repository, once there is one: links to the sources
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
REPOSITORY = PROJECT["tool"]["hatch"]["metadata"]["hooks"]["custom"]["repository"]
html_theme = "furo"
if REPOSITORY:
    html_theme_options = {
        "source_repository": REPOSITORY,
        "source_branch": "main",
        "source_directory": "",
    }
html_title = "pam-envs"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_extra_path = [str(path) for path in [ROOT / "build/docs-extra"] if path.exists()]

myst_enable_extensions = ["colon_fence", "attrs_inline"]
myst_heading_anchors = 4
nb_execution_mode = os.environ.get("PAM_ENVS_DOCS_EXECUTE", "cache")
nb_execution_cache_path = str(ROOT / "build/docs-cache")
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_merge_streams = True
nb_render_markdown_format = "myst"  # tables
nb_output_stderr = "remove"  # notes of the compiler

suppress_warnings = ["ref.python"]  # a type of a docstring that several modules define
autosummary_generate = True
autodoc_default_options = {"members": True, "show-inheritance": True, "member-order": "bysource"}
autodoc_typehints = "signature"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True


def _table(lines: list[str]) -> list[str]:
    """Return a Markdown table as a reStructuredText list-table."""
    made = [".. list-table::", "   :header-rows: 1", ""]
    for line in [lines[0], *lines[2:]]:
        cells = [cell.strip() for cell in line.strip().strip("|").split(" | ")]
        made += [f"   {'*' if k == 0 else ' '} - {cell}" for k, cell in enumerate(cells)]
    return [*made, ""]


def plain_markup(_app, _what, _name, _object, _options, lines: list[str]) -> None:
    """Mark the tables of a docstring, and its indented blocks (formulas, code), before a section.

    Docstrings are read as text more often than as pages: they hold Markdown tables, and formulas
    and code as indented blocks without ``::``.
    """
    end = next((k for k, line in enumerate(lines) if SECTION.fullmatch(line)), len(lines) + 1) - 1
    made: list[str] = []
    k = 0
    while k < end:
        block = k
        if lines[k].startswith("| "):
            while block < end and lines[block].startswith("|"):
                block += 1
            made += _table(lines[k:block])
        elif INDENTED.match(lines[k]) and k and not lines[k - 1] and not made[-1]:
            while block < end and (INDENTED.match(lines[block]) or not lines[block]):
                block += 1
            made += ["::", "", *lines[k:block], ""]
        else:
            made.append(lines[k])
            block += 1
        k = block
    lines[:end] = made


SECTION = re.compile(r"-{3,}")
INDENTED = re.compile(r" {4}")


class Nothing(Directive):
    """Stand-in for ``autosummary`` in a build without the API reference."""

    has_content = True

    def run(self) -> list:
        """Return no nodes."""
        return []


def only_pages(_app, config) -> None:
    """Make the notebooks files to download: the pages are their source."""
    config.source_suffix.pop(".ipynb", None)


def folded(_app, _page, _template, context, _doctree) -> None:
    """Show the branch of the present page alone: unfolded, the API reference has 400 entries."""
    if "toctree" in context:
        whole = context["toctree"]
        context["toctree"] = lambda **options: whole(**{**options, "collapse": True})


ACCESSIBLE = {
    r'<p class="caption" role="heading">': '<p class="caption" role="heading" aria-level="2">',
    r'<aside class="sidebar-drawer">': '<aside class="sidebar-drawer" aria-label="Pages">',
    r'<aside class="toc-drawer': '<aside aria-label="This page" class="toc-drawer',
    r"<pre>": '<pre tabindex="0">',
    r'<div class="table-wrapper': '<div tabindex="0" class="table-wrapper',
    r'<th class="(head[^"]*)"><p></p></th>': r'<td class="\1"></td>',
    r'(?<!</h1>\n)<div id="search-results">': '<h1>Search</h1>\n<div id="search-results">',
}
"""Marks for screen readers and keyboards that the theme leaves out."""


def accessible(app, error) -> None:
    """Add the marks of ACCESSIBLE to the pages; those of the board and the playground have them."""
    own = [app.outdir / path.name for extra in html_extra_path for path in Path(extra).iterdir()]
    for page in Path(app.outdir).rglob("*.html"):
        if error is None and not any(page.is_relative_to(folder) for folder in own):
            text = page.read_text(encoding="utf-8")
            marked = text
            for plain, better in ACCESSIBLE.items():
                marked = re.sub(plain, better, marked)
            if marked != text:
                page.write_text(marked, encoding="utf-8")


def setup(app) -> None:
    """Connect the above, in their order relative to napoleon, myst-nb and furo."""
    app.connect("html-page-context", folded, priority=100)
    app.connect("autodoc-process-docstring", plain_markup, priority=400)
    app.connect("config-inited", only_pages, priority=900)
    app.connect("build-finished", accessible)
    if not API:
        app.add_directive("autosummary", Nothing)
