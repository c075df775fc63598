"""Paragraphs of generated help texts."""

from __future__ import annotations

EXAMPLES = "\b\nExamples:"
"""Beginning of the examples, the last part of a help text."""


def with_paragraph(text: str, paragraph: str) -> str:
    """Return a help text with a paragraph in front of its examples, or at its end if it has none."""
    before, examples, after = text.partition(EXAMPLES)
    return f"{before.rstrip()}\n\n{paragraph}" + (f"\n\n{examples}{after}" if examples else "")
