// Draws the charts of a report: those in view at once, the others while the page is idle.
(() => {
  let unpacked;
  const unpack = async () => {
    const packed = document.getElementById('plotly-packed').textContent;
    const bytes = Uint8Array.from(atob(packed), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
    const script = document.createElement('script');
    script.textContent = await new Response(stream).text();
    document.head.append(script);
  };
  const drawings = new Map();
  const draw = (place) => {
    if (!drawings.has(place)) drawings.set(place, drawn(place));
    return drawings.get(place);
  };
  const drawn = async (place) => {
    await (unpacked ??= unpack());
    const figure = JSON.parse(document.getElementById(`${place.id}-data`).textContent);
    await Plotly.newPlot(place, figure.data, figure.layout, figure.config);
    place.dataset.drawn = 'yes';
    place.dispatchEvent(new Event('drawn'));
  };
  const places = [...document.querySelectorAll('.chart')];
  const watch = new IntersectionObserver(
    (seen) => seen.filter((one) => one.isIntersecting).forEach((one) => draw(one.target)),
    {rootMargin: '300px'},
  );
  places.forEach((place) => watch.observe(place));
  const rest = async () => {
    const next = places.find((place) => !drawings.has(place));
    if (!next) return;
    await draw(next);
    requestIdleCallback(rest);
  };
  addEventListener('load', () => requestIdleCallback(rest));
  // A chart also has the width of its element on paper.
  const paper = matchMedia('print');
  paper.addEventListener('change', () =>
    drawings.forEach((_, place) => place.dataset.drawn && Plotly.Plots.resize(place)));

  const save = (name, kind, content) => {
    const link = document.createElement('a');
    link.download = name;
    link.href = URL.createObjectURL(new Blob([content], {type: kind}));
    link.click();
  };
  const cells = (trace) =>
    Array.from(trace.y, (y, i) => [JSON.stringify(trace.name), trace.x[i], y].join(','));
  const of = (name) => places.filter((place) => place.id.startsWith(`${name}-`));
  document.querySelectorAll('[data-csv]').forEach((button) =>
    button.addEventListener('click', async () => {
      const [place] = of(button.dataset.csv);
      await draw(place);
      const rows = place._fullData.filter((trace) => trace.x && trace.y).flatMap(cells);
      save(`${button.dataset.csv}.csv`, 'text/csv', ['trace,x,y', ...rows].join('\n'));
    }),
  );
  // The figures of a chart become one picture, each where it is on the page.
  const picture = async (name) => {
    const all = of(name);
    const home = all[0].parentElement.getBoundingClientRect();
    const parts = [];
    for (const place of all) {
      await draw(place);
      const size = {width: place.clientWidth, height: place.clientHeight};
      const url = await Plotly.toImage(place, {format: 'svg', ...size});
      const box = place.getBoundingClientRect();
      const at = `<svg x="${box.left - home.left}" y="${box.top - home.top}" `;
      parts.push(decodeURIComponent(url.split(/,(.*)/s)[1]).replace('<svg ', at));
    }
    const size = `width="${home.width}" height="${home.height}"`;
    return `<svg xmlns="http://www.w3.org/2000/svg" ${size}>${parts.join('')}</svg>`;
  };
  document.querySelectorAll('[data-svg]').forEach((button) =>
    button.addEventListener('click', async () =>
      save(`${button.dataset.svg}.svg`, 'image/svg+xml', await picture(button.dataset.svg))),
  );
})();
