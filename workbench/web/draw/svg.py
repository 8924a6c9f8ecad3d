"""Elements of SVG, every text and attribute escaped."""

from __future__ import annotations

from markupsafe import Markup, escape

#: width up to which a figure is legible on a phone
_NARROW = 420.0


def element(name: str, *inside: Markup | str, **attributes: object) -> Markup:
    """Return an element; an underscore in a name is a hyphen, and one at its end is left out.

    Examples
    --------
    >>> element("text", "a < b", x=1, text_anchor="end")
    Markup('<text x="1" text-anchor="end">a &lt; b</text>')
    """
    text = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{escape(_short(value))}"'
        for key, value in attributes.items()
        if value is not None
    )
    return Markup(f"<{name}{text}>") + Markup("").join(escape(part) for part in inside) + Markup(f"</{name}>")  # noqa: S704


def drawing(width: float, height: float, title: str, *inside: Markup, role: str = "img", kind: str = "") -> Markup:
    """Return a whole figure with what it is called when it is read aloud; one that holds links is a ``group``.

    One whose letters would be too small on a phone is wide: there it scrolls within itself. Of another ``kind``, such
    as a map, it is drawn whole.
    """
    wide = "wide" if width > _NARROW else ""
    figure = element(
        "svg",
        element("title", title),
        *inside,
        viewBox=f"0 0 {_short(width)} {_short(height)}",
        role=role,
        class_=f"drawing {kind or wide}".rstrip(),
        xmlns="http://www.w3.org/2000/svg",
    )
    return element("div", figure, class_="scroll", tabindex=0)


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
