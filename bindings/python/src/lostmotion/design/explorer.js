"use strict";
(() => {
  const root = document.querySelector(".explorer");
  const data = JSON.parse(root.querySelector("script").textContent);
  const plot = root.querySelector(".plot");
  const drive = root.querySelector(".drive");
  const axes = [0, data.objectives.length > 1 ? 1 : 0];
  const box = { left: 76, top: 26, right: 14, bottom: 46, width: 560, height: 420 };
  const SPACE = "http://www.w3.org/2000/svg";
  let chosen = 0;
  let pinned = false;

  const make = (name, attributes, parent, text) => {
    const node = document.createElementNS(SPACE, name);
    for (const key in attributes) node.setAttribute(key, attributes[key]);
    if (text !== undefined) node.textContent = text;
    parent.append(node);
    return node;
  };
  const element = (name, parent, text) => {
    const node = document.createElement(name);
    if (text !== undefined) node.textContent = text;
    parent.append(node);
    return node;
  };
  const shown = (value) => {
    if (!Number.isFinite(value)) return "–";
    const size = Math.abs(value);
    if (size >= 1e7 || (size < 1e-3 && size > 0)) {
      const [mantissa, power] = value.toExponential(3).split("e");
      const raised = [...String(Number(power))].map((c) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[c] ?? "⁻").join("");
      return String(Number(mantissa)).replace("-", "−") + "·10" + raised;
    }
    const text = String(Number(value.toPrecision(5)));
    const [whole, ...rest] = text.split(".");
    const grouped = size >= 1e4 ? whole.replace(/\B(?=(\d{3})+$)/g, "\u202f") : whole;
    return [grouped, ...rest].join(".").replace("-", "−");
  };
  const step = (span, count) => {
    const rough = span / count;
    const power = 10 ** Math.floor(Math.log10(rough));
    const next = [[1, 2], [2, 5], [5, 10]].find(([f, g]) => rough < power * Math.sqrt(f * g));
    return power * (next ? next[0] : 10);
  };
  const range = (i) => {
    const values = data.designs.map((d) => d.o[i]).concat(data.start ? [data.start[i]] : []);
    const low = Math.min(...values);
    const high = Math.max(...values);
    const room = 0.07 * (high - low) || 0.05 * Math.abs(high) || 1;
    return [low - room, high + room];
  };
  const title = (i) => data.objectives[i].name + ", " + data.objectives[i].unit;

  function draw() {
    plot.replaceChildren();
    const small = plot.clientWidth < 460;
    box.width = small ? 360 : 560;
    box.height = small ? 320 : 420;
    plot.setAttribute("viewBox", "0 0 " + box.width + " " + box.height);
    const wide = box.width - box.left - box.right;
    const high = box.height - box.top - box.bottom;
    const [x, y] = axes.map(range);
    const at = (o) => [
      box.left + ((o[axes[0]] - x[0]) / (x[1] - x[0])) * wide,
      box.top + ((y[1] - o[axes[1]]) / (y[1] - y[0])) * high,
    ];
    const base = box.top + high;
    const sx = step(x[1] - x[0], small ? 4 : 6);
    for (let k = Math.ceil(x[0] / sx); k * sx <= x[1]; k += 1) {
      const v = k * sx;
      const px = box.left + ((v - x[0]) / (x[1] - x[0])) * wide;
      make("line", { x1: px, x2: px, y1: base, y2: base + 4, stroke: "#5f6368" }, plot);
      make("text", { x: px, y: base + 18, "text-anchor": "middle" }, plot, shown(v));
    }
    const sy = step(y[1] - y[0], 6);
    for (let k = Math.ceil(y[0] / sy); k * sy <= y[1]; k += 1) {
      const v = k * sy;
      const py = box.top + ((y[1] - v) / (y[1] - y[0])) * high;
      make("line", { x1: box.left, x2: box.left + wide, y1: py, y2: py, stroke: "#e4e6e9" }, plot);
      make("text", { x: box.left - 7, y: py + 4, "text-anchor": "end" }, plot, shown(v));
    }
    make("line", { x1: box.left, x2: box.left + wide, y1: base, y2: base, stroke: "#5f6368" }, plot);
    make("text", { x: 4, y: 14 }, plot, title(axes[1]));
    make("text", { x: box.left + wide, y: base + 38, "text-anchor": "end" }, plot, title(axes[0]));
    if (data.start) {
      const [px, py] = at(data.start);
      make("rect", { x: px - 5, y: py - 5, width: 10, height: 10, fill: "#fff", stroke: "#cc3311",
        "stroke-width": 1.6 }, plot);
      const left = px > box.left + wide / 2;
      make("text", { x: px + (left ? -10 : 10), y: py + 4, "text-anchor": left ? "end" : "start" },
        plot, "textbook start");
    }
    data.designs.forEach((d, i) => {
      const [px, py] = at(d.o);
      const dot = make("circle", { cx: px, cy: py, r: 6, tabindex: 0, role: "button",
        "aria-label": "design " + (i + 1), "data-design": i }, plot);
      if (!d.verified) dot.classList.add("off");
      dot.addEventListener("pointerenter", () => { if (!pinned) choose(i); });
      dot.addEventListener("focus", () => choose(i));
      dot.addEventListener("click", () => { pinned = !(pinned && chosen === i); choose(i); });
    });
    choose(chosen);
  }

  const rows = (parent, pairs) => {
    const table = element("table", parent);
    for (const [name, value] of pairs) {
      const line = element("tr", table);
      element("td", line, name);
      element("td", line, value);
    }
  };

  function choose(i) {
    chosen = i;
    const d = data.designs[i];
    for (const dot of plot.querySelectorAll("circle")) {
      dot.classList.toggle("on", Number(dot.dataset.design) === i);
    }
    const kept = [...drive.querySelectorAll("details")].map((node) => node.open);
    drive.replaceChildren();
    element("h3", drive, "Design " + (i + 1) + " of " + data.designs.length
      + (d.verified ? "" : " (grades not yet whole)"));
    rows(drive, data.objectives.map((o, k) => [o.name, shown(d.o[k]) + " " + o.unit]));
    if (d.svg) {
      const picture = element("div", drive);
      picture.innerHTML = d.svg;
    }
    rows(drive, d.values.map(([name, value]) =>
      [name, typeof value === "number" ? shown(value) : value]));
    const more = [["all figures", d.figures], ["margins of the stated limits", d.margins]];
    more.forEach(([name, pairs], k) => {
      const folded = element("details", drive);
      folded.open = Boolean(kept[k]);
      element("summary", folded, name);
      rows(folded, pairs.map(([key, value]) => [key, shown(value)]));
    });
    if (d.toml) {
      const link = element("a", element("p", drive), "drive file (TOML)");
      link.download = "design_" + (i + 1) + ".toml";
      link.href = "data:text/plain;charset=utf-8," + encodeURIComponent(d.toml);
    }
  }

  plot.addEventListener("keydown", (event) => {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (by === undefined) return;
    const next = (chosen + by + data.designs.length) % data.designs.length;
    plot.querySelector('circle[data-design="' + next + '"]').focus();
    event.preventDefault();
  });
  root.querySelectorAll("select").forEach((select, k) => {
    select.addEventListener("change", () => { axes[k] = Number(select.value); draw(); });
  });
  let wide = plot.clientWidth;
  window.addEventListener("resize", () => {
    if (plot.clientWidth !== wide) {
      wide = plot.clientWidth;
      draw();
    }
  });
  draw();
})();
