// Filters, chips, charts: what is chosen stands in the hash, everything follows it.
const BLOCK = ["scene", "mode", "limit", "aim"];
const FILTERS = [...BLOCK, "size", "ending", "failure"];
const AGAINST = { distance: "distance to the optimum", gap: "relative gap", violation: "violation of the limits" };
const MANY = 6; // blocks: beyond, the page begins with the first
const blockOf = (cell) => JSON.stringify(BLOCK.map((name) => cell[name]));
const state = {};

function readHash() {
  const first = data.blocks.length > MANY ? data.blocks[0] : [];
  const begin = Object.fromEntries(first.map((value, k) => [BLOCK[k], value]));
  const given = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
  const names = [...FILTERS, "method", "cell", "against"];
  for (const name of names) state[name] = given[name] === "*" ? "" : (given[name] ?? begin[name] ?? "");
}

function choose(changes) {
  Object.assign(state, changes);
  const given = Object.entries(state).filter(([, value]) => value !== "");
  const open = BLOCK.filter((name) => data.blocks.length > MANY && state[name] === "");
  const words = new URLSearchParams([...given, ...open.map((name) => [name, "*"])]);
  history.replaceState(null, "", `#${words}`);
}

const isDrawn = (chart) => passes(chart) && (chart.against ?? against()) === against();
const against = () => state.against || "distance";
const passes = (item) => FILTERS.every((name) => !state[name] || item[name] === undefined || item[name] === null || item[name] === state[name]);
const baseOf = (method) => data.methods[method]?.base ?? method;
const related = (method) => method === state.method || baseOf(method) === state.method;

function refresh() {
  const cells = data.cells.filter(passes);
  drawTable1(cells);
  drawCells(cells);
  for (const figure of document.querySelectorAll("figure.chart")) figure.hidden = !isDrawn(data.charts[figure.dataset.chart]);
  for (const select of document.querySelectorAll("#filters select")) select.value = state[select.name];
  drawCharts();
}

function filters() {
  const labels = { ending: "outcome", aim: "tolerance", failure: "kind of failure" };
  const options = { scene: data.scenes, mode: data.modes, limit: data.limits, aim: data.aims, size: data.sizes, ending: RANK.filter((ending) => data.cells.some((cell) => cell.ending === ending)), failure: distinct(data.cells.map((cell) => cell.failure)).sort() };
  for (const name of FILTERS) {
    if (options[name].length < 2) continue;
    const all = el("option", { value: "" }, `every ${labels[name] ?? name}`);
    const each = options[name].map((value) => el("option", { value }, value || "without"));
    const change = (event) => { choose({ [name]: event.target.value }); refresh(); };
    byId("filters").append(el("select", { name, "aria-label": labels[name] ?? name, onchange: change }, all, ...each));
  }
  byId("filters").append(el("button", { type: "button", onclick: () => { choose(Object.fromEntries([...FILTERS, "method"].map((name) => [name, ""]))); refresh(); dim(); } }, `Show all ${data.blocks.length > 1 ? `${data.blocks.length} tables` : "cells"}`));
}

function accuracies() {
  const change = (event) => { choose({ against: event.target.value }); refresh(); };
  const radio = ([value, text]) =>
    el("label", {}, el("input", { type: "radio", name: "against", value, checked: value === against() && "", onchange: change }), ` ${text}`);
  const drawnAgainst = new Set(Object.values(data.charts).map((chart) => chart.against));
  if (drawnAgainst.has("gap")) byId("against").append("Accuracy: ", ...Object.entries(AGAINST).map(radio));
}

function chips() {
  for (const [family, methods] of data.families) {
    const buttons = methods.map((method) =>
      el("button", { type: "button", class: "chip", "data-method": method, "aria-pressed": "false", onclick: () => pick(method) }, mark(method), method));
    byId("chips").append(el("span", { class: "family" }, el("i", {}, family), ...buttons));
  }
}

function pick(method) {
  choose({ method: state.method === method ? "" : method });
  drawCells(data.cells.filter(passes));
  dim();
}

function dim() {
  for (const node of document.querySelectorAll("tr[data-method], .chip")) {
    node.classList.toggle("dim", Boolean(state.method) && !related(node.dataset.method));
    if (node.classList.contains("chip")) node.setAttribute("aria-pressed", String(node.dataset.method === state.method));
  }
  for (const { view } of drawn.values()) tell(view, "chosen", state.method);
}

function download(name, text) {
  const link = el("a", { download: name, href: URL.createObjectURL(new Blob([text], { type: "text/csv" })) });
  link.click();
  URL.revokeObjectURL(link.href);
}

function asCsv() {
  const cell = (value) => (/[",\n]/.test(value ?? "") ? `"${value.replaceAll('"', '""')}"` : (value ?? ""));
  const lines = data.cells.map(({ id }) => Object.values(record(id)).map(cell).join(","));
  return `${[data.records.columns.join(","), ...lines].join("\n")}\n`;
}

function links() {
  for (const link of document.querySelectorAll("a[href^='#']")) {
    link.addEventListener("click", (event) => {
      event.preventDefault(); // the hash holds what is chosen
      byId(link.getAttribute("href").slice(1)).scrollIntoView();
    });
  }
  byId("records-csv")?.addEventListener("click", () => download("runs.csv", asCsv()));
}

async function begin() {
  Object.assign(data, await unpacked(byId("packed").textContent)); // cells, records, steps
  for (const cell of data.cells) cellOf.set(cell.id, cell);
  if (!data.cells.length) return;
  document.querySelectorAll("main table").forEach(makeSortable);
  readHash();
  chips();
  filters();
  accuracies();
  links();
  askSelects();
  drawMatrix();
  drawMaps();
  refresh();
  if (state.cell) openDrawer(state.cell);
}
begin();
