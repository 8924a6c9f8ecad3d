"use strict";
// A job's page while it runs: asks for what is new, draws how the fit goes, and goes to what it made.
(() => {
  const node = document.getElementById("job"), active = state => state === "queued" || state === "running";
  const section = document.getElementById("climb"), rows = document.getElementById("iterations");
  const put = (id, text) => { const one = document.getElementById(id); if (one.textContent !== text) one.textContent = text; };
  const digits = (value, kind) => kind === "error" ? String(Number(value.toPrecision(3))) : value.toFixed(1);
  // a live region that spoke of every iteration would never be silent
  const SPEAK_MS = 10_000;
  let after = Number(node.dataset.after), state = node.dataset.state, what = document.getElementById("now").textContent;
  let spoken = Date.now();

  // what the table has is what is drawn: as workbench/web/draw/climb.py does
  const iterations = () => Array.from(rows.rows, row => {
    const [iteration, , likelihood, error] = Array.from(row.cells, cell => Number(cell.textContent));
    return { iteration, climb: row.dataset.climb, fitted: row.dataset.fitted === "yes", log_likelihood: likelihood, error };
  });

  function append(tick) {
    const one = tick.figures, row = rows.insertRow();
    row.dataset.climb = one.climb;
    if (one.fitted) row.dataset.fitted = "yes";
    const error = one.error === null ? "-" : String(Number((100 * one.error).toPrecision(5)));
    for (const [text, kind] of [[one.iteration, "n"], [tick.what, ""], [one.log_likelihood.toFixed(4), "n"], [error, "n"]]) {
      const cell = row.insertCell();
      cell.textContent = text;
      cell.className = kind;
    }
    if (rows.rows.length > Number(section.dataset.most)) rows.deleteRow(0);
  }

  function ends(values, rises) {
    const ordered = values.toSorted((a, b) => a - b), n = ordered.length;
    let low = ordered[0], high = ordered[n - 1];
    const quarter = rises ? ordered[Math.floor(n / 4)] : ordered[n - 1 - Math.floor(n / 4)];
    if (rises && quarter < high) low = Math.max(low, high - 3 * (high - quarter));
    if (!rises && quarter > low) high = Math.min(high, low + 3 * (quarter - low));
    const room = 0.06 * (high - low) || 0.5;
    return [low - room, high + room];
  }

  function draw(shown) {
    const first = shown[0].iteration, last = shown[shown.length - 1].iteration;
    for (const panel of section.querySelectorAll("[data-kind]")) {
      const kind = panel.dataset.kind, points = shown.filter(one => Number.isFinite(one[kind]));
      if (!points.length) continue;
      const [left, top, width, height] = ["x", "y", "width", "height"].map(name => Number(panel.querySelector("rect").getAttribute(name)));
      const [low, high] = ends(points.map(one => one[kind]), kind === "log_likelihood");
      let line = "", dots = "", climb = "";
      for (const one of points) {
        const x = left + width * (one.iteration - first) / Math.max(last - first, 1);
        const y = top + height * (high - Math.min(Math.max(one[kind], low), high)) / (high - low);
        const at = `${x.toFixed(1)} ${y.toFixed(1)}`;
        if (one.fitted) dots += `M${at}h.01`;
        else line += one.climb === climb ? `L${at}` : `M${at}h.01`;
        climb = one.climb;
      }
      panel.querySelector(".line-climb").setAttribute("d", line);
      panel.querySelector(".line-fitted").setAttribute("d", dots);
      panel.querySelector(".high").textContent = digits(high, kind);
      panel.querySelector(".low").textContent = digits(low, kind);
    }
    section.querySelector(".first").textContent = first;
    section.querySelector(".last").textContent = last;
  }

  function speak(shown) {
    const first = shown[0], last = shown[shown.length - 1];
    let words = `Iteration ${last.iteration}: log-likelihood ${digits(last.log_likelihood, "log_likelihood")}`;
    if (Number.isFinite(last.error)) {
      words += `, error one step ahead ${digits(last.error, "error")} %`;
      if (first !== last && Number.isFinite(first.error)) words += ` (${digits(first.error, "error")} % at iteration ${first.iteration})`;
    }
    put("sentence", `${words}.`);
    spoken = Date.now();
  }

  function take(ticks) {
    let fitted = false;
    for (const tick of ticks) {
      if (tick.what !== what) {
        what = tick.what;
        const line = document.createElement("li");
        line.textContent = what;
        document.getElementById("ticks").append(line);
        put("now", what);
      }
      if (tick.figures) append(tick);
      fitted ||= Boolean(tick.figures && tick.figures.fitted);
      after = tick.number;
    }
    if (!ticks.length) return;
    const bar = document.getElementById("bar"), last = ticks[ticks.length - 1];
    bar.max = last.total || 1;
    bar.value = last.done;
    if (!ticks.some(tick => tick.figures)) return;
    section.hidden = false;
    const shown = iterations();
    draw(shown);
    if (fitted || !document.getElementById("sentence").textContent || Date.now() - spoken > SPEAK_MS) speak(shown);
  }

  async function ask() {
    if (document.hidden) return;
    const answer = await fetch(`/jobs/${node.dataset.id}.json?after=${after}`);
    if (!answer.ok) return;
    const job = await answer.json();
    take(job.ticks);
    if (job.state !== state) { state = job.state; put("state", state); }
    if (state === "done") location.replace(job.result.to);
    else if (!active(state)) location.reload();
  }
  async function next() {
    try { await ask(); } catch { document.getElementById("state").textContent = "no answer; asking again"; }
    if (active(state)) setTimeout(next, 500);
  }
  if (active(state)) next();
})();
