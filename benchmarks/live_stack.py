"""Run nodes as real processes for benchmarks and soak tests: start them, measure them, and end them by process id."""

import json
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Self

from rpf3d_ros.demo.processes import ended, isolated_environment, node_process, tails

KB = 1024
MB = 1e6
HEARTBEAT = Path(__file__).parent / "live_heartbeat.py"


class Stack:
    """A set of nodes: processes, output folder and separate DDS domain; a context manager that ends the processes.

    Processes are named after their module, such as `simulator_node`, or their script without its extension. A second
    process of a module has a name of its own, and writes its output to a folder of this name.
    began : name -> number of times that the node was started; killed : names of the processes that `kill` has ended
    """

    def __init__(self, folder: Path | None = None) -> None:
        """Create the folder and the DDS domain; folder : output folder of the nodes, None for a temporary folder."""
        self._temporary = tempfile.TemporaryDirectory(prefix="rpf3d_live_") if folder is None else None
        self.folder = Path(self._temporary.name) if self._temporary else folder
        assert self.folder is not None
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self.began: dict[str, int] = {}
        self.killed: set[str] = set()
        os.environ.update(isolated_environment(self.folder))

    def start(self, module: str, parameters: dict[str, Any], namespace: str = "", name: str = "") -> int:
        """Start a node of the package, such as `simulator_node`; return its process id.

        namespace : of the node, "" for the root namespace; name : of the process, "" for the name of the module
        """
        given = ["-r", f"__ns:={namespace}"] if namespace else []
        given += [word for key, value in parameters.items() for word in ("-p", f"{key}:={_written(value)}")]
        logs, name = self.folder / name, name or module
        logs.mkdir(exist_ok=True)
        earlier = logs / f"{module}.out"
        if earlier.is_file() and name in self.began:  # keeps the output of the killed node, which shows the cause
            earlier.rename(logs / f"{module}.{self.began[name]}.out")
        self.processes[name] = node_process(module, given, logs)
        self.began[name] = self.began.get(name, 0) + 1
        return self.processes[name].pid

    def start_script(self, script: Path, *arguments: str) -> int:
        """Start a program that is not a node of the package, with arguments; return its process id."""
        self.processes[script.stem] = subprocess.Popen(
            [sys.executable, str(script), *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )  # fmt: skip
        return self.processes[script.stem].pid

    def kill(self, module: str) -> None:
        """End a process at once, by SIGKILL."""
        self.killed.add(module)
        self.processes[module].kill()
        self.processes[module].wait()

    def end(self, module: str) -> int:
        """End a node by SIGINT, as an operator does; return its exit code."""
        return ended(self.processes[module])

    def alive(self, module: str) -> bool:
        """Return True if a process runs."""
        return module in self.processes and self.processes[module].poll() is None

    def memory(self, module: str) -> tuple[float, float]:
        """Return the current and the largest resident memory of a node (MB); NaN if the node does not run."""
        try:
            status = Path(f"/proc/{self.processes[module].pid}/status").read_text()
        except OSError:
            return float("nan"), float("nan")
        fields = dict(line.split(":", 1) for line in status.splitlines() if ":" in line)
        if "VmRSS" not in fields:
            return float("nan"), float("nan")
        return tuple(int(fields[name].split()[0]) * KB / MB for name in ("VmRSS", "VmHWM"))  # type: ignore[return-value]

    def cpu(self, module: str) -> float:
        """Return the CPU time (s) that a node has used so far; NaN if the node does not run."""
        try:
            words = Path(f"/proc/{self.processes[module].pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return float("nan")
        return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")

    def tails(self) -> str:
        """Return the last lines of each node's output, to explain a failure."""
        folders = [self.folder, *(folder for name in self.processes if (folder := self.folder / name).is_dir())]
        return "\n".join(tails(folder) for folder in folders)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        for process in reversed(list(self.processes.values())):
            ended(process)
        if self._temporary:
            self._temporary.cleanup()


class Heartbeat:
    """A process that calls a service of a node again and again, to show when the node is blocked; a context manager.

    service : name of the service; beats : result of `stop`
    """

    def __init__(self, service: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, str(HEARTBEAT), service], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )  # fmt: skip
        self.beats: list[tuple[int, int, int]] = []

    def stop(self) -> list[tuple[int, int, int]]:
        """End the process; return the times at which each call was due, sent and answered (ns, monotonic)."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
            out, _ = self._process.communicate(timeout=20)
            self.beats = [tuple(beat) for beat in json.loads(out or "[]")]
        return self.beats

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.stop()


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{value}"' if isinstance(value, str) and not value else str(value)


def machine() -> str:
    """Return the processor and the load of this machine as text, because both affect the figures."""
    cores = len(os.sched_getaffinity(0))
    model = next((line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines()
                  if line.startswith("model name")), "unknown processor")  # fmt: skip
    one, five, _ = os.getloadavg()
    return f"{cores} cores of {model}; load {one:.1f} (1 min), {five:.1f} (5 min) at the start"
