"""How messages are encoded: the Common Data Representation (OMG CDR, version 1), which all middlewares of ROS 2 send.

A head of four bytes, then the fields in their order, each aligned to its size, counted from behind the head; a text or
a list is its length and its elements.
"""

from __future__ import annotations

from struct import Struct

HEAD = 4  # bytes
LITTLE_ENDIAN = b'\x00\x01'  # first half of the head; the other half holds options, which are ignored
STAMP = Struct('<iI')
