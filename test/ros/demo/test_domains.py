"""Tests that no two processes on a machine get the same ROS domain."""

import subprocess
import sys

import pytest

from rpf3d_core.errors import InputError
from rpf3d_ros.demo import domains
from rpf3d_ros.demo.processes import isolated_environment

ASK = "from rpf3d_ros.demo.domains import free_domain; domain, lock = free_domain(); print(domain, flush=True); input()"


@pytest.fixture(autouse=True)
def three_domains(monkeypatch, tmp_path):
    """Reduce the domains to three, with lock files in a folder that no other process uses."""
    monkeypatch.setattr(domains, "DOMAINS", 3)
    monkeypatch.setattr(domains.tempfile, "tempdir", str(tmp_path))


def test_a_domain_is_given_once_until_it_is_let_go():
    given = dict(domains.free_domain() for _ in range(3))
    assert set(given) == {1, 2, 3}
    with pytest.raises(InputError, match="all 3 ROS domains are taken"):
        domains.free_domain()
    given[2].close()
    domain, lock = domains.free_domain()
    assert domain == 2
    for each in (lock, given[1], given[3]):
        each.close()


def test_another_process_is_kept_out(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    other = subprocess.Popen([sys.executable, "-c", ASK], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    theirs = int(other.stdout.readline())
    monkeypatch.setattr(domains, "DOMAINS", 101)
    monkeypatch.setattr(domains, "_numbers", iter([theirs - 1, theirs]))
    domain, lock = domains.free_domain()
    assert domain == theirs % 101 + 1, "the next one"
    lock.close()
    monkeypatch.setattr(domains, "_numbers", iter([theirs - 1]))
    with pytest.raises(InputError):
        domains.free_domain()
    other.communicate("\n")
    monkeypatch.setattr(domains, "_numbers", iter([theirs - 1]))
    domains.free_domain()[1].close()


def test_what_is_started_beside_has_a_domain_of_its_own(tmp_path):
    given = [isolated_environment(tmp_path)["ROS_DOMAIN_ID"] for _ in range(3)]
    assert len(set(given)) == 3
