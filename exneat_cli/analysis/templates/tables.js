// Sorts a table by a click on a column's heading, and hides the rows of variants. Without scripts, and on paper, tables are
// complete and in the order of the report.
"use strict";

const valueOf = (row, column) => row.cells[column].textContent.trim();
const numberOf = (text) => parseFloat(text.replace(/^[[<>]+/, ""));

function compared(one, other) {
  const [a, b] = [numberOf(one), numberOf(other)];
  if (Number.isNaN(a) || Number.isNaN(b)) {
    return Number.isNaN(a) - Number.isNaN(b) || one.localeCompare(other);
  }
  return a - b;
}

for (const table of document.querySelectorAll("table")) {
  const [body] = table.tBodies;
  const original = [...body.rows];
  [...table.tHead.rows[0].cells].forEach((heading, column) => {
    const button = document.createElement("button");
    button.textContent = heading.textContent;
    heading.replaceChildren(button);
    button.addEventListener("click", () => {
      const before = heading.getAttribute("aria-sort");
      for (const each of table.tHead.rows[0].cells) each.removeAttribute("aria-sort");
      const next = { null: "ascending", ascending: "descending" }[before];
      if (next) heading.setAttribute("aria-sort", next);
      const sign = next === "descending" ? -1 : 1;
      const empty = (row) => valueOf(row, column) === "";
      const order = (a, b) => empty(a) - empty(b) || sign * compared(valueOf(a, column), valueOf(b, column));
      body.append(...(next ? [...original].sort(order) : original));
    });
  });
}

const variantColumn = (table) => [...table.tHead.rows[0].cells].findIndex((cell) => cell.textContent === "variant");
const rows = [...document.querySelectorAll("table")].flatMap((table) => {
  const column = variantColumn(table);
  return column < 0 ? [] : [...table.tBodies[0].rows].map((row) => [valueOf(row, column), row]);
});
const variants = [...new Set(rows.map(([variant]) => variant))];
if (variants.length > 1) {
  const filter = document.getElementById("filter");
  for (const variant of variants) {
    const label = document.createElement("label");
    const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: true });
    box.addEventListener("change", () => {
      for (const [name, row] of rows) if (name === variant) row.hidden = !box.checked;
    });
    label.append(box, ` ${variant}`);
    filter.append(label);
  }
  filter.hidden = false;
}
