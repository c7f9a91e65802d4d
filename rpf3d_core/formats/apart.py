"""Read files with other programs' libraries in a separate process, with limited memory and time.

Some of these libraries crash, hang or use all memory on damaged files.
"""

import importlib
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.jit.child_python import command_of, environment_of_child

REFUSED = 2
"""Exit code of the separate process if it refuses a file; the reason is on its standard output."""

Arrays = dict[str, Any]
"""The result of a reader in the separate process: arrays by name."""


def read_apart(path: Path, reader: str, *options: str) -> Arrays:
    """Read a file in a separate process, so that a crash of a library does not end this process; return its arrays.

    reader : module and function, such as `rpf3d_core.formats.vtk_files:read_here`; the function takes the path and the
        options, and returns arrays by name
    options : further arguments of the reader

    Raises
    ------
    TerrainError
        The file is refused, or the separate process crashes or exceeds its limits of memory or time.
    RuntimeError
        The separate process fails for another reason, such as an error of rpf3d.
    """
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "arrays.npz"
        done = subprocess.run(
            command_of("rpf3d_core.formats.apart_child", reader, str(path), str(result), *options),
            env=environment_of_child(),
            capture_output=True,
            check=False,
        )
        if done.returncode == REFUSED and done.stdout:
            raise TerrainError(done.stdout.decode("utf-8", "replace"))
        if done.returncode < 0:
            raise TerrainError(f"{path}: is damaged; the library that reads {path.suffix} files breaks down on it")
        if done.returncode > 0:
            raise RuntimeError(f"{path}: the process that reads it failed: {done.stderr.decode('utf-8', 'replace')}")
        with np.load(result) as arrays:
            return dict(arrays)


def reader_named(name: str) -> Callable[..., Arrays]:
    """Import and return the function with a name such as `rpf3d_core.formats.vtk_files:read_here`."""
    module, _, function = name.partition(":")
    found: Callable[..., Arrays] = getattr(importlib.import_module(module), function)
    return found
