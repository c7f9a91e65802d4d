"""Settings of the documentation site for Sphinx: `make docs` builds it from README, docs/ and the docstrings.

The root of the repository is the source folder, so a link that works on disk works in the site too.
"""

import re
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "docs"))

project = "rpf3d"
author = "rpf3d maintainers"
release = re.findall(r'version="([\d.]+)"', (ROOT / "setup.py").read_text(encoding="utf-8"))[0]

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",  # only for the event by which api_docstrings changes docstrings; it imports nothing here
    "autoapi.extension",
    "website.api_docstrings",
    "website.repository_links",
]
root_doc = "docs/index"
include_patterns = ["README.md", "CHANGELOG.rst", "CONTRIBUTING.md", "docs/*.md", "docs/*/*.md", "docs/api/**"]
exclude_patterns = [".*", "build", "install", "log", "out"]
highlight_language = "none"  # a block of code names its language

myst_heading_anchors = 4

autoapi_dirs = [str(ROOT / package) for package in ("rpf3d_core", "rpf3d_ros")]
autoapi_root = "docs/api"
autoapi_template_dir = str(Path(__file__).parent / "templates")
autoapi_options = ["members", "show-inheritance"]
autoapi_add_toctree_entry = False  # docs/index.md does it
python_use_unqualified_type_names = True
suppress_warnings = [
    # autoapi does not read `A, B = 0, 1`, and so finds no origin for such a name where it is imported: 57 of them.
    "autoapi.python_import_resolution",
]



def autoapi_prepare_jinja_env(jinja_env: Any) -> None:
    """Add a filter for the templates that removes the modules from names in an annotation, to keep it short."""
    jinja_env.filters["unqualified"] = lambda annotation: re.sub(r"(?:\w+\.)+(\w+)", r"\1", annotation)


html_theme = "furo"
html_title = f"rpf3d {release}"
html_extra_path = ["index.html"]
html_copy_source = False
