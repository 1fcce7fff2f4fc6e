"use strict";
/* The switch between the two scores is CSS; here: sorting tables, and the views of the scenes. */
const score = () => document.querySelector("input[name=score]:checked").value;

/* A cell's value under the score that is shown: its own, one for both, or its text. */
function keyOf(row, column) {
  const cell = row.cells[column];
  return cell.dataset[score()] ?? cell.dataset.sort ?? cell.textContent.trim();
}

function compare(a, b, column, sign) {
  const [x, y] = [keyOf(a, column), keyOf(b, column)];
  if (x === "" || y === "") return (x === "") - (y === "");  // what has no value comes last
  const difference = Number(x) - Number(y);
  return sign * (Number.isNaN(difference) ? x.localeCompare(y) : difference);
}

function sortable(table) {
  const body = table.tBodies[0], original = [...body.rows];
  const headings = [...table.querySelectorAll("th[data-column]")];
  let column = null, sign = 1;
  function sort() {
    const rows = [...original];
    if (column !== null) rows.sort((a, b) => compare(a, b, column, sign));
    body.append(...rows);
    table.toggleAttribute("data-sorted", column !== null);
    for (const heading of headings) {
      const here = Number(heading.dataset.column) === column;
      heading.ariaSort = !here ? "none" : sign > 0 ? "ascending" : "descending";
    }
  }
  for (const heading of headings) {
    heading.querySelector("button").addEventListener("click", () => {
      const clicked = Number(heading.dataset.column);
      if (column !== clicked) [column, sign] = [clicked, 1];
      else if (sign > 0) sign = -1;
      else column = null;  // the third time: the order of the paper
      sort();
    });
  }
  document.getElementById("score").addEventListener("change", sort);
}

function room(place) {
  const canvas = place.querySelector("canvas");
  // Until it is clicked, the wheel scrolls the page.
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas) event.stopImmediatePropagation();
  }, { capture: true });
  canvas.addEventListener("pointerdown", () => canvas.focus({ preventScroll: true }));
  const viewer = synfealViewer(canvas, JSON.parse(place.querySelector("script").textContent));
  if (viewer === null) {
    canvas.hidden = place.querySelector(".controls").hidden = true;
    place.querySelector(".fallback").hidden = false;
    return;
  }
  for (const box of place.querySelectorAll(".trajectory")) {
    const show = () => {
      for (let i = Number(box.dataset.start); i < Number(box.dataset.end); i++) {
        viewer.setLine(i, box.checked);
      }
    };
    box.addEventListener("change", show);
    show();
  }
  const [low, high] = [viewer.bounds.low[2], viewer.bounds.high[2]];
  const cut = place.querySelector(".cut"), height = place.querySelector("output");
  const apply = () => {
    const metres = low + Number(cut.value) * (high - low);
    height.textContent = `z = ${metres.toFixed(2)} m`;
    viewer.setCut(Number(cut.value) < 1 ? metres : Infinity);
  };
  cut.addEventListener("input", apply);
  apply();
}

document.querySelectorAll("table.sortable").forEach(sortable);
document.querySelectorAll(".room").forEach(room);
