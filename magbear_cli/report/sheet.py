"""A figure as it leaves the report: its files as bytes, and the words around it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Print:
    """A figure in three forms, the numbers behind it as CSV, and what a page says about it (as ``Drawing`` has it)."""

    name: str
    title: str
    caption: str
    alt: str
    case_id: str | None
    svg: bytes
    pdf: bytes
    png: bytes
    csv: bytes
