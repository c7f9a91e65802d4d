"""Compare the results of this source tree with the golden digests, bit by bit, or renew the digests.

    PYTHONPATH=test/support:. python -m golden_results.golden [ENTRY ...]

    without ENTRY         compare every entry with golden.json, one line each
    demo sphere           compare these entries only
    --keep FOLDER demo    also keep the results, to compare them file by file
    --renew "WHY"         write golden.json from this tree, with the reason

An entry is a scene of golden_scenes.py, which the command line flies, or the ROS session of golden_messages.py.
golden_digests.py defines the digested parts of a result.

The digests are valid for one kind of machine: another processor, NumPy or C library may round the last bit of a sine
differently. The command therefore runs without the instruction sets that only some processors have (AVX-512).
golden.json also contains a fingerprint of the machine that made the digests; on a machine with another fingerprint
nothing is compared.
"""

import argparse
import io
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from golden_results.golden_digests import digest_of, digest_of_scene, digests_of
from golden_results.golden_scenes import BOTH, ENTRIES

ROOT = Path(__file__).parents[3]
GOLDEN = Path(__file__).with_suffix(".json")
SESSION = "ros_session"
"""Name of the entry of golden_messages.py."""
RESULTS = "results"
"""Folder of an entry's results, inside the folder of the engine."""
NAMES = (*ENTRIES, SESSION)
WIDE = ("X86_V4", "AVX512")
"""Beginnings of the names of NumPy's instruction sets that only some x86 processors have."""
LIBRARIES = ("numpy", "vtk", "shapely")
"""Libraries whose version may change bits, or the order of the corners of a polygon."""

Digests = Mapping[str, str]
"""The digests of one entry: part -> digest."""


def command(*words: object) -> str:
    """Run `rpf3d` in this process and return its output. Raises RuntimeError, with the output, if it fails."""
    from rpf3d_core import cli

    printed = io.StringIO()
    arguments = mock.patch.object(sys, "argv", ["rpf3d", *map(str, words)])
    try:
        with arguments, redirect_stdout(printed), redirect_stderr(printed):
            cli.main()
    except SystemExit as end:
        if end.code:
            raise RuntimeError(printed.getvalue()) from end
    return printed.getvalue()


def engines_of(name: str) -> tuple[str, ...]:
    """Return the names of the engines that fly an entry."""
    return ENTRIES[name].engines if name in ENTRIES else BOTH


def missing_for(name: str, engine: str) -> str:
    """Return why an engine cannot fly an entry on this machine; "" if the engine can."""
    if engine == "compiled" and find_spec("numba") is None:
        return "numba is not installed: there is no compiled engine"
    if name == SESSION and find_spec("rclpy") is None:
        return "ROS 2 (rclpy) is not installed; install the extra `ros`"
    return ""


def why_left_out(name: str) -> str:
    """Return why no engine can fly an entry on this machine; "" if at least one engine can."""
    reasons = [missing_for(name, engine) for engine in engines_of(name)]
    return reasons[0] if all(reasons) else ""


def made(name: str, folder: Path) -> Digests:
    """Fly an entry on each of its engines and return its digests; the results are written into the folder.

    Where the engines disagree, the value of the part contains the digests of both, with the names of the engines.
    """
    engines = [engine for engine in engines_of(name) if not missing_for(name, engine)]
    found = joined({engine: _made_on(name, engine, folder / engine) for engine in engines})
    if name in ENTRIES:
        found["scene digest"] = digest_of_scene(folder / engines[0] / RESULTS)
    return found


def joined(engines: Mapping[str, Digests]) -> dict[str, str]:
    """Return part -> digest: the common digest of all engines, or the digest of each engine if the engines disagree."""
    found = {}
    for part in dict.fromkeys(part for digests in engines.values() for part in digests):
        values = [digests.get(part, "nothing") for digests in engines.values()]
        each = ", ".join(f"{engine} {value}" for engine, value in zip(engines, values, strict=True))
        found[part] = values[0] if len(set(values)) == 1 else each
    return found


def _made_on(name: str, engine: str, folder: Path) -> Digests:
    """Fly an entry on one engine and return its digests."""
    if name not in ENTRIES:
        from golden_results.golden_messages import digests_of_session

        return digests_of_session(engine)
    folder.mkdir(parents=True, exist_ok=True)
    rocks = ("--rocks", ENTRIES[name].rocks) if ENTRIES[name].rocks else ()
    command("run", ENTRIES[name].write(folder), "--out", folder / RESULTS, "--engine", engine, *rocks)
    return digests_of(folder / RESULTS)


def common_instructions() -> dict[str, str]:
    """Return environment variables with which NumPy uses only instructions that all common processors have.

    The result is empty if this process already does so.
    """
    used = np.show_config("dicts")["SIMD Extensions"].get("found", ())
    wide = [name for name in used if name.startswith(WIDE)]
    return {"NPY_DISABLE_CPU_FEATURES": " ".join(wide)} if wide else {}


def fingerprint() -> dict[str, str]:
    """Return the properties of the machine that affect the last bit of a result: rounding, and library versions."""
    return {"functions": digest_of(*_rounded()), **{name: version(name) for name in LIBRARIES}}


def _rounded() -> Iterator[object]:
    """Yield results of NumPy and `math` functions whose last bit may differ between processors and libraries."""
    x = np.arange(1, 2001) / 256.0
    y, share = x[::-1].copy(), x / 8.0
    for name in ("sin", "cos", "tan", "exp", "log", "log10", "log1p", "sqrt", "cbrt"):
        yield getattr(np, name)(x)
        yield [getattr(math, name)(value) for value in x.tolist()]
    yield from (np.arccos(share), [(math.acos(a), math.atan(a), math.erfc(a), math.lgamma(a)) for a in share.tolist()])
    yield from (np.arctan2(x, y), np.power(x, 0.7562), np.hypot(x, y))
    for a, b in zip(x.tolist(), y.tolist(), strict=True):
        yield math.atan2(a, b), math.pow(a, 0.7562), math.hypot(a, b)
    rows = x[:1500].reshape(-1, 3)
    yield from (x @ y, rows @ rows[:3], np.einsum("ij,ij->i", rows, rows), x.sum(), np.linalg.norm(rows, axis=1))


def stored() -> dict[str, Any]:
    """Return the content of golden.json: the reason `why`, the fingerprint `made_with`, and the `entries`."""
    return dict(json.loads(GOLDEN.read_text(encoding="utf-8")))


def entries() -> dict[str, Digests]:
    """Return the golden digests of each entry by its name."""
    return dict(stored()["entries"])


def why_not_comparable() -> str:
    """Return why golden.json is not valid on this machine; "" if it is valid."""
    here, there = fingerprint(), stored()["made_with"]
    differ = [name for name in (*here, *there) if here.get(name) != there.get(name)]
    return f"golden.json was made with another {' and '.join(dict.fromkeys(differ))}" if differ else ""


def differences(golden: Digests, found: Digests) -> list[str]:
    """Return a line for each part that differs: `PART: changed`, `new` or `missing`."""
    how = {part: "missing" for part in golden if part not in found}
    how |= {part: "new" if part not in golden else "changed" for part in found if golden.get(part) != found[part]}
    return [f"{part}: {word}" for part, word in sorted(how.items())]


def compare(names: Sequence[str], keep: Path | None) -> bool:
    """Fly entries and print which parts differ from golden.json; return True if all parts are the same.

    The result is False if golden.json is not valid on this machine. keep : folder for the results, None to delete them
    """
    if reason := why_not_comparable():
        print(f"nothing is compared: {reason}")
        return False
    same, golden = True, entries()
    for name in names:
        if reason := why_left_out(name):
            print(f"{name}: left out, {reason}")
            continue
        found, words = _timed(name, keep)
        parts = differences(golden.get(name, {}), found)
        print(f"{name}: {'DIFFERS' if parts else 'same'}, {words}", *parts, sep="\n  ", flush=True)
        same = same and not parts
    return same


def renew(why: str) -> None:
    """Write golden.json from this tree, with the reason. Raises RuntimeError if engines disagree or one is missing."""
    content = {}
    for name in NAMES:
        if missing := next(filter(None, (missing_for(name, engine) for engine in engines_of(name))), ""):
            raise RuntimeError(f"{name}: {missing}")
        content[name], words = _timed(name, None)
        print(f"{name}: {words}", flush=True)
        if parts := [part for part, digest in content[name].items() if " " in digest]:
            raise RuntimeError(f"{name}: the engines disagree on {', '.join(parts)}")
    _print_changes(content)
    text = json.dumps({"why": why, "made_with": fingerprint(), "entries": content}, indent=1)
    GOLDEN.write_text(text + "\n", encoding="utf-8")


def _print_changes(content: Mapping[str, Digests]) -> None:
    """Print which parts of golden.json a renewal changes."""
    before = entries() if GOLDEN.exists() else {}
    for name in dict.fromkeys((*before, *content)):
        parts = differences(before.get(name, {}), content.get(name, {})) if name in before else ["a new entry"]
        if parts:
            print(f"renewed {name}:", *parts, sep="\n  ")


def _timed(name: str, keep: Path | None) -> tuple[Digests, str]:
    """Return the digests of an entry, and a text with the number of parts, the engines and the CPU time."""
    with tempfile.TemporaryDirectory() as temporary:
        began = time.process_time()
        found = made(name, (keep or Path(temporary)) / name)
        return found, f"{len(found)} parts, {', '.join(engines_of(name))}, {time.process_time() - began:.1f} s of CPU"


def main(words: Sequence[str] | None = None) -> int:
    """Compare or renew, depending on the command line; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("entry", nargs="*", choices=[*NAMES, []], metavar="ENTRY", help="compare these only")
    parser.add_argument("--renew", metavar="WHY", help="write golden.json, with the reason")
    parser.add_argument("--keep", metavar="FOLDER", type=Path, help="keep the results there")
    given = parser.parse_args(words)
    if given.renew is None:
        return 0 if compare(given.entry or NAMES, given.keep) else 1
    if not given.renew.strip() or given.entry:
        parser.error("--renew takes a reason, and renews every entry")
    renew(given.renew.strip())
    return 0


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))  # this tree, not an installed one
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    if instructions := common_instructions():
        again = [sys.executable, "-m", "golden_results.golden", *sys.argv[1:]]
        sys.exit(subprocess.run(again, env=os.environ | instructions, check=False).returncode)
    sys.exit(main())
