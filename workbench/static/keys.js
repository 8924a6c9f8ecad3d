"use strict";
// Keys: each presses something on the page that says so by `data-key`; `?` lists those that this page has.
(() => {
  const OFF = "kempf keys are off";
  const dialog = document.getElementById("keys"), list = dialog.querySelector("dl"), off = dialog.querySelector("input"), button = document.getElementById("show-keys");
  const stored = () => { try { return localStorage.getItem(OFF) === "yes"; } catch { return off.checked; } };
  const named = one => one.title || one.getAttribute("aria-label") || one.textContent.trim();

  function show() {
    if (dialog.open) { dialog.close(); return; }
    const seen = new Set();
    list.replaceChildren();
    for (const one of document.querySelectorAll("[data-key]")) {
      if (seen.has(one.dataset.key) || one.disabled) continue;
      seen.add(one.dataset.key);
      const key = document.createElement("dt"), words = document.createElement("dd");
      key.append(Object.assign(document.createElement("kbd"), { textContent: one.dataset.key.replace("Arrow", "") }));
      words.textContent = named(one);
      list.append(key, words);
    }
    dialog.showModal();
  }

  function press(one) {
    if (/^(INPUT|TEXTAREA|SELECT)$/.test(one.tagName)) { one.closest("details")?.setAttribute("open", ""); one.focus(); } else one.click();
  }

  off.checked = stored();
  off.addEventListener("change", () => { try { localStorage.setItem(OFF, off.checked ? "yes" : "no"); } catch { /* for this page only */ } });
  button.hidden = false;
  button.addEventListener("click", show);
  document.addEventListener("keydown", event => {
    const at = event.target, typing = /^(TEXTAREA|SELECT)$/.test(at.tagName) || at.tagName === "INPUT" && !/^(checkbox|radio|button|submit)$/.test(at.type);
    if (event.ctrlKey || event.metaKey || event.altKey || typing || stored()) return;
    if (event.key === "?") { event.preventDefault(); show(); return; }
    if (dialog.open) return;
    const one = Array.from(document.querySelectorAll("[data-key]")).find(found => found.dataset.key === event.key && !found.disabled);
    if (!one) return;
    event.preventDefault();
    // Shift with an arrow goes ten times as far
    one.dataset.shift = event.shiftKey ? "yes" : "";
    press(one);
  });
})();
