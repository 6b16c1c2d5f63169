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


FACTORS = (-1.0, 0.0, 0.001, 0.01, 0.5, 0.9, 1.1, 2.0, 100.0, 1000.0)


def mutated(whole: bytes, rng: np.random.Generator, *, text: bool, gentle: bool = False) -> bytes:
    """The content with one to four damages; gentle ones leave most files such that they can be read."""
    content = bytearray(whole)
    for _ in range(int(rng.integers(1, 5))):
        kinds = (_bits, _byte, _cut, _double, _zeros, *((_number, _number, _junk, _line) if text else ()))
        if gentle:
            kinds = (_scaled, _scaled, _exchanged) if text else (_scaled_word, _scaled_word, _bits)
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


def _scaled(content: bytes, rng: np.random.Generator) -> bytes:
    """A number, and at times that many lines below it as well, times a factor."""
    lines = content.split(b"\n")
    with_numbers = [number for number, line in enumerate(lines) if NUMBER.search(line)]
    if not with_numbers:
        return content
    first = with_numbers[int(rng.integers(len(with_numbers)))]
    place, factor = float(rng.random()), FACTORS[int(rng.integers(len(FACTORS)))]
    for number in range(first, min(first + int(rng.choice([1, 1, 5, 40])), len(lines))):
        if found := list(NUMBER.finditer(lines[number])):
            match = found[int(place * len(found))]
            written = b"%g" % (factor * float(match[0]))
            lines[number] = lines[number][: match.start()] + written + lines[number][match.end() :]
    return b"\n".join(lines)


def _exchanged(content: bytes, rng: np.random.Generator) -> bytes:
    """Two numbers in each other's place."""
    found = list(NUMBER.finditer(content))
    if len(found) < 2:
        return content
    first, second = (found[number] for number in sorted(rng.choice(len(found), 2, replace=False)))
    between = content[first.end() : second.start()]
    return content[: first.start()] + second[0] + between + first[0] + content[second.end() :]


def _scaled_word(content: bytes, rng: np.random.Generator) -> bytes:
    """A float of four bytes times a factor."""
    words = np.frombuffer(content[: len(content) // 4 * 4], np.float32).copy()
    factor, place = FACTORS[int(rng.integers(len(FACTORS)))], int(rng.integers(len(words)))
    with np.errstate(over="ignore", invalid="ignore"):
        words[place] *= np.float32(factor)
    return words.tobytes() + content[len(content) // 4 * 4 :]


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
