"""YAML takes the last of two equal keys of a mapping without a word; a file that a person wrote means one of them."""

from __future__ import annotations

import yaml


def require_unique_keys(node: yaml.Node | None) -> None:
    """Refuse a document in which a mapping has a key twice.

    Parameters
    ----------
    node : yaml.Node or None
        Root of the document, as composed; None for an empty one.

    Raises
    ------
    ValueError
        It names the key and both lines.
    """
    waiting, seen = [node], set()
    while waiting:
        one = waiting.pop()
        if one is None or id(one) in seen:  # an alias is the very node that it stands for
            continue
        seen.add(id(one))
        if isinstance(one, yaml.SequenceNode):
            waiting += one.value
        if isinstance(one, yaml.MappingNode):
            lines: dict[tuple[str, str], int] = {}
            for key, value in one.value:
                line, name = key.start_mark.line + 1, (key.tag, str(key.value))
                if isinstance(key, yaml.ScalarNode) and name in lines:
                    raise ValueError(f"{key.value!r} is written twice, in lines {lines[name]} and {line}")
                lines[name] = line
                waiting += [key, value]
