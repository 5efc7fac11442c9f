"""What a picture was made from, kept in a comment of the GIF itself: no further file to lose."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Self

HEAD: Final = "chutelab lesson"
TRAILER: Final = b"\x3b"
"""Last byte of every GIF."""

_COMMENT: Final = b"\x21\xfe"
"""Begin of a comment extension; sub-blocks of at most 255 bytes follow, then an empty one."""

_FORM: Final = re.compile(rf"{HEAD}; inputs ([0-9a-f]{{32}}); (.+)")


@dataclass(frozen=True)
class Stamp:
    """What determines every byte of a picture.

    Parameters
    ----------
    inputs : str
        Hash of the validated scene and the picture's settings, 32 hexadecimal digits.
    versions : str
        Of chutelab and of the libraries that simulate and draw, ``name version`` with commas.
    """

    inputs: str
    versions: str

    @property
    def block(self) -> bytes:
        """The comment extension that holds it."""
        text = f"{HEAD}; inputs {self.inputs}; {self.versions}".encode("ascii", "replace")[:255]
        return _COMMENT + bytes([len(text)]) + text + b"\0"

    def on(self, gif: bytes) -> bytes:
        """Return a GIF with the stamp as its last block.

        Raises
        ------
        ValueError
            If the bytes are no GIF.
        """
        if not gif.startswith(b"GIF8") or not gif.endswith(TRAILER):
            raise ValueError("only a GIF can be stamped")
        return gif[:-1] + self.block + TRAILER

    @classmethod
    def of(cls, gif: bytes) -> Self | None:
        """Return the stamp that ends a GIF; None if there is none, or something else there."""
        begin = gif.rfind(_COMMENT, max(0, len(gif) - 300))
        if begin < 0 or gif[-2:] != b"\0" + TRAILER:
            return None
        text = gif[begin + 3 : -2].decode("ascii", "replace")
        match = _FORM.fullmatch(text)
        return cls(match[1], match[2]) if match else None
