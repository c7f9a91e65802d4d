"""Tests that each reader reads a damaged file or refuses it with a sentence, without a hang or a crash.

Damage is drawn from a fixed seed. Each format is tried in a separate process, so that a crash or hang is detected.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from suite.quick import long_except

MUTATIONS = int(os.environ.get("RPF3D_MUTATIONS", "300"))
FEWER = MUTATIONS // 10
"""Number of mutations for formats that need a separate process for each file, 0.7 s each."""
LONGEST = 480.0 * max(1.0, MUTATIONS / 300)
"""Time (s) after which all mutations of a kind count as hanging. Each damaged LAZ file is read in a separate process,
0.4 s per file on a machine with little else to do; three workers share two cores."""
FOLDERS = [str(Path(__file__).parents[1] / "support"), str(Path(__file__).parents[2])]

CHILD = """
import random, sys, traceback, warnings
kind, folder, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
sys.path[:0] = sys.argv[4:]
warnings.simplefilter("ignore")
from pathlib import Path
from input_files.mutated_files import READERS, mutated
from rpf3d_core.errors import InputError

write, read = READERS[kind]
path = Path(folder) / f"m.{kind.split()[0]}"
write(path)
sound = path.read_bytes()
read(path)
rng = random.Random(kind)
refused = 0
for number in range(count):
    damaged = mutated(sound, rng)
    path.write_bytes(damaged)
    (path.parent / "last").write_text(f"mutation {number} of {kind}")
    try:
        read(path)
    except InputError as fault:
        refused += 1
        lines = str(fault).splitlines()
        assert all(line.startswith(str(path)) for line in lines) and lines, (number, str(fault))
        assert len(lines) == 1 or kind.startswith("yaml"), (number, str(fault))
    except BaseException:
        path.with_name(f"wrong_{number}").write_bytes(damaged)
        print(f"mutation {number} of {kind}: {damaged[:1500]!r}")
        traceback.print_exc()
        sys.exit(1)
print(refused)
"""

QUICK = {"stl binary", "ply text", "yaml text", "xml tin"}
"""Kinds that `make test` tries: one binary format, text formats, and scene files."""

KINDS = [
    "stl binary", "stl text", "ply binary", "ply big", "ply text", "obj text", "vtp binary", "vtp text", "vtk binary",
    "vtk text", "asc text", "asc.gz packed", "tif tiles", "geojson text", "xyz text", "yaml text",
    "dxf faces", "dxf lines", "xml tin", "dtm surpac", "str lines", "omf surface", "csv cloud", "las cloud",
    "laz cloud", "e57 cloud", "gpkg areas", "shp areas",
]  # fmt: skip


NEEDS = {
    "dxf": "ezdxf", "omf": "omf", "las": "laspy", "laz": "lazrs", "e57": "pye57", "gpkg": "pyogrio", "shp": "pyogrio",
}  # fmt: skip
"""Extension of a file -> library that writes or reads such files."""


@pytest.mark.parametrize("kind", long_except(QUICK, KINDS))
def test_a_damaged_file_is_read_or_refused_and_never_more(tmp_path, kind):
    library = NEEDS.get(kind.split()[0])
    if library:
        pytest.importorskip(library, reason=f"{library} is not installed: it is in the extra `mine` or `test`")
    mutations = FEWER if kind.startswith("vt") else MUTATIONS
    done = subprocess.run(
        [sys.executable, "-c", CHILD, kind, str(tmp_path), str(mutations), *FOLDERS],
        capture_output=True, text=True, timeout=LONGEST, check=False,
    )  # fmt: skip
    last = (tmp_path / "last").read_text() if (tmp_path / "last").exists() else "before the first mutation"
    assert done.returncode == 0, f"{last}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    assert int(done.stdout.split()[-1]) > mutations // 20, "most damage should be noticed"
