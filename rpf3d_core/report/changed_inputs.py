"""Warn about input files that have changed since the run, because a report shows the results of the former files."""

from collections.abc import Iterator
from pathlib import Path

from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.results.input_files import SCENE
from rpf3d_core.scene.files import digest_of_file

NOT_STORED = (
    "The run stored no digests of its input files, so the report could not check whether the scene file and the files "
    "that it names have changed since the run. A new run stores the digests."
)


def changed_inputs(run: RunFiles) -> Iterator[str]:
    """Yield a warning for each input file that has changed since the run, or that could not be compared."""
    if "files" not in run.inputs:
        yield NOT_STORED
        return
    files = run.inputs["files"]
    if not any(file["key"] == SCENE for file in files):
        yield "The run stored no digest of the scene file, so the report could not check whether it has changed."
    for file in files:
        path, what = Path(file["path"]), "scene file" if file["key"] == SCENE else f"file of `{file['key']}`"
        try:
            if digest_of_file(path) != file["sha256"]:
                yield (f"The {what}, {path}, has changed since the run: the report shows the results of the former "
                       "file. Run the scene again.")  # fmt: skip
        except OSError:
            yield f"The {what}, {path}, cannot be read, so the report could not check whether it has changed."
