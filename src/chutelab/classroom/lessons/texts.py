"""A lesson's Markdown as HTML, as text for a terminal, and the words it has for a picture.

Formulas stand between dollar signs, in the part of TeX that `formulas` describes.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Final

from latex2mathml.converter import convert
from markdown_it import MarkdownIt
from markdown_it.tree import SyntaxTreeNode
from mdit_py_plugins.dollarmath import dollarmath_plugin

from chutelab.classroom.lessons.formulas import parsed, plain

INDEX: Final = "index.html"
_ADDRESSES: Final = (
    (r"(^|/)README(\.\w+)?\.md(?=$|#)", rf"\1{INDEX}"),
    (r"\bexplanation(\.\w+)?\.md$", "#explanation"),
)

_FORMULA: Final = re.compile(
    r"(```.*?```|`[^`]*`)|\$\$(.+?)\$\$|(?<![\\\w$])\$(?![\s$])([^$]+?)(?<![\s\\])\$(?!\w)",
    re.DOTALL,
)


def parser() -> MarkdownIt:
    """Return a parser of lessons' Markdown, for which raw HTML is text."""
    made = MarkdownIt("commonmark", {"html": False}).enable("table")
    return made.use(dollarmath_plugin, allow_space=False, renderer=_mathematics)


def _mathematics(tex: str, options: dict[str, bool]) -> str:
    return mathml(tex, display=options["display_mode"])


_NAMED: Final = r"(?:<mi>[a-z]{2,}</mi>|<(msu[bp])><mi>[a-z]{2,}</mi>.*?</\1>)"
_BESIDE: Final = re.compile(rf"{_NAMED}(?=<m[isf])|</m(?!o)\w+>(?={_NAMED.replace('1', '2')})")


def mathml(tex: str, *, display: bool = False) -> str:
    r"""Return a formula as MathML; functions such as cos stand apart from what is beside them.

    >>> mathml(r"2 \sin x").count("<mspace")
    2
    """
    made: str = convert(tex.strip(), display="block" if display else "inline")
    return _BESIDE.sub(r'\g<0><mspace width="0.167em" />', made)


def html_of(markdown: str, folders: Collection[str] | None = None) -> str:
    """Return the HTML of a worksheet, without its title and its pictures, which the page has.

    Raw HTML is shown, not obeyed; formulas are MathML. Links to worksheets and to the explanation
    become links to pages. With `folders`, those of the lessons that are there, a link to another
    one leads nowhere: its words stay.
    """
    read = parser()
    worksheet = SyntaxTreeNode(read.parse(markdown))
    worksheet.children = [
        part for part in worksheet.children if part.tag != "h1" and not _elsewhere(part)
    ]
    for link in worksheet.walk():
        if link.type == "link":
            for file, page in _ADDRESSES:
                link.attrs["href"] = re.sub(file, page, str(link.attrs["href"]))
            other = re.match(r"\.\./([^/]+)/", str(link.attrs["href"]))
            if other and folders is not None and other[1] not in folders:
                del link.attrs["href"]
    made = str(read.renderer.render(worksheet.to_tokens(), read.options, {}))
    # What is too wide for a phone scrolls by itself, and with the keyboard.
    return re.sub("<(pre|table)>", r'<\1 tabindex="0">', made)


def _elsewhere(part: SyntaxTreeNode) -> bool:
    """Tell whether a paragraph is a picture that the page shows elsewhere, or is not to show."""
    inside = [one for line in part.children for one in line.children]
    if part.type != "paragraph" or [one.type for one in inside] != ["image"]:
        return False
    name = str(inside[0].attrs["src"])
    return name == "machine.png" or not re.fullmatch(r"[\w-]+\.png", name)


def plain_of(markdown: str) -> str:
    r"""Return a text for a terminal, which shows no pictures, under a title of its own.

    >>> plain_of("# Title\n\n![x](x.gif)\n\nSee [it](it.ipynb), [doi](https://doi.org/1).\n")
    'See it, [doi](https://doi.org/1).\n'
    """
    text = re.sub(r"\A# .*\n+|^!\[[^\]]*\]\([^)]*\)\n+", "", markdown, flags=re.MULTILINE)
    text = re.sub(r"(?<!!)\[([^\]]+)\]\((?!https?:)[^)]*\)", r"\1", text)
    return without_tex(text)


def own_words(worksheet: str) -> str:
    r"""Return what a worksheet asks to be answered in words, "" if nothing.

    That is its last paragraph that begins in bold and ends with a question mark.

    >>> own_words("Look.\n\n**In your own words.** What grows,\nand why?\n\n## Afterwards")
    'What grows, and why?'
    """
    paragraphs = re.split(r"\n{2,}", worksheet.strip())
    asked = [re.fullmatch(r"\*\*[^*]+\*\* (.*\?)", one, re.DOTALL) for one in paragraphs]
    found = [one[1] for one in asked if one]
    return without_tex(" ".join(found[-1].split())) if found else ""


def without_tex(markdown: str) -> str:
    r"""Return a text whose formulas are written with plain characters.

    >>> without_tex(r"It costs $5. $v_2' = v_0 \sqrt{1 - \varepsilon^2}$, `$x`, $\frac{1}{2} v_x$")
    "It costs $5. v2' = v0 √(1 - ε²), `$x`, ½ v_x"
    """

    def written(found: re.Match[str]) -> str:
        code, display, inline = found.groups()
        return str(code) if code else plain(parsed(display or inline))

    return _FORMULA.sub(written, markdown)


def words_for(picture: str, markdown: str) -> str | None:
    """Return the words that stand for a picture in a text, None if it is not in there."""
    for node in SyntaxTreeNode(parser().parse(markdown)).walk():
        if node.type == "image" and node.attrs["src"] == picture:
            return node.content
    return None
