// What is folded away on the screen is on paper, too.
"use strict";
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach(part => { part.open = true; }));
