// Ticked rows of the first table become columns of the second.
"use strict";
(() => {
  const ticks = [...document.querySelectorAll("#datasets input[type=checkbox]")];
  const beside = document.getElementById("beside"), hint = document.getElementById("hint");
  function show() {
    const chosen = ticks.filter(tick => tick.checked);
    beside.hidden = chosen.length < 2;
    hint.hidden = !beside.hidden;
    document.getElementById("side").classList.toggle("screen", beside.hidden);  // nothing of it on paper
    for (const tick of ticks) beside.querySelectorAll(".d" + tick.value).forEach(cell => { cell.hidden = !tick.checked; });
    for (const row of beside.tBodies[0].rows)
      row.hidden = !chosen.some(tick => row.querySelector(".d" + tick.value).textContent.trim());
  }
  ticks.forEach(tick => tick.addEventListener("change", show));
  show();
})();
