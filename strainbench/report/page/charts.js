// Charts, drawn one after the other while nothing else is to do; anew where the page's shape changes.
const drawn = new Map(); // names and views
const narrow = matchMedia("(max-width: 700px)");
let drawing = false;

function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).json();
}

const EAGER = 24; // charts: of more, those are drawn that come near the window
const packs = new Map();

function specsOf(pack) {
  const packed = () => document.querySelector(`[data-specs="${pack}"]`).textContent;
  if (!packs.has(pack)) packs.set(pack, unpacked(packed()));
  return packs.get(pack);
}

async function drawCharts() {
  if (drawing) return;
  drawing = true;
  for (let figure = nextChart(); figure; figure = nextChart()) {
    const name = figure.dataset.chart;
    const target = narrow.matches ? "phone" : "page";
    const specs = await specsOf(data.charts[name].against ?? "");
    drawn.set(name, { target, view: await drawChart(figure, specs[name][target]) });
    figure.classList.add("drawn");
    await new Promise((done) => setTimeout(done));
  }
  drawing = false;
  document.body.dataset.drawn = drawn.size;
}

function nextChart() {
  const target = narrow.matches ? "phone" : "page";
  const shown = [...document.querySelectorAll("figure.chart")].filter((figure) => !figure.hidden);
  const open = shown.filter((figure) => drawn.get(figure.dataset.chart)?.target !== target);
  return shown.length > EAGER ? open.find(isNear) : open[0];
}

function isNear(figure) {
  const { top, bottom } = figure.getBoundingClientRect();
  return bottom > -innerHeight && top < 2 * innerHeight;
}

async function drawChart(figure, spec) {
  const { view } = await vegaEmbed(figure.querySelector(".plot"), spec, { renderer: "svg", actions: false, logLevel: 1 });
  view.addEventListener("click", (event, item) => item?.datum?.cell && openDrawer(item.datum.cell));
  tell(view, "chosen", state.method);
  ask(view);
  return view;
}

function tell(view, name, value) {
  if (view && name in view.getState({ signals: () => true }).signals) view.signal(name, value).runAsync();
}

function ask(view) {
  const [value, seconds] = [Number(byId("asked-mm").value), Number(byId("asked-ms").value) / 1000];
  tell(view, "question", against() === "distance" ? { value, seconds } : null);
}

const askCharts = () => drawn.forEach(({ view }) => ask(view));
narrow.addEventListener("change", drawCharts);
addEventListener("scroll", drawCharts, { passive: true });
