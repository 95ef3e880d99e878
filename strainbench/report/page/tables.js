// Table 1, the list of all cells and the matrix of hard cases, of what the filters leave.
const PAGE = 60; // rows of the list at first

function openable(cell, found) {
  return {
    "data-method": cell.method,
    "data-cell": cell.id,
    tabindex: 0,
    onclick: () => openDrawer(cell.id, found),
    onkeydown: (event) => event.key === "Enter" && openDrawer(cell.id, found),
  };
}

function drawTable1(cells) {
  const ran = cells.filter((cell) => cell.method !== data.alone);
  const blocks = distinct(ran.map(blockOf));
  byId("table1").replaceChildren(...blocks.flatMap((block) => {
    const own = ran.filter((cell) => blockOf(cell) === block);
    const title = titleOf(JSON.parse(block));
    return [el("h3", {}, title), el("div", { class: "scroll" }, tableOf(own))];
  }));
}

function tableOf(cells) {
  const sizes = data.sizes.filter((size) => cells.some((cell) => cell.size === size));
  const rows = distinct(cells.map((cell) => cell.method)).map((method) => ({
    method,
    at: Object.fromEntries(cells.filter((c) => c.method === method).map((c) => [c.size, c])),
  }));
  const last = sizes.at(-1);
  rows.sort((a, b) => worst(a) - worst(b) || (a.at[last]?.time ?? Infinity) - (b.at[last]?.time ?? Infinity));
  const columns = [
    { name: "method", sort: (row) => row.method, node: (row) => named(row.method) },
    ...sizes.flatMap((size) => columnsOf(size, rows)),
    { name: "optimal", unit: "%", number: true, wide: true, class: "group", sort: share, text: (row) => share(row) ?? "" },
  ];
  const whole = table(columns, rows, (row) => openable(row.at[last] ?? Object.values(row.at)[0]));
  const groups = sizes.map((size) => el("th", { colspan: 5, class: "group", scope: "colgroup" }, sizeName(size)));
  whole.tHead.prepend(el("tr", {}, el("th"), ...groups, el("th", { class: "wide group" }, sizes.length > 1 ? "all sizes" : "")));
  return whole;
}

// What is said of a block; the tolerance only where there are several.
const titleOf = ([scene, mode, limit, aim]) =>
  [scene, mode, limit && `${limit} limit`, data.aims.length > 1 && aim].filter(Boolean).join(", ");
const worst = (row) => Math.max(...Object.values(row.at).map((cell) => RANK.indexOf(cell.ending)));
const sizeName = (size) => (/^\d+×\d+$/.test(size) ? `${size} cells` : size);

function share(row) {
  const cells = Object.values(row.at).filter((cell) => cell.optimal !== null);
  return cells.length ? Math.round(cells.reduce((sum, cell) => sum + cell.optimal, 0) / cells.length) : null;
}

// The five columns of a size; the fastest that is optimal stands out, what does not count is grey.
function columnsOf(size, rows) {
  const at = (row) => row.at[size];
  const optimal = rows.map(at).filter((cell) => cell?.ending === "optimal" && cell.time !== null);
  const fastest = Math.min(...optimal.map((cell) => cell.time));
  const look = (row) => {
    const cell = at(row);
    const bold = cell?.ending === "optimal" && cell.time === fastest;
    return { "data-cell": cell?.id, "data-state": cell && !counts(cell) ? "out" : bold ? "first" : null };
  };
  const column = (name, unit, sort, text, more = {}) => ({
    name, unit, number: true,
    sort: (row) => at(row) && sort(at(row)),
    text: (row) => (at(row) ? text(at(row)) || "–" : ""),
    about: (row) => ({ ...look(row), "data-column": name }),
    ...more,
  });
  const span = (cell) => (cell.low === null ? "" : `${milliseconds(cell.low)} – ${milliseconds(cell.high)}`);
  return [
    { name: "✓", class: "group centre", sort: (row) => at(row) && RANK.indexOf(at(row).ending), node: (row) => (at(row) ? sign(at(row)) : "") },
    column("time", "ms", (cell) => cell.time, (cell) => milliseconds(cell.time)),
    { ...column("quartiles", "ms", (cell) => cell.low, span, { wide: true }), number: false, class: "right soft" },
    column("distance", "mm", (cell) => cell.mm, (cell) => cell.distance),
    column("violation", "strain", (cell) => cell.violation, (cell) => cell.violates, { wide: true }),
  ];
}

function drawCells(cells, all = false) {
  const rows = cells.filter((cell) => !state.method || related(cell.method));
  const shown = all ? rows : rows.slice(0, PAGE);
  const text = (name, key, more = {}) => ({ name, sort: (cell) => cell[key], text: (cell) => cell[key], ...more });
  const number = (name, unit, key, form, more = {}) => ({
    name, unit, number: true, sort: (cell) => cell[key], text: form,
    about: (cell) => ({ "data-column": key, "data-state": counts(cell) ? null : "out" }), ...more,
  });
  const several = (key) => distinct(data.cells.map((cell) => cell[key])).length > 1;
  const columns = [
    { name: "method", sort: (cell) => cell.method, node: (cell) => named(cell.method) },
    several("scene") && text("scene", "scene", { wide: true }),
    several("mode") && text("mode", "mode", { wide: true }),
    text("size", "size", { sort: (cell) => data.sizes.indexOf(cell.size) }),
    several("limit") && text("limit", "limit", { number: true, sort: (cell) => data.limits.indexOf(cell.limit) }),
    several("aim") && text("tolerance", "aim", { wide: true, sort: (cell) => data.aims.indexOf(cell.aim) }),
    { name: "✓", class: "centre", sort: (cell) => RANK.indexOf(cell.ending), node: sign },
    number("time", "ms", "time", (cell) => milliseconds(cell.time)),
    number("mean, all steps", "ms", "mean", (cell) => milliseconds(cell.mean), { wide: true }),
    number("distance", "mm", "mm", (cell) => cell.distance),
    number("gap", "", "gap", (cell) => cell.gaps, { wide: true }),
    number("violation", "strain", "violation", (cell) => cell.violates, { wide: true }),
    { name: "why", class: "soft wide", text: (cell) => [cell.why, cell.failure].filter(Boolean).join("; ") },
  ].filter(Boolean);
  const more = el("button", { type: "button", class: "more", onclick: () => drawCells(cells, true) }, `Show all ${rows.length}`);
  byId("cells").replaceChildren(
    el("p", { class: "caption" }, `${rows.length} of ${data.cells.length} cells.`),
    el("div", { class: "scroll" }, table(columns, shown, (cell) => openable(cell))),
    ...(shown.length < rows.length ? [more] : []),
  );
  dim();
}

function drawMatrix() {
  const box = byId("matrix");
  if (!box) return;
  const cases = distinct(data.failures.map((line) => line.case));
  const rows = distinct(data.failures.map((line) => line.method)).map((method) => {
    const own = data.failures.filter((line) => line.method === method);
    return { method, own, passed: own.filter((line) => line.sign === "✓").length, partly: own.filter((line) => line.sign === "○").length };
  });
  rows.sort((a, b) => b.passed - a.passed || b.partly - a.partly);
  const of = (row, title) => row.own.find((line) => line.case === title);
  const columns = [
    { name: "method", sort: (row) => row.method, node: (row) => named(row.method) },
    ...cases.map((title) => ({
      name: heading(title),
      class: "case",
      sort: (row) => "✓○✗".indexOf(of(row, title)?.sign ?? ""),
      node: (row) => square(of(row, title)),
    })),
    { name: `✓ of ${cases.length}`, number: true, sort: (row) => row.passed, text: (row) => row.passed },
    { name: "worst of it", class: "soft wide worst", text: worstOf },
  ];
  box.replaceChildren(table(columns, rows, (row) => ({ "data-method": row.method })));
}

function heading(title) {
  const [scene, ...settings] = title.split(", ");
  return el("span", { title }, el("b", {}, scene), ` ${settings.join(", ")}`);
}

function square(line) {
  if (!line) return "";
  const look = { "✓": "optimal", "○": "feasible", "✗": "violated" }[line.sign];
  const title = [line.method, line.case, line.found, line.verdict].filter(Boolean).join("; ");
  const open = () => openDrawer(line.cell, line);
  return el("button", { type: "button", class: `square ${look}`, title, onclick: open }, line.sign);
}

function worstOf(row) {
  const line = row.own.find((each) => each.sign === "✗") ?? row.own.find((each) => each.sign === "○");
  if (!line) return "";
  const [scene, ...settings] = line.case.split(", ");
  return `${settings.join(", ") || scene}: ${line.found}`;
}

// A small grid a method: outcomes over two settings, where it was run.
function drawMaps() {
  const box = byId("maps");
  if (!box) return;
  const { names, levels, spots } = data.map;
  const grids = Object.entries(spots).map(([method, own]) => {
    const at = (i, j) => own.find((spot) => spot[0] === i && spot[1] === j);
    const rows = levels.y.map((level, j) =>
      el("tr", {}, el("th", { scope: "row" }, level), ...levels.x.map((_, i) => el("td", {}, mapSpot(at(i, j), method, names, [levels.x[i], level])))),
    );
    const heads = levels.x.map((level) => el("th", { scope: "col", class: "case" }, el("span", {}, level)));
    const foot = el("tr", {}, el("th", {}, `${names.y} ↑ ${names.x} →`), ...heads);
    const grid = el("table", { class: "map" }, el("tbody", {}, ...rows.reverse(), foot));
    return el("figure", { "data-method": method }, el("figcaption", {}, named(method)), el("div", { class: "scroll" }, grid));
  });
  box.replaceChildren(
    el("h3", {}, `Map over ${names.x} and ${names.y}`),
    el("p", { class: "caption" }, "✓ optimal on every step, ○ within the limits, ✗ violated, ◔ out of time, ∅ no answer; empty: not run, as the cells around it agree. A square opens its record."),
    el("div", { class: "maps" }, ...grids),
  );
}

function mapSpot(spot, method, names, [x, y]) {
  if (!spot) return "";
  const [, , ending, why, id] = spot;
  const cell = cellOf.get(id);
  const title = [`${method} at ${names.x} ${x}, ${names.y} ${y}`, [WORDS[ending], why].filter(Boolean).join(": "), cell?.time ? duration(cell.time) : ""].filter(Boolean).join("; ");
  const look = ending.replaceAll(" ", "-");
  const mark = { "out of time": "◔", "no answer": "∅" }[ending] ?? SIGNS[ending];
  return el("button", { type: "button", class: `square ${look}`, title, onclick: () => openDrawer(id) }, mark);
}
