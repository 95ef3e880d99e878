// Elements, tables, numbers; texts become text nodes, so that no name is markup.
const data = JSON.parse(document.getElementById("records").textContent);
const cellOf = new Map(); // filled when all is unpacked
const byId = (id) => document.getElementById(id);
const distinct = (values) => [...new Set(values)];
const RANK = ["optimal", "feasible", "violated", "out of time", "no answer"];
const WORDS = {
  optimal: "optimal on every step",
  feasible: "within the limits, not optimal",
  violated: "violates the limits",
  "out of time": "out of time",
  "no answer": "no answer",
};
const SIGNS = { optimal: "✓", feasible: "○", violated: "✗", "out of time": "✗", "no answer": "✗" };
const counts = (cell) => cell.ending === "optimal" || cell.ending === "feasible";

function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value !== null && value !== undefined && value !== false) node.setAttribute(name, value);
  }
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}

function mark(method) {
  const look = data.methods[method] ?? {};
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "-1.1 -1.1 2.2 2.2");
  svg.setAttribute("class", "mark");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", look.path ?? "");
  path.setAttribute("fill", look.colour ?? "#444");
  svg.append(path);
  return svg;
}

const named = (method) => el("span", { class: "method" }, mark(method), method);
const sign = (cell) =>
  el("span", { class: `sign ${cell.ending.replaceAll(" ", "-")}`, title: said(cell) }, cell.sign);
const said = (cell) => [WORDS[cell.ending], cell.why, failureOf(cell)].filter(Boolean).join(": ");
const failureOf = (cell) => cell.failure && `${cell.failure}${cell.since === null ? "" : `, first in step ${cell.since}`}`;

// Two significant digits, zeros at the end kept, no powers of ten.
function digits(value, count = 2) {
  if (value === null || value === undefined) return "";
  if (typeof value !== "number" || value === 0) return String(value);
  const rounded = Number(value.toPrecision(count));
  const places = Math.max(0, count - 1 - Math.floor(Math.log10(Math.abs(rounded))));
  return rounded.toFixed(Math.min(places, 100));
}

function withUnit(value, units) {
  const [size, name] = units.find((unit) => Number(value.toPrecision(2)) >= unit[0]) ?? units.at(-1);
  return `${digits(value / size)} ${name}`;
}

const duration = (seconds) => withUnit(seconds, [[1, "s"], [1e-3, "ms"], [1e-6, "µs"]]);
const distance = (mm) =>
  withUnit(mm, [[1000, "m"], [10, "cm"], [1, "mm"], [1e-3, "µm"], [1e-6, "nm"]]);
const milliseconds = (seconds) => (seconds === null ? "" : digits(1000 * seconds));

// Numbers below each other by their points: what a fraction lacks is filled with figure spaces.
function aligned(texts) {
  const longest = Math.max(0, ...texts.map((text) => (text.split(".")[1] ?? "").length));
  return texts.map((text) => {
    const [, fraction] = text.split(".");
    if (!longest || !/\d$/.test(text)) return text;
    const point = fraction === undefined ? "\u2008" : "";
    return text + point + "\u2007".repeat(longest - (fraction ?? "").length);
  });
}

// A table of columns {name, unit, number, wide, text, sort, node} over rows.
function table(columns, rows, about = () => ({})) {
  const heads = columns.map((column) =>
    el(
      "th",
      { scope: "col", class: classes(column) },
      el("button", { type: "button" }, column.name),
      column.unit ? el("small", {}, column.unit) : null,
    ),
  );
  const body = el("tbody");
  const shown = columns.map((column) => {
    const texts = rows.map((row) => String(column.text?.(row) ?? ""));
    return column.number ? aligned(texts) : texts;
  });
  rows.forEach((row, k) => {
    const cells = columns.map((column, j) => {
      const value = column.sort?.(row);
      const attributes = { class: classes(column), "data-sort": value ?? "", ...column.about?.(row) };
      return el("td", attributes, column.node ? column.node(row) : shown[j][k]);
    });
    body.append(el("tr", about(row), ...cells));
  });
  const whole = el("table", {}, el("thead", {}, el("tr", {}, ...heads)), body);
  sortable(whole);
  return whole;
}

const classes = (column) =>
  [column.number && "right", column.wide && "wide", column.class].filter(Boolean).join(" ") || null;

// A click on a head sorts by it, another the other way round; what is empty stays last.
function sortable(whole) {
  const heads = [...whole.tHead.rows].at(-1).cells;
  [...heads].forEach((head, k) => {
    head.querySelector("button")?.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      for (const other of heads) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const body = whole.tBodies[0];
      body.append(...[...body.rows].sort((a, b) => compare(keyOf(a.cells[k]), keyOf(b.cells[k]), down)));
    });
  });
}

const keyOf = (cell) => cell.dataset.sort ?? cell.textContent.trim();

function compare(a, b, down) {
  if (a === "" || b === "") return (a === "") - (b === "");
  const numbers = [Number(a), Number(b)];
  const order = numbers.some(Number.isNaN) ? a.localeCompare(b) : numbers[0] - numbers[1];
  return down ? -order : order;
}

// Tables that came written get the same heads.
function makeSortable(whole) {
  for (const head of whole.tHead?.rows[0]?.cells ?? []) {
    const button = el("button", { type: "button" }, ...head.childNodes);
    head.replaceChildren(button);
  }
  if (whole.tHead) sortable(whole);
}
