"""Tests that the package descriptions agree with each other and with the code."""

import ast
import importlib
import importlib.util
import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pytest
from suite.package_files import PACKAGES, ROOT, files_of

ROS_TYPES = re.compile(r"[a-z_]+(_msgs|_srvs|_interfaces)")

FROM_THE_SAME_PROJECT = {
    "affine": "rasterio",
    "mpl_toolkits": "matplotlib",
    "pydantic_core": "pydantic",
    "rerun": "rerun-sdk",
    "vtkmodules": "vtk",
    "yaml": "PyYAML",
}
"""Module -> distribution that contains it, if their names differ."""


OF_ROS_ALONE = {"tf2_ros": "tf2_ros_py"}
"""Module -> ROS package that contains it, without a wheel; imported only if a parameter asks for it."""


def setup_arguments() -> dict[str, ast.expr]:
    tree = ast.parse((ROOT / "setup.py").read_text())
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    setup = next(call for call in calls if isinstance(call.func, ast.Name) and call.func.id == "setup")
    return {keyword.arg: keyword.value for keyword in setup.keywords if keyword.arg}


def setup_value(name: str) -> Any:
    return ast.literal_eval(setup_arguments()[name])


def manifest() -> ElementTree.Element:
    return ElementTree.parse(ROOT / "package.xml").getroot()


def texts(tag: str) -> list[str]:
    return [str(element.text) for element in manifest().findall(tag)]


def outside_modules(package: str) -> set[str]:
    """Return the top-level names of the outside modules, not of Python itself, that a package imports."""
    found: set[str] = set()
    for path in files_of(package):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found |= {name.name.split(".")[0] for name in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                found.add(node.module.split(".")[0])
    return found - set(sys.stdlib_module_names) - set(PACKAGES)


def test_the_versions_agree() -> None:
    newest = re.search(
        r"^(\d+\.\d+\.\d+) \(\d{4}-\d{2}-\d{2}\)\n-{3,}$", (ROOT / "CHANGELOG.rst").read_text(), re.MULTILINE
    )
    assert newest, "the change log has no `x.y.z (yyyy-mm-dd)` heading"
    assert newest[1] == setup_value("version") == texts("version")[0]


def test_the_package_is_an_ament_python_package_of_format_3() -> None:
    assert manifest().get("format") == "3"
    assert manifest().findtext("export/build_type") == "ament_python"
    assert manifest().findtext("name") == "rpf3d"
    assert (ROOT / "resource" / "rpf3d").is_file()


def test_the_maintainer_has_a_valid_address() -> None:
    # Without this, colcon silently treats the package as plain Python.
    address = manifest().find("maintainer").get("email")  # type: ignore[union-attr]
    assert address == setup_value("maintainer_email")
    assert re.fullmatch(r"[a-z.]+@[a-z0-9.-]+\.[a-z]{2,}", str(address))


def test_the_licence_is_the_one_that_lies_beside_it() -> None:
    assert texts("license") == [setup_value("license")] == ["Apache-2.0"]
    text = (ROOT / "LICENSE").read_text()
    assert "Apache License" in text and "END OF TERMS AND CONDITIONS" in text


def test_each_library_that_the_code_imports_is_asked_for() -> None:
    asked = {re.split(r"[<>=!~\[]", need)[0].lower() for need in setup_value("install_requires")}
    outside = outside_modules("rpf3d_core") | outside_modules("rpf3d_ros")
    from_pip = {name for name in outside if name != "rclpy" and not ROS_TYPES.fullmatch(name)} - set(OF_ROS_ALONE)
    needs = {FROM_THE_SAME_PROJECT.get(name, name).lower() for name in from_pip}
    assert needs - asked == set()


def test_each_ros_package_that_the_nodes_import_is_asked_for() -> None:
    imported = {name for name in outside_modules("rpf3d_ros") if name == "rclpy" or ROS_TYPES.fullmatch(name)}
    imported |= {OF_ROS_ALONE[name] for name in outside_modules("rpf3d_ros") & set(OF_ROS_ALONE)}
    assert "tf2_ros_py" in imported
    assert imported - set(texts("exec_depend")) == set()


def test_the_core_imports_nothing_of_ros() -> None:
    assert [name for name in outside_modules("rpf3d_core") if name == "rclpy" or ROS_TYPES.fullmatch(name)] == []


@pytest.mark.parametrize("script", setup_value("entry_points")["console_scripts"])
def test_a_console_script_leads_to_a_function(script: str) -> None:
    name, _, target = script.partition(" = ")
    module, _, function = target.partition(":")
    assert re.fullmatch(r"rpf3d(_[a-z]+)*", name)
    path = ROOT / Path(*module.split(".")).with_suffix(".py")
    functions = [node.name for node in ast.parse(path.read_text()).body if isinstance(node, ast.FunctionDef)]
    assert function in functions
    if module.startswith("rpf3d_ros"):
        pytest.importorskip("rclpy", reason="rclpy is not installed: the nodes' modules cannot be imported")
    assert callable(getattr(importlib.import_module(module), function))


@pytest.mark.parametrize("path", sorted((ROOT / "launch").glob("*")), ids=lambda path: path.name)
def test_a_launch_file_compiles_and_starts_only_what_the_package_installs(path: Path) -> None:
    assert path.name.endswith(".launch.py"), "setup.py installs *.launch.py only"
    tree = ast.parse(path.read_text())
    functions = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
    assert "generate_launch_description" in functions
    compile(tree, str(path), "exec")
    scripts = {script.split(" = ")[0] for script in setup_value("entry_points")["console_scripts"]}
    nodes = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Node"]
    started = {
        ast.literal_eval(keyword.value)
        for node in nodes
        for keyword in node.keywords
        if keyword.arg == "executable" and isinstance(keyword.value, ast.Constant)
    }
    assert started - scripts <= {"rviz2"}, "of another package, and started only if asked"


@pytest.mark.parametrize("path", sorted((ROOT / "launch").glob("*.launch.py")), ids=lambda path: path.name)
def test_a_launch_file_makes_its_description(path: Path) -> None:
    pytest.importorskip("launch_ros", reason="launch_ros has no wheels: this runs in a ROS 2 installation only")
    spec = importlib.util.spec_from_file_location("launch_file", path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.generate_launch_description().entities
