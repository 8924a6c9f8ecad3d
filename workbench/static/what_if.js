"use strict";
// Shows the run of one value of the parameter, the one that the slider is at.
(() => {
  const slider = document.getElementById("value"), figure = document.getElementById("tries"), said = document.getElementById("said");
  if (!slider) return;
  const rows = Array.from(document.querySelectorAll("#values tbody tr"));
  function show() {
    const at = Number(slider.value);
    for (const line of figure.querySelectorAll(".line-try")) line.classList.toggle("chosen", line.classList.contains(`try-${at}`));
    rows.forEach((row, k) => { if (k === at) row.setAttribute("aria-current", "true"); else row.removeAttribute("aria-current"); });
    const cells = Array.from(rows[at].children, cell => cell.textContent);
    said.textContent = `${cells[0]} (${cells[1]} standard errors away): log-likelihood changes by ${cells[2]}, free-run error ${cells[3]} %`;
    slider.setAttribute("aria-valuetext", said.textContent);
  }
  figure.classList.add("one-at-a-time");
  slider.addEventListener("input", show);
  show();
})();
