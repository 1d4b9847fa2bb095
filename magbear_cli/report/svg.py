"""A figure's SVG made fit for a page: described for those who do not see it, without links, with names of its own."""

from __future__ import annotations

import re
from html import escape

_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_PREAMBLE = re.compile(r"^.*?(?=<svg\b)", re.DOTALL)
_METADATA = re.compile(r"\s*<metadata>.*?</metadata>", re.DOTALL)
_STYLE = re.compile(r"\s*<defs>\s*<style\b[^>]*>.*?</style>\s*</defs>", re.DOTALL)
_NAMESPACES = re.compile(r'\s+xmlns(?::\w+)?="[^"]*"')
_SIZE = re.compile(r'(<svg\b[^>]*?)\s+width="[^"]*"\s*(?=[^>]*>)')
_HEIGHT = re.compile(r'(<svg\b[^>]*?)\s+height="[^"]*"')
_COORDINATES = re.compile(r'(?<=\sd=")[^"]*(?=")')
_LONG_NUMBER = re.compile(r"-?\d+\.\d{3,}")
_NAME = re.compile(r'\bid="([^"]+)"')
_GLYPH = re.compile(r'\s*<path id="(DejaVu[^"]+|STIX[^"]+|cm[^"]+)" d="[^"]*"[^>]*/>', re.DOTALL)
_EMPTY_DEFINITIONS = re.compile(r"\s*<defs>\s*</defs>")
_BETWEEN_TAGS = re.compile(r">\s+<")


def described(svg: bytes, title: str, description: str) -> bytes:
    """The SVG file with a title and a description that screen readers speak."""
    text = svg.decode("utf-8")
    words = f"<title>{escape(title)}</title>\n <desc>{escape(description)}</desc>"
    return re.sub(r"(<svg\b[^>]*>)", lambda found: f"{found[1]}\n {words}", text, count=1).encode("utf-8")


def inlined(svg: bytes, prefix: str, glyphs: dict[str, str]) -> str:
    """The SVG as part of a page.

    Parameters
    ----------
    prefix : goes before every name in the picture, which the page's other pictures use too
    glyphs : the letters' outlines of all pictures by name; those of this one are taken out of it and added
    """
    text = _PREAMBLE.sub("", svg.decode("utf-8"), count=1)
    for unwanted in (_COMMENT, _METADATA, _STYLE):
        text = unwanted.sub("", text)
    text = _NAMESPACES.sub("", text)
    text = _HEIGHT.sub(r"\1", _SIZE.sub(r"\1", text, count=1), count=1)
    for found in _GLYPH.finditer(text):
        glyphs.setdefault(found[1], found[0].strip())
    text = _EMPTY_DEFINITIONS.sub("", _GLYPH.sub("", text))
    text = _COORDINATES.sub(lambda path: _rounded(path[0]), text)
    own = set(_NAME.findall(text))
    text = _NAME.sub(rf'id="{prefix}-\1"', text)
    text = re.sub(
        r'((?:xlink:)?href="#|url\(#)([^")]+)',
        lambda found: f"{found[1]}{prefix}-{found[2]}" if found[2] in own else found[0],
        text,
    ).replace("xlink:href", "href")
    text = _BETWEEN_TAGS.sub("><", text).strip()
    return text.replace("<svg", '<svg aria-hidden="true" focusable="false"', 1)


def _rounded(path: str) -> str:
    """Coordinates to a hundredth of a point, which no eye resolves."""
    return " ".join(_LONG_NUMBER.sub(lambda number: f"{float(number[0]):.2f}".rstrip("0").rstrip("."), path).split())
