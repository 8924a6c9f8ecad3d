"use strict";
// Linked charts: one window and one cursor for all panels. On a page the window is in the address and the series come from
// there; in a report they are in the file, see `.frame`.
(() => {
  const SHIP = { "rad": [180 / Math.PI, "deg"], "rad/s": [180 / Math.PI, "deg/s"], "m/s": [3600 / 1852, "kn"], "1/s": [60, "rpm"] };
  const SMALLEST_S = 0.05;
  // room above the first panel, where the manoeuvres have their names
  const NAMES = 18;
  const colour = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const seconds = iso => Date.parse(iso) / 1000;
  // to the millisecond: an address is read by people
  const iso = s => new Date(Math.round(s * 1000)).toISOString();
  const short = v => v === null || v === undefined ? "-" : Number(v.toPrecision(5)).toString();

  function decoded(buffer) {
    const bytes = new Uint8Array(buffer), end = bytes.indexOf(10);
    const head = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
    let at = end + 1;
    // nanoseconds do not fit into a number: milliseconds of them do
    const origin = Number(BigInt(head.from_utc_ns) / 1000n) / 1e6;
    for (const one of head.series) {
      const t = new Float32Array(buffer, at, one.count), v = new Float32Array(buffer, at + 4 * one.count, one.count);
      at += 8 * one.count;
      [one.panel, one.kind = "measured"] = one.name.split(":");
      one.x = Array.from(t, s => origin + s);
      one.y = Array.from(v, value => Number.isNaN(value) ? null : value);
    }
    return head.series;
  }

  const isCompass = name => /heading|course/.test(name);
  const TURNS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 45, 90, 180, 360, 720, 3600, 36_000, 360_000];
  const named = one => one.panel.replaceAll("_", " ") + (one.kind === "measured" ? "" : `, ${one.kind}`);

  // measured is dots where something is predicted beside it, as in every figure
  function style(one, beside) {
    if (one.kind === "before") return { stroke: colour("--plain"), width: 1.5, dash: [6, 3], points: { show: false } };
    if (one.kind !== "measured") return { stroke: colour("--full"), width: 1.75, points: { show: false } };
    if (beside) return { stroke: colour("--ink"), paths: () => null, points: { show: true, size: 3, width: 0, fill: colour("--ink") } };
    return { stroke: colour("--full"), width: 1.25, points: { show: one.total <= 60 } };
  }

  // what is predicted of an angle lies within the same turn as what was measured
  function turned(series) {
    for (const one of series) {
      const first = values => values.find(v => v !== null), beside = series.find(other => other.panel === one.panel && other.kind === "measured");
      if (!isCompass(one.panel) || one.kind === "measured" || !beside || first(one.y) === undefined || first(beside.y) === undefined) continue;
      const by = 2 * Math.PI * Math.round((first(one.y) - first(beside.y)) / (2 * Math.PI));
      if (by) one.y = one.y.map(v => v === null ? null : v - by);
    }
    return series;
  }

  // words first: series are asked for once the page is painted, or will not say that it was
  const painted = new Promise(done => {
    setTimeout(done, document.hidden || !PerformanceObserver.supportedEntryTypes.includes("paint") ? 0 : 4000);
    new PerformanceObserver(seen => { if (seen.getEntriesByName("first-contentful-paint").length) done(); }).observe({ type: "paint", buffered: true });
  });

  async function frame(address) {
    await painted;
    const answer = await fetch(address);
    if (!answer.ok) throw new Error((await answer.json()).error.message);
    return decoded(await answer.arrayBuffer());
  }

  class Chart {
    constructor(node, number) {
      this.node = node;
      this.number = number;
      const frame = node.querySelector(".frame");
      this.held = frame ? turned(decoded(Uint8Array.from(atob(frame.textContent.trim()), c => c.charCodeAt(0)).buffer)) : null;
      this.panels = node.querySelector(".panels");
      this.state = node.querySelector(".state");
      this.readout = node.querySelector(".readout");
      this.whole = [seconds(node.dataset.first), seconds(node.dataset.last)];
      this.span = [seconds(node.dataset.from), seconds(node.dataset.to)];
      this.plots = [];
      this.series = [];
      this.asked = 0;
      this.spans = Array.from(node.querySelectorAll(".spans li"), li => ({
        kind: li.dataset.kind, from: seconds(li.dataset.from), to: seconds(li.dataset.to), words: li.textContent,
        executes: li.dataset.executes ? li.dataset.executes.split(" ").map(seconds) : [],
      }));
      this.boxes = Array.from(node.querySelectorAll("input[name=ch]"));
      this.at = [null, null];
      if (!this.held) this.fromAddress();
      for (const box of this.boxes) box.addEventListener("change", () => this.moved());
      for (const form of document.querySelectorAll("form[data-window]")) {
        form.querySelector("[data-take]").addEventListener("click", () => { form.elements.from.value = iso(this.span[0]); form.elements.to.value = iso(this.span[1]); });
      }
      for (const button of node.querySelectorAll("button[data-do]")) button.addEventListener("click", () => { const far = button.dataset.shift === "yes"; button.dataset.shift = ""; this.do(button.dataset.do, far); });
      if (!this.held) addEventListener("popstate", () => { this.fromAddress(); this.load(); });
      this.width = this.panels.clientWidth;
      new ResizeObserver(() => {
        if (this.panels.clientWidth !== this.width) { this.width = this.panels.clientWidth; this.draw(); }
      }).observe(this.panels);
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
      this.load();
    }

    fromAddress() {
      const asked = new URLSearchParams(location.search);
      this.span = [asked.get("from") ? seconds(asked.get("from")) : seconds(this.node.dataset.from), asked.get("to") ? seconds(asked.get("to")) : seconds(this.node.dataset.to)];
      if (asked.has("ch")) {
        const wanted = asked.get("ch").split(",");
        for (const box of this.boxes) box.checked = wanted.includes(box.value);
      }
      this.si = asked.get("units") === "si";
      this.at = ["at", "at2"].map(name => asked.get(name) ? seconds(asked.get(name)) : null);
    }

    moved(replace = false) {
      if (this.held) { this.load(); return; }
      const asked = new URLSearchParams(location.search);
      asked.set("from", iso(this.span[0]));
      asked.set("to", iso(this.span[1]));
      asked.set("ch", this.channels().join(","));
      if (this.si) asked.set("units", "si"); else asked.delete("units");
      ["at", "at2"].forEach((name, k) => { if (this.at[k] === null) asked.delete(name); else asked.set(name, iso(this.at[k])); });
      history[replace ? "replaceState" : "pushState"](null, "", "?" + asked.toString().replaceAll("%2C", ",").replaceAll("%3A", ":"));
      this.load();
    }

    channels() { return this.boxes.filter(box => box.checked).map(box => box.value); }

    async load() {
      const number = ++this.asked, channels = this.channels();
      if (this.held) { this.series = this.held.filter(one => channels.includes(one.panel)); this.draw(); return; }
      if (channels.length === 0) { this.series = []; this.draw(); return; }
      const window = { from: iso(this.span[0]), to: iso(this.span[1]), bins: String(Math.min(1500, Math.max(100, this.panels.clientWidth))) };
      const logged = this.boxes.filter(box => box.checked && !box.dataset.derived).map(box => box.value), asked = [];
      if (logged.length) asked.push(`/logs/${this.node.dataset.log}/series?${new URLSearchParams({ ch: logged.join(","), ...window })}`);
      if (this.node.dataset.predicted) asked.push(`${this.node.dataset.predicted}&${new URLSearchParams(window)}`);
      document.body.removeAttribute("data-ready");
      try {
        const found = await Promise.all(asked.map(frame));
        if (number !== this.asked) return;
        this.series = turned(channels.flatMap(name => found.flat().filter(one => one.panel === name)));
        this.draw();
      } catch (error) {
        if (number === this.asked) { this.state.textContent = `The channels cannot be shown: ${error.message}`; document.body.dataset.ready = "error"; }
      }
    }

    unit(name) {
      const unit = this.boxes.find(box => box.value === name).dataset.unit;
      return this.si ? [1, unit] : SHIP[unit] || [1, unit];
    }

    // a line goes on through north; a person reads a heading of 500 deg as 140
    reading(name) {
      const turned = v => { const shown = Number(v.toPrecision(5)); return short(shown - 360 * Math.floor(shown / 360)); };
      return v => this.inTurns(name) && v !== null && v !== undefined ? turned(v) : short(v);
    }

    inTurns(name) { return isCompass(name) && this.unit(name)[1] === "deg"; }

    sign(name) {
      const sign = this.boxes.find(box => box.value === name).dataset.sign;
      return sign ? ` (${sign})` : "";
    }

    draw() {
      for (const plot of this.plots) plot.destroy();
      this.plots = [];
      this.panels.replaceChildren();
      const panels = this.boxes.map(box => this.series.filter(one => one.panel === box.value)).filter(found => found.length);
      panels.forEach((found, k) => this.panel(found, k === 0, k === panels.length - 1));
      const reduced = this.series.filter(one => one.total >= 1.5 * one.drawn).map(one => `1 of ${Math.round(one.total / one.drawn)} of ${named(one)}`);
      this.state.textContent = `${iso(this.span[0]).replace("T", " ")} to ${iso(this.span[1]).slice(11)}: ${panels.length} channels` + (reduced.length ? `; shown: ${reduced.join(", ")} (smallest and largest of each stretch)` : "");
      this.node.querySelector("[data-do=units]").textContent = this.si ? "Units: SI" : "Units: deg, kn";
      if (!this.readout.hidden && this.readout.hasChildNodes()) this.table();
      document.body.dataset.ready = "yes";
    }

    panel(found, top, last) {
      const [factor, unit] = this.unit(found[0].panel), words = found[0].panel.replaceAll("_", " "), label = (unit === "1" ? words : `${words}, ${unit}`) + this.sign(found[0].panel);
      const y = found.map(one => one.y.map(v => v === null ? null : v * factor)), known = y.flat().filter(v => v !== null), total = found.reduce((sum, one) => sum + one.total, 0);
      const reading = this.reading(found[0].panel);
      const holder = document.createElement("div");
      holder.className = "panel";
      holder.tabIndex = 0;
      holder.setAttribute("role", "img");
      const kinds = found.length > 1 ? ` (${found.map(one => one.kind).join(", ")})` : "";
      holder.setAttribute("aria-label", known.length ? `${label}${kinds}: from ${short(Math.min(...known))} to ${short(Math.max(...known))}, ${total} values` : `${label}: no values here`);
      this.panels.append(holder);
      const ink = colour("--ink"), faint = colour("--line");
      const axis = { stroke: ink, grid: { stroke: faint, width: 1 }, ticks: { stroke: faint, width: 1 }, font: "12px system-ui, sans-serif" };
      const clock = (u, splits, _, __, step) => splits.map(s => iso(s).slice(11, step < 1 ? 22 : step < 60 ? 19 : 16));
      const time = last ? { ...axis, values: clock, space: 80 } : { ...axis, values: (u, splits) => splits.map(() => ""), size: 8, space: 80 };
      const drawn = found.map(one => ({ label: found.length > 1 ? `${label}, ${one.kind}` : label, value: (_, v) => reading(v), ...style(one, found.length > 1) }));
      const level = this.inTurns(found[0].panel) ? { values: (u, splits) => splits.map(reading), incrs: TURNS, space: 20 } : {};
      const plot = new uPlot({
        width: Math.max(200, this.panels.clientWidth), height: (last ? 150 : 124) + (top ? NAMES : 0), padding: [top ? NAMES : null, null, null, null], tzDate: s => uPlot.tzDate(new Date(s * 1000), "Etc/UTC"),
        scales: { x: { time: true, range: () => this.span } },
        axes: [time, { ...axis, size: 64, space: 24, ...level }],
        series: [{ label: "UTC", value: (_, s) => s === null || s === undefined ? "-" : iso(s).slice(11, 23) }, ...drawn],
        cursor: { sync: { key: `chart ${this.number}` }, drag: { x: true, y: false, setScale: false }, bind: { dblclick: () => () => this.do("all") } },
        hooks: {
          setSelect: [u => { if (u.select.width > 3) this.zoom(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x")); }],
          drawClear: [u => this.shade(u)],
          draw: [u => this.mark(u)],
        },
      // gaps (null) stay gaps; where only the other series has an instant, a line goes on
      }, found.length > 1 ? uPlot.join(found.map((one, k) => [one.x, y[k]]), found.map(() => [0, 2])) : [found[0].x, y[0]], holder);
      plot.over.addEventListener("wheel", event => {
        event.preventDefault();
        const at = plot.posToVal(event.offsetX, "x"), by = event.deltaY < 0 ? 0.8 : 1.25;
        this.span = [at - (at - this.span[0]) * by, at + (this.span[1] - at) * by];
        this.clip();
        for (const other of this.plots) other.setScale("x", { min: this.span[0], max: this.span[1] });
        clearTimeout(this.later);
        this.later = setTimeout(() => this.moved(true), 150);
      }, { passive: false });
      this.plots.push(plot);
    }

    // calls with what a panel is drawn on, clipped to it
    inside(u, draw) {
      const context = u.ctx, { left, top, width, height } = u.bbox;
      context.save();
      context.beginPath();
      context.rect(left, top, width, height);
      context.clip();
      this.letters(context);
      draw(context, left, top, width, height, this.first(u));
      context.restore();
    }

    first(u) { return u === this.plots[0] || this.plots.length === 0; }

    // uPlot leaves the alignment of its axes behind
    letters(context) {
      context.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
      context.textAlign = "left";
      context.textBaseline = "alphabetic";
      context.fillStyle = colour("--ink");
    }

    // above the first panel, where no trace is: a name whole, else its first word, else none; none over the next one
    names(u) {
      const context = u.ctx, { left, top, width } = u.bbox, room = 4 * devicePixelRatio;
      const shown = this.spans.filter(span => span.kind !== "note").map(one => ({
        words: one.words, from: Math.max(left, u.valToPos(one.from, "x", true)), to: Math.min(left + width, u.valToPos(one.to, "x", true)),
      })).filter(one => one.to > one.from).sort((a, b) => a.from - b.from);
      context.save();
      this.letters(context);
      shown.forEach((one, k) => {
        const end = Math.max(one.to, k + 1 < shown.length ? shown[k + 1].from - room : left + width);
        const words = [one.words, one.words.split(" ")[0]].find(some => one.from + context.measureText(some).width <= end);
        if (words) context.fillText(words, one.from, top - 5 * devicePixelRatio);
      });
      context.restore();
    }

    // behind the channels: manoeuvres, and what of the log is lost
    shade(u) {
      if (this.first(u)) this.names(u);
      this.inside(u, (context, left, top, width, height) => {
        for (const one of this.spans.filter(span => span.kind !== "note")) {
          const a = u.valToPos(one.from, "x", true), b = u.valToPos(one.to, "x", true);
          if (a > left + width || b < left) continue;
          context.setLineDash([]);
          if (one.kind === "lost") this.hatch(context, Math.max(a, left), Math.min(b, left + width), top, height);
          else { context.fillStyle = colour("--band"); context.fillRect(a, top, b - a, height); }
          context.strokeStyle = colour("--plain");
          context.setLineDash([4, 4]);
          for (const execute of one.executes) this.upright(context, u.valToPos(execute, "x", true), top, height);
        }
      });
    }

    // over them: notes, and the two instants that are compared
    mark(u) {
      this.inside(u, (context, left, top, width, height, first) => {
        const line = 13 * devicePixelRatio;
        this.spans.filter(span => span.kind === "note").forEach((one, row) => {
          const at = u.valToPos(one.from, "x", true), before = at < left, words = before ? `\u2190 ${one.words}, ${iso(one.from).slice(0, 10)}` : one.words;
          if (at > left + width) return;
          context.strokeStyle = colour("--ink");
          context.setLineDash([2, 2]);
          if (!before) this.upright(context, at, top, height);
          if (!first) return;
          const wide = context.measureText(words).width, right = Math.max(at, left) + 4;
          // to the left of its line where there is no room to the right
          const x = right + wide <= left + width ? right : Math.max(left + 2, at - 4 - wide), y = top + height - line * (row % 4 + 1.3);
          context.fillStyle = colour("--page");
          context.fillRect(x - 2, y - line + 3, wide + 4, line);
          context.fillStyle = colour("--ink");
          context.fillText(words, x, y);
        });
        context.setLineDash([]);
        context.strokeStyle = context.fillStyle = colour("--limit");
        context.font = `bold ${context.font}`;
        this.at.forEach((at, k) => {
          if (at === null) return;
          const x = u.valToPos(at, "x", true);
          this.upright(context, x, top, height);
          context.fillText("AB"[k], x + 3 * devicePixelRatio, top + height - 4 * devicePixelRatio);
        });
      });
    }

    upright(context, at, top, height) {
      const x = Math.round(at) + 0.5;
      context.beginPath();
      context.moveTo(x, top);
      context.lineTo(x, top + height);
      context.stroke();
    }

    hatch(context, from, to, top, height) {
      context.save();
      context.beginPath();
      context.rect(from, top, Math.max(2, to - from), height);
      context.clip();
      context.strokeStyle = colour("--plain");
      context.beginPath();
      for (let x = from - height; x < to + height; x += 7) { context.moveTo(x, top + height); context.lineTo(x + height, top); }
      context.stroke();
      context.restore();
    }

    clip() {
      const [first, last] = this.whole, most = last - first;
      let width = Math.min(most, Math.max(SMALLEST_S, this.span[1] - this.span[0]));
      const begin = Math.min(Math.max(first, this.span[0]), last - width);
      this.span = [begin, begin + width];
    }

    zoom(from, to) { this.span = [from, to]; this.clip(); this.moved(); }

    do(what, far = false) {
      const [from, to] = this.span, width = to - from, middle = (from + to) / 2;
      if (what === "all") this.zoom(...this.whole);
      else if (what === "in") this.zoom(middle - width / 4, middle + width / 4);
      else if (what === "out") this.zoom(middle - width, middle + width);
      else if (what === "earlier") this.zoom(from - width / 2, to - width / 2);
      else if (what === "later") this.zoom(from + width / 2, to + width / 2);
      else if (what === "left" || what === "right") this.step((what === "left" ? -1 : 1) * (far ? 10 : 1));
      else if (what === "a" || what === "b") this.set(what === "a" ? 0 : 1);
      else if (what === "units") { this.si = !this.si; this.moved(true); }
      else if (what === "table") { if (this.readout.hasChildNodes()) this.readout.replaceChildren(); else this.table(); }
    }

    // the instant of the cursor, null where it is not in the panels
    cursor() {
      const plot = this.plots[0], k = plot ? plot.cursor.idx : null;
      return k === null || k === undefined ? null : plot.data[0][k];
    }

    set(which) {
      const at = this.cursor();
      // by whole milliseconds, as the address has it
      this.at[which] = Math.floor(1000 * (at === null ? (this.span[0] + this.span[1]) / 2 : at)) / 1000;
      if (!this.readout.hasChildNodes()) this.table();
      this.moved(true);
    }

    // samples as they are, never in between: the one at or next after an instant
    value(one, at) {
      if (at === null) return null;
      let k = one.x.findIndex(x => x >= at);
      if (k < 0) k = one.x.length - 1;
      return one.y[k] === undefined ? null : one.y[k];
    }

    table() {
      const table = document.createElement("table"), head = table.createTHead().insertRow(), body = table.createTBody();
      const now = this.cursor(), [a, b] = this.at, clock = at => iso(at).slice(11, 23);
      const titles = ["channel", "unit", ...(now === null ? [] : [`at ${clock(now)}`]), ...(a === null ? [] : [`A, ${clock(a)}`]), ...(b === null ? [] : [`B, ${clock(b)}`]), ...(a === null || b === null ? [] : [`B - A, in ${short(b - a)} s`]), "mean", "rms", "smallest", "largest", "values"];
      for (const words of titles) { const th = document.createElement("th"); th.scope = "col"; th.textContent = words; head.append(th); }
      for (const one of this.series) {
        const [factor, unit] = this.unit(one.panel), row = body.insertRow(), inside = one.y.filter((v, k) => v !== null && one.x[k] >= this.span[0] && one.x[k] <= this.span[1]).map(v => v * factor);
        const [here, first, second] = [now, a, b].map(at => { const v = this.value(one, at); return v === null ? null : v * factor; });
        // the smallest and largest of stretches are drawn where there are too many: no mean goes by them
        const whole = one.total < 1.5 * one.drawn && inside.length > 0, sum = power => inside.reduce((t, v) => t + v ** power, 0) / inside.length;
        const name = document.createElement("th");
        name.scope = "row";
        name.textContent = named(one);
        row.append(name);
        const apart = first === null || second === null ? null : second - first;
        const reading = this.reading(one.panel);
        const cells = [unit, ...(now === null ? [] : [reading(here)]), ...(a === null ? [] : [reading(first)]), ...(b === null ? [] : [reading(second)]), ...(a === null || b === null ? [] : [short(apart)]), whole ? reading(sum(1)) : "zoom in", isCompass(one.panel) ? "-" : whole ? short(Math.sqrt(sum(2))) : "zoom in", inside.length ? reading(Math.min(...inside)) : "-", inside.length ? reading(Math.max(...inside)) : "-", String(one.total)];
        for (const words of cells) row.insertCell().textContent = words;
      }
      this.readout.replaceChildren(table);
    }

    step(by) {
      const plot = this.plots[0];
      if (!plot) return;
      const x = plot.data[0], now = plot.cursor.idx === null || plot.cursor.idx === undefined ? 0 : plot.cursor.idx;
      const next = Math.min(x.length - 1, Math.max(0, now + by));
      plot.setCursor({ left: plot.valToPos(x[next], "x"), top: 10 }, true, true);
    }
  }

  // a report has many: each is made when it comes near
  const near = new IntersectionObserver(seen => {
    for (const one of seen.filter(entry => entry.isIntersecting)) {
      near.unobserve(one.target);
      const node = one.target.querySelector(".chart");
      node.hidden = false;
      new Chart(node, charts.indexOf(node));
    }
  }, { rootMargin: "600px" });
  const charts = Array.from(document.querySelectorAll(".chart"));
  charts.forEach((node, number) => { if (node.hidden) near.observe(node.parentElement); else new Chart(node, number); });
})();
