"""Tests that the container files pass their linters and agree with the package, the units and the code."""

import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
DOCKER = ROOT / "docker"
DOCKERFILE, COMPOSE = DOCKER / "Dockerfile", DOCKER / "compose.yaml"
HADOLINT = shutil.which("hadolint", path=str(Path(sys.executable).parent)) or shutil.which("hadolint")
SERVICES = yaml.safe_load(COMPOSE.read_text())["services"]

needs_hadolint = pytest.mark.skipif(HADOLINT is None, reason="hadolint is not installed: it is in the extra `test`")
needs_compose_spec = pytest.mark.skipif(
    importlib.util.find_spec("compose_spec") is None, reason="compose-spec is not installed: it is in the extra `test`"
)


def lint(dockerfile: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(HADOLINT), "--no-color", str(dockerfile)], capture_output=True, text=True, check=False)


def validate(text: str) -> None:
    """Raise ValueError if a text is not a valid compose file."""
    import compose_spec

    compose_spec.PyOptions(apply_merge=True).from_yaml(text).validate()


@needs_hadolint
def test_the_linter_finds_nothing_in_the_dockerfile() -> None:
    done = lint(DOCKERFILE)
    assert (done.stdout, done.returncode) == ("", 0), done.stderr


@needs_hadolint
def test_the_linter_itself_finds_a_fault(tmp_path: Path) -> None:
    worse = tmp_path / "Dockerfile"
    worse.write_text(DOCKERFILE.read_text().replace("FROM ros:jazzy-ros-core", "FROM ros:latest"))
    assert "DL3007" in lint(worse).stdout


@needs_compose_spec
def test_the_compose_file_is_valid() -> None:
    validate(COMPOSE.read_text())


@needs_compose_spec
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("read_only: true", "read_onlly: true"),
        ("restart: unless-stopped", "restart: sometimes"),
        ("stop_grace_period: 5s", "stop_grace_period: soon"),
        ("mem_limit: 4g", "mem_limit: lots"),
        ("recordings:/var/lib/rpf3d/recordings", "recordings:var/lib/rpf3d/recordings"),
    ],
)
def test_the_validation_itself_finds_a_fault(right: str, wrong: str) -> None:
    assert right in COMPOSE.read_text()
    with pytest.raises(ValueError):
        validate(COMPOSE.read_text().replace(right, wrong))


def test_the_image_runs_without_root() -> None:
    users = re.findall(r"^USER (.*)$", DOCKERFILE.read_text(), re.MULTILINE)
    assert users == ["${UID}:${UID}"] and "ARG UID=10001" in DOCKERFILE.read_text()


@pytest.mark.parametrize("name", SERVICES)
def test_a_service_may_write_to_its_volumes_only_and_starts_again(name: str) -> None:
    service = SERVICES[name]
    assert service["read_only"] is True and service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert service["restart"] == "unless-stopped"
    written = [volume.split(":")[1] for volume in service["volumes"] if not volume.endswith(":ro")]
    assert all(re.match(r"/var/(lib|log|cache)/rpf3d", folder) for folder in written) and "/var/log/rpf3d" in written


def test_every_named_volume_is_declared_and_used() -> None:
    volumes = [volume.split(":")[0] for service in SERVICES.values() for volume in service["volumes"]]
    declared = yaml.safe_load(COMPOSE.read_text())["volumes"]
    assert {volume for volume in volumes if "/" not in volume} == set(declared)


@pytest.mark.parametrize("name", SERVICES)
def test_a_service_shares_network_and_memory_with_other_programs_of_this_machine_only(
    name: str,
) -> None:
    service = SERVICES[name]
    assert (service["network_mode"], service["ipc"]) == ("host", "host")
    assert service["environment"]["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    assert service["environment"]["ROS_DOMAIN_ID"] == "0"


@pytest.mark.parametrize("name", SERVICES)
def test_a_service_runs_a_program_of_the_package_with_parameters_that_it_declares(name: str) -> None:
    pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")
    from dataclasses import fields

    from rpf3d_ros.interface.parameters import AlarmBridgeParameters, RecorderParameters, SimulatorParameters

    declared = {"simulator": SimulatorParameters, "recorder": RecorderParameters, "alarm_bridge": AlarmBridgeParameters}
    program, *words = SERVICES[name]["command"]
    assert f'"{program} = ' in (ROOT / "setup.py").read_text()
    names = {word.partition(":=")[0] for word in words if ":=" in word}
    assert names - {each.name for each in fields(declared[name])} - {"scene"} == set()


@pytest.mark.parametrize(("name", "unit"), [("simulator", "rpf3d"), ("recorder", "rpf3d_recorder")])
def test_a_service_has_the_parameters_of_the_systemd_unit(name: str, unit: str) -> None:
    text = (ROOT / "config" / f"{unit}.service").read_text()
    assert {word for word in SERVICES[name]["command"] if ":=" in word} == set(re.findall(r"\S+:=\S+", text))


def test_the_image_is_named_after_the_version() -> None:
    (version,) = re.findall(r'version="([\d.]+)"', (ROOT / "setup.py").read_text())
    assert {service["image"] for service in SERVICES.values()} == {f"rpf3d:{version}"}


def test_the_builder_gets_what_the_image_copies_and_all_of_it_is_there() -> None:
    copies = re.findall(r"^COPY (.*) \S+$", DOCKERFILE.read_text(), re.MULTILINE)
    copied = {name for line in copies for name in line.split()}
    allowed = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    assert copied == allowed
    assert all((ROOT / name).exists() for name in copied)


def test_the_check_of_the_build_passes_with_the_packages_of_this_environment() -> None:
    pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")
    done = subprocess.run(
        [sys.executable, str(DOCKER / "check_messages.py")], cwd=ROOT, capture_output=True, text=True, check=False,
        env={"PYTHONPATH": ":".join([str(ROOT), *filter(None, sys.path)]), "PATH": "/usr/bin:/bin"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "sensor_msgs/msg/PointCloud2: read as written" in done.stdout
