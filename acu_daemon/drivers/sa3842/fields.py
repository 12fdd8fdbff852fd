"""Fields of the wire's data: upper-case hex and status nibbles (docs/protocol.md, Encodings)."""

HEX_DIGITS = frozenset("0123456789ABCDEF")


class FieldError(ValueError):
    """A field does not read as docs/protocol.md says."""


def hex_text(code: int, digit_count: int) -> str:
    """Write a code, modulo its width, as upper-case hex."""
    return f"{code % 16**digit_count:0{digit_count}X}"


def hex_value(text: str) -> int:
    """Read upper-case hex.  FieldError: anything else."""
    if not text or not HEX_DIGITS.issuperset(text):
        raise FieldError(f"{text!r} is not upper-case hex")
    return int(text, 16)


def nibbles_text(*nibbles: int) -> str:
    """Write four-bit values as the characters 30h-3Fh."""
    return "".join(chr(0x30 | nibble & 0xF) for nibble in nibbles)


def nibble_values(text: str) -> list[int]:
    """Read the characters 30h-3Fh as four-bit values.  FieldError: anything else."""
    if any(ord(character) >> 4 != 3 for character in text):
        raise FieldError(f"{text!r} is not made of the characters 30h-3Fh")
    return [ord(character) & 0xF for character in text]


def bits_value(*bits: bool) -> int:
    """Pack bits, lowest first."""
    return sum(bit << place for place, bit in enumerate(bits))
