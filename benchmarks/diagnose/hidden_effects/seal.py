"""The sealed answers: compressed and enciphered with a key that lies elsewhere, and checked when they are opened.

A stream cipher of SHA-256 in counter mode and an HMAC: enough that no program reads an answer by accident, which is all
that is needed.
"""

from __future__ import annotations

import hashlib
import hmac
import json
import zlib
from typing import Any

from kempf.schemas.errors import DataRejected

_MAC = 32


def seal(answers: dict[str, Any], key: bytes) -> bytes:
    """Return the answers, sealed with ``key``.

    Examples
    --------
    >>> open_sealed(seal({"a": 1}, b"k"), b"k")
    {'a': 1}
    """
    text = json.dumps(answers, sort_keys=True, separators=(",", ":")).encode()
    body = _cipher(zlib.compress(text, 9), key)
    return hmac.digest(key, body, "sha256") + body


def open_sealed(data: bytes, key: bytes) -> dict[str, Any]:
    """Return the answers.

    Raises
    ------
    DataRejected
        The key is another one, or the file was changed.
    """
    mac, body = data[:_MAC], data[_MAC:]
    if not hmac.compare_digest(mac, hmac.digest(key, body, "sha256")):
        raise DataRejected(
            "seal_broken",
            "The sealed answers do not fit the key: another key, or a changed file.",
            "Give the key file that was written with them.",
        )
    found: dict[str, Any] = json.loads(zlib.decompress(_cipher(body, key)))
    return found


def _cipher(data: bytes, key: bytes) -> bytes:
    blocks = -(-len(data) // 32)
    stream = b"".join(hashlib.sha256(key + k.to_bytes(8, "big")).digest() for k in range(blocks))
    return bytes(a ^ b for a, b in zip(data, stream, strict=False))
