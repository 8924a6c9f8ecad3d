"use strict";
// Says that files are too large before they are sent.
(() => {
  const form = document.getElementById("ingest"), words = document.getElementById("too-large");
  if (!form) return;
  const most = Number(form.dataset.most);
  const size = () => Array.from(form.querySelector("[name=log]").files).reduce((sum, file) => sum + file.size, 0);
  form.addEventListener("change", () => {
    const bytes = size();
    words.hidden = bytes <= most;
    words.textContent = bytes <= most ? "" : `${Math.round(bytes / 1048576)} MiB are more than a page takes. Take them in from a terminal: kempf ingest LOG --vessel NAME`;
  });
  form.addEventListener("submit", event => { if (size() > most) { event.preventDefault(); words.focus(); } });
})();
