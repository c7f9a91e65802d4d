"""Write the report of a run: one HTML file with a rotatable 3D view, and a PDF."""

import os
from pathlib import Path

from rpf3d_core.errors import InputError
from rpf3d_core.formats.words import scene_name
from rpf3d_core.report.content import report_elements
from rpf3d_core.report.html import html_document
from rpf3d_core.report.pdf import write_pdf
from rpf3d_core.report.run_files import RunFiles, read_run
from rpf3d_core.report.view import script
from rpf3d_core.results.input_files import SCENE


def write_report(folder: Path, out: Path, pdf: Path | None = None, site: str = "") -> None:
    """Write the report of a result folder as HTML and, if wanted, as PDF.

    site : name of the site; empty for the name of the scene, as `scene_name` returns it

    Raises
    ------
    InputError
        HTML and PDF have the same path, or the name of the HTML ends in .pdf; the folder contains no result, or a
        result of another version of rpf3d; plotly or typst is not installed; or a file cannot be written.
    """
    if pdf is not None and pdf.resolve() == out.resolve():
        raise InputError(f"{out}: is named for both the HTML report and the PDF; give --pdf another file")
    check_is_html(out)
    for path in filter(None, (out, pdf)):
        _check_writable(path)
    run = read_run(folder)
    name = site or scene_name(_scene_file(run))
    title, elements = f"Rockfall report: {name}", report_elements(run, name)
    try:
        out.write_text(html_document(title, elements, script()), encoding="utf-8")
    except OSError as fault:
        raise InputError(f"{out}: could not be written ({fault.strerror or fault})") from fault
    if pdf is not None:
        write_pdf(pdf, title, elements)


def _scene_file(run: RunFiles) -> Path:
    """Return the path of the scene file of a run; only its name if the run did not list the file."""
    paths = [file["path"] for file in run.inputs.get("files", ()) if file["key"] == SCENE]
    return Path(paths[0] if paths else run.summary["scene"]["file"])


def check_is_html(path: Path) -> None:
    """Raise an InputError if the path for the HTML report names a PDF, because the HTML would replace the PDF."""
    if path.suffix.lower() == ".pdf":
        raise InputError(f"{path}: is the name of a PDF, but the report is written there as HTML; give the name of an "
                         "HTML file. `rpf3d report` writes a PDF as well, with --pdf")  # fmt: skip


def _check_writable(path: Path) -> None:
    """Raise an InputError if the output file at a path cannot be written; called before the report is made."""
    folder = path.resolve().parent
    if path.is_dir():
        raise InputError(f"{path}: is a folder; give the path of a file")
    if not folder.exists():
        raise InputError(f"{path}: could not be written, because there is no folder {folder}")
    if not folder.is_dir() or not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"{path}: could not be written, because {folder} is not a folder that may be written to")
