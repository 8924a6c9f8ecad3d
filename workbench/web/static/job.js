"use strict";
// A job's page while it runs: asks for what is new, and goes to what it made.
(() => {
  const node = document.getElementById("job"), active = state => state === "queued" || state === "running";
  let after = Number(node.dataset.after), state = node.dataset.state;
  async function ask() {
    if (document.hidden) return;
    const answer = await fetch(`/jobs/${node.dataset.id}.json?after=${after}`);
    if (!answer.ok) return;
    const job = await answer.json();
    for (const tick of job.ticks) {
      const line = document.createElement("li");
      line.textContent = tick.what;
      document.getElementById("ticks").append(line);
      document.getElementById("now").textContent = tick.what;
      const bar = document.getElementById("bar");
      bar.max = tick.total || 1;
      bar.value = tick.done;
      after = tick.number;
    }
    if (job.state !== state) { state = job.state; document.getElementById("state").textContent = state; }
    if (state === "done") location.replace(job.result.to);
    else if (!active(state)) location.reload();
  }
  async function next() {
    try { await ask(); } catch { document.getElementById("state").textContent = "no answer; asking again"; }
    if (active(state)) setTimeout(next, 500);
  }
  if (active(state)) next();
})();
