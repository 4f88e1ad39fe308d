"use strict";
(() => {
  const root = document.querySelector(".explorer");
  const data = JSON.parse(root.querySelector(".designs").textContent);
  const plot = root.querySelector(".chart");
  const drive = root.querySelector(".drive");
  let chosen = 0;
  let pinned = false;

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
  // The designs are the trace with numbers; another trace may contain a start of the search.
  const dots = () => plot.data.findIndex((trace) => trace.customdata);
  const point = (event, use) => {
    const [one] = event.points;
    if (one.curveNumber === dots()) use(one.pointIndex);
  };

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
    if (plot.data) Plotly.restyle(plot, { selectedpoints: [[i]] }, [dots()]);
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

  plot.addEventListener("drawn", () => {
    plot.on("plotly_hover", (event) => { if (!pinned) point(event, choose); });
    plot.on("plotly_click", (event) => point(event, (i) => {
      pinned = !(pinned && chosen === i);
      choose(i);
    }));
    choose(chosen);
  });
  plot.addEventListener("keydown", (event) => {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (by === undefined) return;
    choose((chosen + by + data.designs.length) % data.designs.length);
    event.preventDefault();
  });
  root.querySelectorAll("select").forEach((select, k) => {
    select.addEventListener("change", () => {
      const i = Number(select.value);
      const axis = "xy"[k];
      const values = [data.designs.map((d) => d.o[i]), ...(data.start ? [[data.start[i]]] : [])];
      Plotly.update(plot, { [axis]: values }, {
        [`${axis}axis.title.text`]: `${data.objectives[i].name}, ${data.objectives[i].unit}`,
        [`${axis}axis.autorange`]: true,
      });
    });
  });
  choose(chosen);
})();
