"""YAML that a person wrote, read strictly: one document, every key once, little nesting, aliases of few values.

YAML takes the last of two equal keys of a mapping without a word, and a few hundred bytes of nested aliases can stand
for billions of values; a file that a person wrote means neither.
"""

from __future__ import annotations

from typing import Any

import yaml

#: Keys and values in a file that a person wrote, aliases written out.
MOST_VALUES = 100_000

#: Brackets and indents within each other; a profile and an effect have three or four.
DEEPEST = 32

#: libyaml's, ten times as fast, where PyYAML was built with it
_Safe: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class NotYaml(ValueError):
    """A text that is not read as YAML; the message names the reason and the line."""


class TooLarge(NotYaml):
    """A text whose aliases stand for more than `MOST_VALUES` keys and values."""


def load(text: str | bytes) -> Any:
    """Return what a YAML text says.

    Returns
    -------
    object
        None for an empty text.

    Raises
    ------
    NotYaml
        It is no YAML of one document, has a key twice or is nested deeper than `DEEPEST`.
    TooLarge
    """
    try:
        _require_flat(text)
        loader = _Safe(text)
        root = loader.get_single_node()
        if root is None:
            return None
        if _written_out(root, {}) > MOST_VALUES:
            raise TooLarge(f"it stands for more than {MOST_VALUES} keys and values once its aliases are written out")
        _require_unique_keys(root)
        return loader.construct_document(root)
    except NotYaml:
        raise
    except (yaml.YAMLError, ValueError, LookupError, AttributeError, OverflowError, TypeError) as error:
        raise NotYaml(" ".join(str(error).split())) from error
    except RecursionError as error:
        raise NotYaml("it is nested too deep to be read") from error


def _require_flat(text: str | bytes) -> None:
    """Refuse deep nesting where it begins, before anything is built of it."""
    depth = 0
    for event in yaml.parse(text, Loader=_Safe):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST:
            raise NotYaml(f"nested deeper than {DEEPEST} brackets {' '.join(str(event.start_mark).split())}")


def _written_out(node: yaml.Node, counts: dict[int, int]) -> int:
    """Return how many keys and values a node stands for, each alias counted as what it stands for."""
    if id(node) not in counts:
        counts[id(node)] = MOST_VALUES + 1  # what a node counts for that holds itself
        counts[id(node)] = 1 + sum(_written_out(item, counts) for item in _below(node))
    return counts[id(node)]


def _below(node: yaml.Node) -> list[yaml.Node]:
    if isinstance(node, yaml.MappingNode):
        return [item for pair in node.value for item in pair]
    return list(node.value) if isinstance(node, yaml.SequenceNode) else []


def _require_unique_keys(root: yaml.Node) -> None:
    """Refuse a document in which a mapping has a key twice, naming the key and both lines."""
    waiting, seen = [root], set()
    while waiting:
        node = waiting.pop()
        if id(node) in seen:  # an alias is the very node that it stands for
            continue
        seen.add(id(node))
        waiting += _below(node)
        if isinstance(node, yaml.MappingNode):
            lines: dict[tuple[str, str], int] = {}
            for key, _ in node.value:
                line, name = key.start_mark.line + 1, (key.tag, str(key.value))
                if isinstance(key, yaml.ScalarNode) and name in lines:
                    raise NotYaml(f"{key.value!r} is written twice, in lines {lines[name]} and {line}")
                lines[name] = line
