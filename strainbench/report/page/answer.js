// The question, answered from the records: who is within a distance, on a case, within a time.
const UNMEASURED = [10, 20, 40, 60, 100].map((n) => `${n}×${n}`);
const ACCURACIES = [0.001, 0.01, 0.1, 1, 10];
const BUDGETS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 10000];

function askedBlock() {
  const block = data.blocks[byId("asked-block")?.value ?? 0];
  return Object.fromEntries(block.map((value, k) => [BLOCK[k], value]));
}

function answer() {
  const [mm, ms, size] = ["asked-mm", "asked-ms", "asked-size"].map((id) => byId(id).value);
  const block = askedBlock();
  const cells = data.cells.filter(
    (cell) => cell.method !== data.alone && cell.size === size && Object.keys(block).every((key) => cell[key] === block[key]),
  );
  const box = byId("answer");
  if (!cells.length) return box.replaceChildren(...unmeasured(block, size, mm, ms));
  const known = cells.filter((cell) => counts(cell) && cell.mm !== null && cell.time !== null);
  const lacks = (cell) => [cell.time / (ms / 1000), cell.mm / mm];
  const meets = known.filter((cell) => Math.max(...lacks(cell)) <= 1).sort((a, b) => a.time - b.time);
  const misses = known.filter((cell) => !meets.includes(cell)).sort((a, b) => Math.max(...lacks(a)) - Math.max(...lacks(b)));
  const near = misses.slice(0, 3).map((cell) => `${cell.method} ${missing(...lacks(cell))}`);
  const found = meets.map((cell) => `${cell.method}: ${duration(cell.time)}, ${cell.distance.startsWith("<") ? "<" : ""}${distance(cell.mm)}`);
  box.replaceChildren(
    el("strong", {}, found.length ? `${found.join("; ")}.` : "None of those measured."),
    near.length ? ` Nearest misses: ${near.join("; ")}.` : "",
  );
}

function missing(time, far) {
  const parts = [];
  const factor = (value) => (value < 1e5 ? digits(value, value < 1.1 ? 3 : 2) : value.toExponential(1).replace("+", ""));
  if (time > 1) parts.push(`takes ${factor(time)}× the time`);
  if (far > 1) parts.push(`stops at ${factor(far)}× the distance`);
  return parts.join(" and ");
}

function unmeasured(block, size, mm, ms) {
  const cell = data.cells.find((each) => Object.keys(block).every((key) => each[key] === block[key]));
  const resolution = size.split("×")[0];
  const row = record(cell.id);
  const limit = row.limit ? ` --set limit=${row.limit}` : "";
  const run = `strainbench recommend ${quoted(row.scenario)} --set resolution=${resolution}${limit} --to ${mm}mm --within ${ms}ms --results ${quoted(data.folder)} --measure`;
  return [el("strong", {}, `Not measured at ${size}.`), " ", el("code", {}, run)];
}

function askSelects() {
  const options = (values, texts, chosen) =>
    values.map((value, k) => el("option", { value, ...(value === chosen ? { selected: "" } : {}) }, texts[k]));
  byId("asked-mm").append(...options(ACCURACIES, ACCURACIES.map((mm) => `${mm} mm`), 0.1));
  byId("asked-ms").append(...options(BUDGETS, BUDGETS.map((ms) => (ms < 1000 ? `${ms} ms` : `${ms / 1000} s`)), 20));
  const sizes = distinct([...data.sizes, ...(data.grid ? UNMEASURED : [])]);
  byId("asked-size").append(...options(sizes, sizes, data.sizes[0]));
  const blocks = byId("asked-block");
  blocks?.append(...options([...data.blocks.keys()], data.blocks.map(titleOf)));
  byId("question").addEventListener("change", () => {
    answer();
    askCharts();
  });
  answer();
}
