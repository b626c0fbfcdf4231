"use strict";
// The toggles of the maps: what is not ticked is not drawn.
for (const map of document.querySelectorAll(".map")) {
  for (const box of map.querySelectorAll("input[data-shows]")) {
    const shown = map.querySelectorAll(`:scope > svg .${box.dataset.shows}`);
    const show = () => shown.forEach((part) => part.classList.toggle("off", !box.checked));
    box.addEventListener("change", show);
    show(); // browsers keep ticks when a page is loaded again
  }
}
