"""Damage that files get: bytes that are lost, doubled, changed, moved; lines, too."""

import numpy as np

# Bytes that mean something in many formats, and some that mean nothing in any.
SPECIAL = b"\x00\xff\xb5 ,;:=#[]{}\"'-+.eE/*\n\r\t9naninf"


def mutated(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a content with one to three damages at random."""
    for _ in range(rng.integers(1, 4)):
        content = _DAMAGES[rng.integers(len(_DAMAGES))](content, rng)
    return content


def _cut_off(content: bytes, rng: np.random.Generator) -> bytes:
    return content[: rng.integers(len(content) + 1)]


def _changed(content: bytes, rng: np.random.Generator) -> bytes:
    place = rng.integers(len(content) + 1)
    return content[:place] + _special(rng) + content[place + 1 :]


def _put_in(content: bytes, rng: np.random.Generator) -> bytes:
    place = rng.integers(len(content) + 1)
    return content[:place] + _special(rng) * rng.integers(1, 30) + content[place:]


def _left_out(content: bytes, rng: np.random.Generator) -> bytes:
    place = rng.integers(len(content) + 1)
    return content[:place] + content[place + rng.integers(1, 60) :]


def _lines_changed(content: bytes, rng: np.random.Generator) -> bytes:
    lines = content.split(b"\n")
    one, other = rng.integers(len(lines), size=2)
    if rng.random() < 0.3:
        del lines[one]
    elif rng.random() < 0.5:
        lines.insert(one, lines[other])
    else:
        lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


def _number_changed(content: bytes, rng: np.random.Generator) -> bytes:
    digits = [i for i, byte in enumerate(content) if chr(byte).isdigit()]
    if not digits:
        return content
    place = digits[rng.integers(len(digits))]
    numbers = (b"nan", b"inf", b"1e999", b"-", b"", b"0", b"99999999", b"1e-320")
    return content[:place] + numbers[rng.integers(len(numbers))] + content[place + 1 :]


def _special(rng: np.random.Generator) -> bytes:
    return SPECIAL[(place := rng.integers(len(SPECIAL))) : place + 1]


_DAMAGES = (_cut_off, _changed, _put_in, _left_out, _lines_changed, _number_changed)
