"""Lay out a report as one HTML file, which contains its pictures and scripts and sends no requests."""

import base64
from collections.abc import Sequence
from html import escape

from rpf3d_core.report.elements import (
    Bullets,
    Element,
    Heading,
    Picture,
    SignOff,
    Table,
    Text,
    View,
    Warnings,
    unbroken,
)

POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline' 'unsafe-eval'; " \
         "img-src data: blob:; font-src data:; worker-src blob:"  # fmt: skip
"""Content security policy: the browser loads nothing from outside the file. The script of plotly needs
`unsafe-eval`, because it compiles parts of itself."""
STYLE = """
:root { color-scheme: light; }
body { font: 15px/1.5 "Segoe UI", "Helvetica Neue", Arial, "Liberation Sans", sans-serif; color: #1b2430;
  background: #fff; max-width: 1080px; margin: 2em auto; padding: 0 1.5em; }
h1 { font-size: 1.9em; margin: 0 0 .2em; } h2 { font-size: 1.3em; margin: 2em 0 .5em; padding-bottom: .2em;
  border-bottom: 2px solid #1f4e9c; } h3 { font-size: 1.05em; margin: 1.4em 0 .4em; }
p.quiet, figcaption { color: #55606e; font-size: .9em; }
table { border-collapse: collapse; width: 100%; margin: .6em 0 1em; font-size: .93em; }
th { text-align: left; background: #eef2f8; border-bottom: 2px solid #c6d0de; vertical-align: bottom; }
th, td { padding: .35em .6em; } td { border-bottom: 1px solid #e3e7ee; vertical-align: top; }
table.right td:not(:first-child), table.right th:not(:first-child) { text-align: right; }
table.right td { font-variant-numeric: tabular-nums; }
.warnings { border: 1px solid #d9a400; border-left-width: 6px; background: #fff8e1; padding: .7em 1.2em;
  margin: 1em 0; }
.warnings strong { display: block; margin-bottom: .3em; } .warnings ul { margin: 0; padding-left: 1.2em; }
figure { margin: 1em 0; } figure img { max-width: 100%; border: 1px solid #e3e7ee; }
.view { border: 1px solid #e3e7ee; height: 640px; }
.sign { display: grid; grid-template-columns: 1fr 1fr; gap: 2.4em 2em; margin-top: 2.2em; }
.sign div { border-top: 1px solid #1b2430; padding-top: .2em; font-size: .9em; color: #55606e; }
@media print { body { margin: 0; max-width: none; font-size: 11px; } h2 { break-after: avoid; }
  table, figure, .warnings, .sign { break-inside: avoid; } .modebar { display: none !important; } }
"""


def html_document(title: str, elements: Sequence[Element], script: str) -> str:
    """Return the report as one HTML document; script : the JavaScript that the 3D view needs."""
    return "\n".join([
        "<!DOCTYPE html>", '<html lang="en">', "<head>", '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(title)}</title>", f"<style>{STYLE}</style>",
        f"<script>{script}</script>" if any(isinstance(element, View) for element in elements) else "",
        "</head>", "<body>", *map(_element, elements), "</body>", "</html>", "",
    ])  # fmt: skip


def _element(element: Element) -> str:
    """Return one element of the report as HTML."""
    match element:
        case Heading(text, level):
            return f"<h{level}>{escape(text)}</h{level}>"
        case Text(text, quiet):
            return f'<p class="quiet">{escape(text)}</p>' if quiet else f"<p>{escape(text)}</p>"
        case Bullets(sentences):
            return _bullets(sentences)
        case Warnings(title, sentences):
            return f'<div class="warnings" role="alert"><strong>{escape(title)}</strong>{_bullets(sentences)}</div>'
        case Table():
            return _table(element)
        case Picture():
            return _picture(element)
        case View(html, caption, _):
            return f'<figure><div class="view">{html}</div><figcaption>{escape(caption)}</figcaption></figure>'
        case SignOff(fields):
            return '<div class="sign">' + "".join(f"<div>{escape(field)}</div>" for field in fields) + "</div>"


def _bullets(sentences: Sequence[str]) -> str:
    return "<ul>" + "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences) + "</ul>"


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in table.header)
    lines = ("".join(f"<td>{escape(unbroken(cell))}</td>" for cell in row) for row in table.rows)
    rows = "".join(f"<tr>{cells}</tr>" for cells in lines)
    kind = ' class="right"' if table.right else ""
    return f"<table{kind}><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def _picture(picture: Picture) -> str:
    data, caption = base64.b64encode(picture.png).decode("ascii"), escape(picture.caption)
    style = f"width: {100.0 * picture.width:.0f}%"
    return f'<figure><img alt="{caption}" style="{style}" src="data:image/png;base64,{data}">' \
           f"<figcaption>{caption}</figcaption></figure>"  # fmt: skip
