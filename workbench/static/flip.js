"use strict";
// Shows the prediction after an effect was added, before it, or both.
(() => {
  const button = document.getElementById("flip"), figure = document.getElementById("drawn"), said = document.getElementById("flipped");
  if (!button) return;
  const states = [["", "both are shown"], ["only-after", "after: the set of this page"], ["only-before", "before: the set beside it"]];
  let at = 0;
  function flip() { at = (at + 1) % states.length; figure.className = states[at][0]; said.textContent = states[at][1]; }
  button.addEventListener("click", flip);
})();
