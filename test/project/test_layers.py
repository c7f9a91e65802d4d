"""Tests that imports go only to lower layers, and outside libraries have one place (docs/explanation/design.md)."""

import ast
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from suite.package_files import PACKAGES, ROOT, files_of

LAYERS = (
    {"errors", "values"},
    {"jit"},
    {"vectors", "arc"},
    {"body"},
    {"terrain", "materials", "kinetics", "detection", "effects"},
    {"simulation"},
    {"ensemble"},
    {"unknowns"},
    {"hazard"},
    {"formats"},
    {"shapes"},
    {"scene"},
    {"setup"},
    {"results"},
    {"recordings"},
    {"alerts"},
    {"accuracy"},
    {"calibration"},
    {"sensitivity"},
    {"report"},
    {"runs"},
    {"imports", "live", "sweep"},
    {"desk"},
    {"commands"},
    {"cli"},
    {"rpf3d_ros.messages"},
    {"rpf3d_ros.interface"},
    {"rpf3d_ros.alerts"},
    {"rpf3d_ros.recording", "rpf3d_ros.engine"},
    {"rpf3d_ros.nodes"},
    {"rpf3d_ros.demo"},
)
"""Layers, the lowest first: a file imports only from its own folder and from lower layers."""

ACROSS = {
    # All users of a terrain need the types of which it consists.
    ("kinetics", "terrain"): {"facets", "frame", "facet_geometry"},
    ("detection", "terrain"): {"facets", "frame", "facet_geometry"},
    ("effects", "terrain"): {"facets", "frame", "facet_geometry"},
    ("materials", "terrain"): {"facets", "frame", "facet_geometry"},
    # A rebound reads the ground and the rock, and a random one draws.
    ("kinetics", "materials"): {"library", "rock_context", "streams", "distributions"},
    ("effects", "materials"): {"library", "rock_context", "streams", "distributions"},
    # Effects may use the models of the motion that they change.
    ("effects", "kinetics"): None,
}
"""(Folder, other folder of the same layer) -> files that the first may import from the second; None: all."""

ROOMS = {
    "rpf3d_core.scene.models": ("rpf3d_core.scene.models", "rpf3d_core.scene.values"),
    "rpf3d_core.results.hazard_files": ("rpf3d_core.results.hazard_files",),
    "rpf3d_core.results.plots": (
        "rpf3d_core.results.plots", "rpf3d_core.results.hazard_files.sentences", "rpf3d_core.results.findings",
        "rpf3d_core.results.series", "rpf3d_core.results.tables", "rpf3d_core.results.shown",
    ),
}  # fmt: skip
"""Folder inside a layer -> modules of this layer that it may import."""

CONFINED = {
    "numba": ("rpf3d_core/jit/",),
    "llvmlite": ("rpf3d_core/jit/",),
    "vtk": ("rpf3d_core/detection/vtk_", "rpf3d_core/formats/vtk_", "rpf3d_core/accuracy/decimated.py"),
    "vtkmodules": (
        "rpf3d_core/detection/vtk_", "rpf3d_core/formats/vtk_", "rpf3d_core/accuracy/decimated.py",
        "rpf3d_core/results/plots/path_profiles.py", "rpf3d_core/desk/window.py",
    ),
    "contourpy": ("rpf3d_core/imports/face_borders.py",),
    "scipy": ("rpf3d_core/shapes/polyhedron.py", "rpf3d_ros/alerts/unreported_places.py"),
    "rclpy": ("rpf3d_ros/",),
    "rerun": ("rpf3d_core/recordings/",),
    "tf2_ros": ("rpf3d_ros/interface/tf_buffer.py",),
    "matplotlib": ("rpf3d_core/results/plots/",),
    "pyarrow": (
        "rpf3d_core/results/tables.py", "rpf3d_core/formats/vtp.py", "rpf3d_core/unknowns/sample_files.py",
        "rpf3d_core/formats/mine/dxf_pairs.py", "rpf3d_core/report/run_files.py",
    ),
    "rasterio": ("rpf3d_core/formats/", "rpf3d_core/results/hazard_files/", "rpf3d_core/report/run_files.py"),
    "shapely": (
        "rpf3d_core/formats/",
        "rpf3d_core/scene/",
        "rpf3d_core/setup/",
        "rpf3d_core/live/areas.py", "rpf3d_core/live/coverage.py",
        "rpf3d_core/calibration/flown_counts.py",
        "rpf3d_core/imports/crests.py",
        "rpf3d_core/imports/face_borders.py",
        *(
            f"rpf3d_core/terrain/{file}.py"
            for file in (
                "zones", "cloud", "cloud_holes", "gap_around_patch", "gaps", "steep_gaps",
                "plane/hull", "plane/triangulation", "outer_walls", "draped_outlines", "mesh/near_rim",
            )
        ),
    ),
    "pydantic": ("rpf3d_core/scene/", "rpf3d_core/alerts/site"),
    "yaml": ("rpf3d_core/formats/yaml.py",),
    "typer": ("rpf3d_core/cli.py", "rpf3d_core/commands/", "rpf3d_ros/recording/from_bag_command.py"),
    "rich": ("rpf3d_core/commands/",),
}  # fmt: skip
"""Outside library -> beginnings of the paths of the files that may import it."""

LAZY = ("rerun", "tf2_ros")
"""Libraries imported only inside functions: rerun costs time, and no wheel contains tf2_ros."""

SOURCES = [path.relative_to(ROOT) for path in files_of(*PACKAGES)]


def imported(tree: ast.AST) -> Iterator[tuple[str, ast.stmt]]:
    """Yield the full names of the modules that a tree imports, with their statements; `from a import b`: a and a.b."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((name.name, node) for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide what depends on what"
            assert node.module
            yield node.module, node
            yield from ((f"{node.module}.{name.name}", node) for name in node.names)


def place_of(module: str) -> str | None:
    """Return the layer of a module: a folder or file of the core, or a folder of rpf3d_ros with that name before it."""
    package, _, rest = module.partition(".")
    folder = rest.partition(".")[0]
    return (f"{package}.{folder}" if package == "rpf3d_ros" else folder) if folder else None


def rank(place: str) -> int:
    return next(i for i, layer in enumerate(LAYERS) if place in layer)


def may_import(importer: str, module: str) -> bool:
    place = place_of(module)
    if place is None or place == importer or rank(place) < rank(importer):
        return True
    allowed = ACROSS.get((importer, place), set())
    return allowed is None or bool(allowed.intersection(module.split(".")))


@pytest.mark.parametrize("path", SOURCES, ids=str)
def test_a_file_imports_only_from_the_layers_below_it(path: Path) -> None:
    importer = place_of(".".join(path.with_suffix("").parts).removesuffix(".__init__"))
    if importer is None:
        return  # a package itself offers what it likes
    modules = {name for name, _ in imported(ast.parse((ROOT / path).read_text()))}
    ours = {name for name in modules if name.split(".")[0] in PACKAGES and name not in PACKAGES}
    assert [name for name in sorted(ours) if not may_import(importer, name)] == []
    assert path.parts[0] == "rpf3d_ros" or "rpf3d_ros" not in modules, "the core imports nothing of rpf3d_ros"


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_the_named_files_of_its_layer(room: str) -> None:
    layer = room.rpartition(".")[0]
    files = sorted((ROOT / room.replace(".", "/")).glob("*.py"))
    modules = {name for path in files for name, _ in imported(ast.parse(path.read_text()))}
    ours = [name for name in sorted(modules) if name.startswith(f"{layer}.") and not name.startswith(ROOMS[room])]
    assert len(files) > 1 and ours == []


@pytest.mark.parametrize("path", SOURCES, ids=str)
def test_an_outside_library_is_imported_only_where_it_is_at_home(path: Path) -> None:
    strangers = [
        name
        for name, _ in imported(ast.parse((ROOT / path).read_text()))
        if (library := name.split(".")[0]) in CONFINED and not str(path).startswith(CONFINED[library])
    ]
    assert strangers == []


@pytest.mark.parametrize("path", SOURCES, ids=str)
def test_the_recording_library_is_imported_inside_functions_only(path: Path) -> None:
    tree = ast.parse((ROOT / path).read_text())
    at_start = [name for name, node in imported(tree) if node in tree.body and name.split(".")[0] in LAZY]
    assert at_start == []


def test_no_two_files_import_each_other() -> None:
    """Longer cycles are excluded, too; imports inside functions count as well."""
    modules = {".".join(path.with_suffix("").parts).removesuffix(".__init__"): path for path in SOURCES}
    needs = {
        module: {name for name, _ in imported(ast.parse((ROOT / path).read_text())) if name in modules} - {module}
        for module, path in modules.items()
    }
    assert len(list(TopologicalSorter(needs).static_order())) == len(modules)


def test_every_file_and_folder_of_the_core_stands_in_a_layer() -> None:
    modules = (".".join(path.with_suffix("").parts) for path in SOURCES if path.name != "__init__.py")
    places = {place for module in modules if (place := place_of(module))}
    assert places - set().union(*LAYERS) == set()


@pytest.mark.parametrize(
    ("importer", "module", "allowed"),
    [
        ("kinetics", "rpf3d_core.values", True),
        ("kinetics", "rpf3d_core.simulation.march", False),
        ("kinetics", "rpf3d_core.terrain.facets", True),
        ("kinetics", "rpf3d_core.terrain.pit.synthetic", False),
        ("results", "rpf3d_core.recordings.log", False),
        ("scene", "rpf3d_core.setup.sources", False),
        ("recordings", "rpf3d_core.results.tables", True),
        ("effects", "rpf3d_core.kinetics.flight", True),
        ("kinetics", "rpf3d_core.effects.drag", False),
        ("rpf3d_ros.engine", "rpf3d_core.runs.run", True),
        ("rpf3d_ros.engine", "rpf3d_ros.nodes.simulator", False),
        ("rpf3d_ros.alerts", "rpf3d_ros.engine.station", False),
        ("runs", "rpf3d_ros.messages.health", False),
    ],
)
def test_the_layer_rule_itself_can_say_no(importer: str, module: str, allowed: bool) -> None:
    assert may_import(importer, module) is allowed
