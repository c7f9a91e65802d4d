"""Write docs/examples.md, the gallery: the scripts in examples/, with their docstrings and their pictures.

python docs/gallery.py
"""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "examples.md"
HEAD = """# Examples

These are short, complete Python scripts that you can run and change. Scripts that write files write them into the
folder `out/` in the current folder. The pictures show the results of the scripts.
"""
NONE_YET = "The folder `examples/` has no scripts yet.\n"
COMMAND = """
```
.venv/bin/python examples/{name}.py
```
"""


def gallery(root: Path) -> str:
    """Return the page for the scripts in root/examples, in the order of their names."""
    scripts = sorted((root / "examples").glob("[!_]*.py"))
    return "\n".join([HEAD, *map(section, scripts)]) if scripts else f"{HEAD}\n{NONE_YET}"


def section(script: Path) -> str:
    """Return the section of a script: first line of its docstring as heading, picture, further text, command, link."""
    title, _, text = (ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or script.stem).partition("\n")
    parts = [f"## {title.rstrip('.')}", *picture(script), text.strip(), COMMAND.format(name=script.stem).strip()]
    return "\n\n".join(filter(None, [*parts, f"[examples/{script.name}](../examples/{script.name})"])) + "\n"


def picture(script: Path) -> list[str]:
    """Return the Markdown of a script's picture in docs/images/examples as a list; empty without a picture."""
    name = f"images/examples/{script.stem}.png"
    there = (script.parents[1] / "docs" / name).is_file()
    return [f"![The result of {script.name}]({name})"] if there else []


if __name__ == "__main__":
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(gallery(ROOT), encoding="utf-8")
    print(f"wrote {PAGE.relative_to(ROOT)}")
