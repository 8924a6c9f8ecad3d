"""Names in the charts stand beside what they name: a browser alone knows where it writes."""

from __future__ import annotations

from typing import Any

from tests.late import VESSEL
from tests.workbench.web.browsing import NEEDS_BROWSER, Server, opened

pytestmark = NEEDS_BROWSER

#: Keeps what a chart writes, and how it is aligned.
LISTENING = """
window.written = [];
const fill = CanvasRenderingContext2D.prototype.fillText;
CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
  window.written.push([text, this.textAlign, x, this.measureText(text).width, this.canvas.width]);
  return fill.call(this, text, x, y);
};
"""


def test_names_in_a_chart_begin_at_what_they_name_and_stay_within_it(browser: Any, server: Server):
    tab = opened(browser, server, viewport={"width": 390, "height": 900})
    tab.add_init_script(LISTENING)
    tab.goto(server.start)
    log = server.json(f"/v/{VESSEL}/logs.json")[0]["log_id"]
    first, *_, last = server.json(f"/v/{VESSEL}/segments.json")
    for at, text in ((first["end"], "docked, hull cleaned"), (last["end"], "rudder bearing renewed")):
        tab.request.post(
            server.base + "/notes", form={"log": log, "text": text, "at": at}, headers={"origin": server.base}
        )
    tab.goto(server.base + f"/logs/{log}?at={first['start']}&at2={last['start']}")
    tab.wait_for_selector("body[data-ready=yes]")
    written = tab.evaluate("window.written")
    named = [
        one
        for one in written
        if one[0] in ("A", "B") or one[0].startswith(("docked", "rudder bear")) or "zigzag" in one[0]
    ]
    assert {one[0] for one in named} >= {"A", "B", "docked, hull cleaned", "rudder bearing renewed"}
    assert sum("zigzag" in one[0] for one in named) >= 1
    for text, align, x, wide, canvas in named:
        assert align == "left" and x >= 0.0 and x + wide <= canvas, text
    assert server.complaints == []
