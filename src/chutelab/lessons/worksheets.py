"""Worksheets in Markdown as HTML."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from markdown_it import MarkdownIt

if TYPE_CHECKING:
    from markdown_it.token import Token

PAGE: Final = "index.html"
"""What a link to another lesson's worksheet becomes."""

_WORKSHEET: Final = re.compile(r"(^|/)README\.md(?=$|#)")


def html_of(markdown: str) -> str:
    """Return the HTML of a worksheet, without its title and its picture, which the page has.

    Raw HTML is shown, not obeyed. Links to worksheets become links to pages.
    """
    parser = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = _body(parser.parse(markdown))
    for token in tokens:
        for inner in token.children or ():
            target = inner.attrGet("href")
            if isinstance(target, str):
                inner.attrSet("href", _WORKSHEET.sub(rf"\g<1>{PAGE}", target))
    made = str(parser.renderer.render(tokens, parser.options, {}))
    # What is too wide for a phone scrolls by itself, and with the keyboard.
    return re.sub("<(pre|table)>", r'<\1 tabindex="0">', made)


def plain_of(markdown: str) -> str:
    r"""Return a worksheet for a terminal, which shows no pictures, under a title of its own.

    >>> plain_of("# Title\n\n![x](x.gif)\n\nSee [it](it.ipynb), [doi](https://doi.org/1).\n")
    'See it, [doi](https://doi.org/1).\n'
    """
    text = re.sub(r"\A# .*\n+|^!\[[^\]]*\]\([^)]*\)\n+", "", markdown, flags=re.MULTILINE)
    return re.sub(r"(?<!!)\[([^\]]+)\]\((?!https?:)[^)]*\)", r"\1", text)


def pictures_of(markdown: str) -> dict[str, str]:
    """Return the words that stand for each picture of a worksheet, by the picture's address."""
    found = MarkdownIt("commonmark").parse(markdown)
    images = [i for token in found for i in token.children or () if i.type == "image"]
    return {str(image.attrGet("src")): image.content for image in images}


def _body(tokens: list[Token]) -> list[Token]:
    """Leave out the first heading of level 1, and paragraphs that hold nothing but a picture."""
    kept: list[Token] = []
    skipping = ""
    for i, token in enumerate(tokens):
        if not skipping and token.level == 0:
            inner = tokens[i + 1].children or [] if i + 1 < len(tokens) else []
            alone = [one.type for one in inner] == ["image"]
            if token.type == "paragraph_open" and alone:
                skipping = "paragraph_close"
            elif token.type == "heading_open" and token.tag == "h1":
                skipping = "heading_close"
        if not skipping:
            kept.append(token)
        elif token.type == skipping:
            skipping = ""
    return kept
