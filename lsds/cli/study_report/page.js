const MOST_COLOURS = 24; // More groups cannot be told apart.

const isNumber = (value) => typeof value === "number";
const text = (value) => (value === null || value === undefined ? "-" : isNumber(value) ? String(Number.isInteger(value) ? value : Number(value.toPrecision(5))) : String(value));
const safe = (value) => text(value).replace(/&/g, "&amp;").replace(/</g, "&lt;");

// Numbers that differ, some perhaps missing.
function numeric(page) {
  return page.columns.filter(({ key }) => {
    const values = page.rows.map((row) => row[key]).filter((value) => value !== null && value !== undefined);
    return values.every(isNumber) && new Set(values).size > 1;
  });
}

// Words with few different values, which can be told apart by colour.
function grouping(page) {
  return page.columns.filter(({ key }) => {
    const values = page.rows.map((row) => row[key]);
    const different = new Set(values.map(text)).size;
    return !values.every(isNumber) && values.every((value) => value === null || typeof value !== "object") && different > 1 && different <= MOST_COLOURS;
  });
}

function fill(id, columns, none) {
  const select = document.getElementById(id);
  const options = none ? [{ key: "", name: "none" }, ...columns] : columns;
  select.replaceChildren(...options.map(({ key, name }) => new Option(name, key)));
  return select;
}

function traces(page, x, y, colour) {
  const groups = new Map();
  for (const row of page.rows) {
    if (!isNumber(row[x]) || !isNumber(row[y])) continue;
    const name = colour ? text(row[colour]) : "";
    if (!groups.has(name)) groups.set(name, { x: [], y: [], text: [], name: name.replace(/</g, "&lt;"), mode: "markers", type: "scatter", hoverinfo: "text" });
    const trace = groups.get(name);
    trace.x.push(row[x]);
    trace.y.push(row[y]);
    trace.text.push(page.columns.slice(0, 24).map((each) => `${safe(each.name)}: ${safe(row[each.key]).slice(0, 80)}`).join("<br>"));
  }
  return [...groups.values()];
}

function sortable(table) {
  const body = table.tBodies[0];
  const value = (row, at) => { const own = row.cells[at].textContent; return own.trim() !== "" && isFinite(own) ? Number(own) : own; };
  [...table.tHead.rows[0].cells].forEach((head, at) => {
    let up = false;
    head.addEventListener("click", () => {
      up = !up;
      const rows = [...body.rows].sort((one, two) => {
        const a = value(one, at), b = value(two, at);
        const order = isNumber(a) && isNumber(b) ? a - b : String(a).localeCompare(String(b));
        return up ? order : -order;
      });
      body.append(...rows);
    });
  });
}

async function start() {
  document.querySelectorAll("table.rows").forEach(sortable);
  const page = JSON.parse(document.getElementById("data").textContent);
  const axes = numeric(page);
  if (axes.length > 1) {
    document.getElementById("rows").hidden = false;
    await loadLibrary();
    const across = fill("across", axes), up = fill("up", axes), colour = fill("colour", grouping(page), true);
    up.selectedIndex = 1;
    if (colour.length > 1) colour.selectedIndex = 1;
    const plot = document.getElementById("plot");
    plot.textContent = "";
    const draw = () => {
      const title = (select) => ({ title: { text: safe(select.selectedOptions[0].text) }, zeroline: false });
      const layout = { xaxis: title(across), yaxis: title(up), hovermode: "closest", margin: { t: 16 }, showlegend: Boolean(colour.value) };
      return Plotly.react(plot, traces(page, across.value, up.value, colour.value), layout, { responsive: true, displaylogo: false, showTips: false });
    };
    for (const select of [across, up, colour]) select.addEventListener("change", draw);
    await draw();
  }
  document.body.dataset.ready = "yes";
}

start().catch((error) => {
  document.getElementById("rows").hidden = false;
  document.getElementById("plot").textContent = `The plot cannot be drawn: ${error}`;
  throw error;
});
