"""Preprocessor of the book: hides the tildes of rendered formulas from Markdown, which takes a pair of them for strike-out.

mdBook runs it after the preprocessor for formulas, with the book as JSON on standard input and output.
"""

import json
import sys


def escape(item):
    """Escapes the text of a chapter and of the chapters below it."""
    chapter = item.get("Chapter") if isinstance(item, dict) else None
    if chapter is not None:
        chapter["content"] = chapter["content"].replace("<mo>~</mo>", "<mo>&#126;</mo>")
        for below in chapter["sub_items"]:
            escape(below)


if len(sys.argv) > 1 and sys.argv[1] == "supports":
    sys.exit(0)
_, book = json.load(sys.stdin)
for item in book.get("items", book.get("sections", [])):
    escape(item)
json.dump(book, sys.stdout)
