"""Seeded damage to a file: bits, bytes and blocks, and of texts numbers, words and lines."""

import re

import numpy as np

NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
NUMBERS = (
    b"0", b"-1", b"1e300", b"-1e300", b"nan", b"inf", b"-inf", b"9e11", b"1e-300", b"99999999999999999999",
    b"1e999", b"0x10", b"1,5", b"", b"true", b"[1, 2]", b"!!float ''", b"!!int x", b"0.0000001", b"123456",
)  # fmt: skip
JUNK = (
    b"\x00", b"\xff\xfe", b"\n", b"\t", b" ", b"<", b">", b"{", b"}", b"[", b"]", b":", b"*a", b"&a ",
    b"%s", b'"', b"'", b"..", b"/", b"\xc3\xa9", b"null", b"~", b"- ", b"!!timestamp x ",
    b"<!DOCTYPE x [<!ENTITY a 'b'>]>",
)  # fmt: skip


def mutated(whole: bytes, rng: np.random.Generator, *, text: bool) -> bytes:
    """The content with one to four damages."""
    content = bytearray(whole)
    for _ in range(int(rng.integers(1, 5))):
        kinds = (_bits, _byte, _cut, _double, _zeros, *((_number, _number, _junk, _line) if text else ()))
        content = bytearray(kinds[int(rng.integers(len(kinds)))](bytes(content), rng)) or bytearray(b" ")
    return bytes(content)


def _place(content: bytes, rng: np.random.Generator) -> int:
    return int(rng.integers(len(content)))


def _bits(content: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(content)
    for _ in range(int(rng.integers(1, 9))):
        changed[_place(content, rng)] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def _byte(content: bytes, rng: np.random.Generator) -> bytes:
    place = _place(content, rng)
    return content[:place] + bytes([int(rng.integers(256))]) + content[place + 1 :]


def _cut(content: bytes, rng: np.random.Generator) -> bytes:
    first, last = sorted((_place(content, rng), _place(content, rng)))
    return content[:first] if rng.random() < 0.5 else content[:first] + content[last:]


def _double(content: bytes, rng: np.random.Generator) -> bytes:
    first, last = sorted((_place(content, rng), _place(content, rng)))
    return content[:last] + content[first:last] + content[last:]


def _zeros(content: bytes, rng: np.random.Generator) -> bytes:
    place, count = _place(content, rng), int(rng.integers(1, 65))
    filled = (b"\x00", b"\xff")[int(rng.integers(2))] * count
    return content[:place] + filled + content[place + count :]


def _number(content: bytes, rng: np.random.Generator) -> bytes:
    found = list(NUMBER.finditer(content))
    if not found:
        return content
    match = found[int(rng.integers(len(found)))]
    return content[: match.start()] + NUMBERS[int(rng.integers(len(NUMBERS)))] + content[match.end() :]


def _junk(content: bytes, rng: np.random.Generator) -> bytes:
    place = _place(content, rng)
    return content[:place] + JUNK[int(rng.integers(len(JUNK)))] + content[place:]


def _line(content: bytes, rng: np.random.Generator) -> bytes:
    lines = content.split(b"\n")
    first, second = (int(rng.integers(len(lines))) for _ in range(2))
    kind = int(rng.integers(3))
    if kind == 0:
        lines[first], lines[second] = lines[second], lines[first]
    elif kind == 1:
        del lines[first]
    else:
        lines.insert(second, lines[first])
    return b"\n".join(lines)
