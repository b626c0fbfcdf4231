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
// Tables that are wider than their boxes; the hint goes where they end.
const boxes = document.querySelectorAll(".wide");
const mark = (box) => {
  box.style.setProperty("--box", `${box.clientWidth}px`);
  box.classList.toggle("cut", box.scrollWidth > box.clientWidth);
  box.classList.toggle("end", box.scrollLeft + box.clientWidth >= box.scrollWidth - 1);
};
const sizes = new ResizeObserver((changes) => changes.forEach((change) => mark(change.target)));
for (const box of boxes) {
  sizes.observe(box);
  box.addEventListener("scroll", () => mark(box), { passive: true });
}
