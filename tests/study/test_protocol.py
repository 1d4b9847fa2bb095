"""Frames arrive whole or not at all, and nothing else passes for a frame."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.study.protocol import HEADER, MAGIC, FrameReader, GarbledError, Request, pack_frame


@settings(deadline=None, max_examples=50)
@given(st.lists(st.text(max_size=50), max_size=5), st.integers(1, 40))
def test_messages_survive_any_cutting(texts: list[str], size: int) -> None:
    """However the bytes are cut on their way, the same messages arrive in the same order."""
    sent = [Request("0" * 16, index, text) for index, text in enumerate(texts)]
    stream = b"".join(map(pack_frame, sent))
    reader = FrameReader()
    pieces = (stream[start : start + size] for start in range(0, len(stream), size))
    assert [message for piece in pieces for message in reader.messages(piece)] == sent


@pytest.mark.parametrize(
    "stray",
    [
        b"** On entry to DGESDD parameter number 4 had an illegal value\n",
        HEADER.pack(MAGIC, 1 << 60),
        HEADER.pack(MAGIC, 4) + b"abcd",
    ],
)
def test_stray_bytes_are_no_message(stray: bytes) -> None:
    """Printed text, an absurd length and a payload that is no pickle are refused."""
    with pytest.raises(GarbledError):
        FrameReader().messages(stray)
