// What was measured of a cell, at the side; the hash names the cell.
const drawer = byId("drawer");

function openDrawer(id, found = null) {
  const cell = cellOf.get(id);
  if (!cell) return;
  drawer.replaceChildren(
    el("button", { type: "button", class: "close", "aria-label": "Close", onclick: closeDrawer }, "✕"),
    el("h2", {}, named(cell.method)),
    el("p", {}, sign(cell), " ", el("strong", {}, WORDS[cell.ending]), why(cell)),
    ...(found ? hard(found) : []),
    list(facts(cell)),
    stepTable(id),
    el("p", { class: "soft" }, "Run it again:"),
    el("pre", {}, command(record(id))),
    el("details", {}, el("summary", {}, "All of its row in runs.csv"), list(Object.entries(record(id)))),
  );
  drawer.hidden = false;
  drawer.scrollTop = 0;
  choose({ cell: id });
}

function closeDrawer() {
  drawer.hidden = true;
  choose({ cell: "" });
}

const why = (cell) => {
  const reason = record(cell.id).reason || cell.why;
  return reason ? `. ${reason}` : ".";
};

function hard(found) {
  return [
    list([
      ["hard case", found.case],
      ["found", `${found.sign} ${found.found}`],
      ["easier neighbour", found.neighbour],
      ["verdict", found.verdict],
    ]),
  ];
}

function list(pairs) {
  const known = pairs.filter(([, value]) => value !== "" && value !== null && value !== undefined);
  return el("dl", {}, ...known.flatMap(([name, value]) => [el("dt", {}, name), el("dd", {}, String(value))]));
}

function facts(cell) {
  const row = record(cell.id);
  const quartiles = cell.low === null ? "" : ` (${milliseconds(cell.low)} to ${milliseconds(cell.high)})`;
  return [
    ["case", [cell.scene, cell.size, cell.limit && `limit ${cell.limit}`, cell.mode].filter(Boolean).join(", ")],
    ["failure", failureOf(cell)],
    ["steps", `${cell.done} of ${cell.planned}`],
    ["time, median", cell.time === null ? "" : `${milliseconds(cell.time)} ms${quartiles}`],
    ["mean of all steps", cell.mean === null ? "" : `${milliseconds(cell.mean)} ms`],
    ["set-up", row.setup_seconds === null ? "" : `${milliseconds(row.setup_seconds)} ms`],
    ["distance", cell.distance && `${cell.distance} mm`],
    ["certified at most", row.distance_bound_max === null ? "" : `${digits(1000 * row.distance_bound_max)} mm`],
    ["violation, gap", [cell.violates, cell.gap === null ? "" : digits(cell.gap)].filter(Boolean).join(", ")],
    ["iterations", row.iterations_mean === null ? "" : digits(row.iterations_mean, 4)],
    ["least principal stretch", row.min_principal_stretch === null ? "" : digits(row.min_principal_stretch, 3)],
    ["jitter", row.jitter === null ? "" : scientific(row.jitter)],
    ["unknowns, limits", [row.variables, row.constraints].filter((n) => n !== null).join(", ")],
    ["peak memory", row.peak_memory_mb === null ? "" : `${digits(row.peak_memory_mb, 3)} MB`],
    ["older", cell.older && `measured ${cell.older}`],
  ];
}

function record(id) {
  const { columns, same, vary, rows } = data.records;
  const row = rows[data.cells.findIndex((cell) => cell.id === id)];
  return Object.fromEntries(columns.map((name) => [name, name in same ? same[name] : row[vary.indexOf(name)]]));
}

function stepTable(id) {
  const steps = data.steps.of[id] ?? [];
  if (!steps.length) return null;
  const longest = Math.max(...steps.map((step) => step[1] ?? 0));
  const bar = (step) =>
    el("span", { class: "bar" }, el("i", { style: `width:${(46 * (step[1] ?? 0)) / (longest || 1)}px` }), milliseconds(step[1]));
  const number = (name, k, scale = 1) => ({
    name,
    number: true,
    sort: (step) => step[k],
    text: (step) => (step[k] === null ? "" : scientific(scale * step[k])),
  });
  const columns = [
    { name: "step", number: true, sort: (step) => step[0], text: (step) => step[0] },
    { name: "ms", sort: (step) => step[1], node: bar },
    number("violation", 2),
    number("gap", 3),
    number("mm", 4, 1000),
    { name: "says", text: (step) => data.steps.said[step[6]] },
  ];
  const free = steps.some((step) => !step[5]) ? "Grey steps had nothing to do; they have no part in the median." : "";
  const whole = table(columns, steps, (step) => ({ class: step[5] ? null : "free" }));
  return el("div", { class: "scroll" }, whole, el("p", { class: "caption" }, free));
}

const scientific = (value) =>
  typeof value !== "number" || value === 0 || (Math.abs(value) >= 1e-4 && Math.abs(value) < 1e4)
    ? digits(value)
    : value.toExponential(1).replace(".0e", "e");

// A word of a shell.
const quoted = (word) => (/^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

function command(row) {
  const settings = (text) => Object.entries(JSON.parse(text || "{}"));
  const scene = row.scenario_source?.startsWith("/") ? row.scenario_source : row.scenario;
  const outside = row.solver_source?.startsWith("/");
  const solver = outside ? row.solver_source : row.solver.split("[")[0];
  const value = (v) => (Array.isArray(v) ? v.join(":") : String(v));
  const sets = settings(row.scenario_parameters).filter(([, v]) => v !== "" && v !== null);
  return [
    `strainbench run ${quoted(scene)} --mode ${row.mode} --solver ${quoted(solver)}`,
    ...sets.map(([k, v]) => `--set ${quoted(`${k}=${value(v)}`)}`),
    `--steps ${row.steps_asked} --tolerance ${row.tolerance}`,
    row.time_limit ? `--time-limit ${row.time_limit}` : "",
    "--rerun",
  ].filter(Boolean).join(" ");
}

document.addEventListener("keydown", (event) => event.key === "Escape" && closeDrawer());
