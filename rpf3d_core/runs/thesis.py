"""Define the two studies of the thesis: the printed shares of rocks, and the scenes that repeat them with rpf3d.

Source: Peik 2020, section 5.2, tables 5-2 and 5-4.
"""

import sysconfig
from pathlib import Path
from typing import NamedTuple

from rpf3d_core.errors import InputError
from rpf3d_core.results.folder import check_folder


class Printed(NamedTuple):
    """A column of a table in the thesis: its printed shares, and the zones of the pit that correspond to it.

    area : name of the area as printed; zones : zones of the synthetic pit that correspond to the area
    a, b : printed shares (%) in run A and run B
    """

    area: str
    zones: tuple[str, ...]
    a: float
    b: float


class Study(NamedTuple):
    """A study of the thesis: the printed table, and the scenes that repeat the study with rpf3d.

    table : number of the table in the thesis; a, b : names of the scene files of run A and run B, without extension
    part : name of a third scene file, with only a part of the changes from A to B; None without such a file
    printed : the columns of the table
    """

    name: str
    title: str
    table: str
    a: str
    b: str
    part: str | None
    printed: tuple[Printed, ...]


def _benches(first: int, last: int) -> tuple[str, ...]:
    return tuple(f"bench_{number}" for number in range(first, last + 1))


RESOLUTION = Study(
    name="resolution", title="Resolution of the terrain: A low (150,000 triangles), B high (2,332,287)", table="5-2",
    a="study_low", b="study_high", part=None,
    printed=(
        Printed(area="first bench", zones=_benches(1, 1), a=28.0, b=23.0),
        Printed(area="fourth bench", zones=_benches(4, 4), a=4.0, b=19.0),
        Printed(area="haulage ramp", zones=("ramp",), a=57.0, b=38.0),
    ),
)  # fmt: skip
LOCALISED = Study(
    name="localised", title="Coefficients of restitution: A generalised, B localised", table="5-4",
    a="study_high", b="study_localised", part="study_spills",
    printed=(
        Printed(area="first bench", zones=_benches(1, 1), a=23.0, b=43.0),
        Printed(area="following five benches", zones=_benches(2, 6), a=27.0, b=27.0),
        Printed(area="following four benches", zones=_benches(7, 10), a=9.0, b=0.0),
        Printed(area="haulage ramp", zones=("ramp",), a=38.0, b=19.0),
        Printed(area="bottom of the pit", zones=("floor",), a=4.0, b=9.0),
    ),
)  # fmt: skip
REPORTS = ("comparison.json", "comparison.md")
"""Names of the files that a study writes next to the result folders of its runs."""
STUDIES = {study.name: study for study in (RESOLUTION, LOCALISED)}


def scene_files(study: Study) -> list[Path]:
    """Return the paths of a study's installed scene files: A, B and, if there is a third run, its file.

    Raises
    ------
    InputError
        A scene file is missing in the installation.
    """
    places = (Path(__file__).parents[2], Path(sysconfig.get_path("data"), "share", "rpf3d"))
    stems = [stem for stem in (study.a, study.b, study.part) if stem]
    for place in places:
        files = [place / "config" / "scenes" / f"{stem}.yaml" for stem in stems]
        if all(file.is_file() for file in files):
            return files
    raise InputError(f"study {study.name}: {stems[0]}.yaml is in none of {', '.join(str(place) for place in places)}")


def study_named(name: str) -> Study:
    """Return the study with a name, as given to `rpf3d study`.

    Raises
    ------
    InputError
        There is no such study; the message lists the studies.
    """
    if name not in STUDIES:
        raise InputError(f"there is no study {name!r}; there are {', '.join(STUDIES)}")
    return STUDIES[name]


def runs_of(study: Study, out: Path) -> list[tuple[Path, Path]]:
    """Return the pairs of a scene file and the folder for its result, after a check that the folders can be written.

    Raises
    ------
    InputError
        As `scene_files` and `results.folder.check_folder`; or `out` contains a file that is not of this study.
    """
    runs = [(scene, out / scene.stem.removeprefix("study_")) for scene in scene_files(study)]
    known = {*REPORTS, *(folder.name for _, folder in runs)}
    foreign = sorted(path.name for path in out.iterdir() if path.name not in known) if out.is_dir() else []
    if foreign:
        raise InputError(f"{out}: holds {foreign[0]!r}, which is not of this study; give a new or empty folder")
    for _, folder in runs:
        check_folder(folder)
    return runs
