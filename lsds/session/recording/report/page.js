// Index of the last time that is not after t; 0 if all are.
function lastBefore(times, t) {
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle + 1; else high = middle;
  }
  return Math.max(0, low - 1);
}

function showTime(page, t) {
  const stage = page.stages.find((each) => each.begin_s <= t && t < each.end_s);
  document.getElementById("now").textContent = `t = ${t.toFixed(3)} s` + (stage ? `, stage: ${stage.name}` : "");
  for (const image of document.querySelectorAll("img[data-finger]")) {
    const own = page.images[image.dataset.finger];
    const caption = image.nextElementSibling;
    if (!own.t_s.length) { caption.textContent = `${image.dataset.finger}: no image`; continue; }
    const at = lastBefore(own.t_s, t);
    if (own.urls[at]) image.src = own.urls[at]; else image.removeAttribute("src");
    const damaged = own.urls[at] ? "" : " (cannot be read)";
    caption.textContent = `${image.dataset.finger}, image of ${own.t_s[at].toFixed(3)} s${damaged}`;
  }
  const rows = [];
  for (const trace of page.figure.data) {
    if (!trace.meta || !trace.meta.held) continue;
    const value = trace.x[0] <= t ? trace.y[lastBefore(trace.x, t)] : null;
    const row = document.createElement("tr");
    const name = document.createElement("th"), cell = document.createElement("td");
    const axis = page.figure.layout["yaxis" + trace.yaxis.slice(1)].title.text.split(",")[0];
    name.textContent = trace.yaxis === "y" ? trace.name : `${axis}: ${trace.name}`;
    cell.textContent = value === null ? "-" : `${value.toPrecision(4)} ${trace.meta.unit}`;
    row.append(name, cell);
    rows.push(row);
  }
  document.getElementById("values").replaceChildren(...rows);
}

// Names of the stages that do not collide: each in the first row in which it fits, at the visible part of its stage.
function stageNames(page, plot) {
  const axis = plot._fullLayout.xaxis, [from, to] = axis.range, perPx = (to - from) / axis._length;
  const pen = document.createElement("canvas").getContext("2d");
  pen.font = "11px system-ui, sans-serif";
  const [low, high] = page.stage_place, lanes = [-Infinity, -Infinity, -Infinity], names = [];
  for (const stage of page.stages) {
    if (stage.end_s <= from || stage.begin_s >= to) continue;
    const width = (pen.measureText(stage.name).width + 8) * perPx;
    const x = Math.min(Math.max(stage.begin_s, from), to - width);
    const lane = lanes.findIndex((end) => end <= x);
    if (lane < 0) continue;
    lanes[lane] = x + width;
    const y = high - (high - low) * lane / lanes.length;
    names.push({ x, y, xref: "x", yref: "paper", text: stage.name.replace(/</g, "&lt;"), showarrow: false,
      xanchor: "left", yanchor: "top", font: { size: 11, color: "#333" }, borderpad: 0 });
  }
  return names;
}

// The hover events of plotly.js come only where the nearest points change; the time under the mouse is always known.
function followMouse(page, plot) {
  let waiting = false;
  plot.addEventListener("mousemove", (event) => {
    const axis = plot._fullLayout.xaxis, x = event.clientX - plot.getBoundingClientRect().left - axis._offset;
    if (waiting || x < 0 || x > axis._length) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; showTime(page, axis.p2d(x)); });
  });
}

async function start() {
  const page = JSON.parse(document.getElementById("data").textContent);
  await loadLibrary();
  const plot = document.getElementById("plot");
  plot.textContent = "";
  const config = { responsive: true, displaylogo: false, doubleClick: "reset", showTips: false, 
    modeBarButtons: [["toImage", "zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d"]] };
  await Plotly.newPlot(plot, page.figure.data, page.figure.layout, config);
  let naming = false;
  const rename = async () => {
    if (naming) return;
    naming = true;
    try { await Plotly.relayout(plot, { annotations: stageNames(page, plot) }); } finally { naming = false; }
  };
  await rename();
  plot.on("plotly_relayout", (change) => { if (!("annotations" in change)) rename(); });
  const [begin, end] = page.figure.layout.xaxis.range;
  followMouse(page, plot);
  showTime(page, begin + (end - begin) / 2);
  const choose = (row) => { if (row) showTime(page, Number(row.dataset.s)); };
  const events = document.getElementById("events");
  events.addEventListener("click", (event) => choose(event.target.closest("tr[data-s]")));
  events.addEventListener("keydown", (event) => { if (event.key === "Enter") choose(event.target.closest("tr[data-s]")); });
  document.body.dataset.ready = "yes";
}

start().catch((error) => {
  document.getElementById("plot").textContent = `The plots cannot be drawn: ${error}`;
  throw error;
});
