"""Elements of SVG, every text and attribute escaped."""

from __future__ import annotations

from markupsafe import Markup, escape


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


def drawing(width: float, height: float, title: str, *inside: Markup, role: str = "img") -> Markup:
    """Return a whole figure with what it is called when it is read aloud; one that holds links is a ``group``."""
    return element(
        "svg",
        element("title", title),
        *inside,
        viewBox=f"0 0 {_short(width)} {_short(height)}",
        role=role,
        class_="drawing",
        xmlns="http://www.w3.org/2000/svg",
    )


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
